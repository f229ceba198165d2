"""What the API answers with, as its OpenAPI schema describes it: states and fault codes as enumerations.

Answers are described, not filtered: fields are only ever added within v1, so a client ignores those it does not know.
Which enumerations may get more values: device/web/contract.py.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, RootModel

from device.fault_table import FaultCode
from device.instrument.press.states import PressState
from device.instrument.self_test.report import SelfTestState, Verdict
from device.instrument.status import JobState, Step
from device.instrument.watch.readiness import HealthPart
from device.measurement.confidence_belt import COVERAGE
from device.measurement.estimate import EstimateStatus
from device.measurement.mode import Mode
from device.records.audit import AuditedAct
from device.records.exams import ExamKind

PressStateCode = StrEnum("PressStateCode", [(state.name, state.code) for state in PressState])  # type: ignore[misc]
"""Every state of a press. (The type check cannot see members that a table makes.)"""


Instant = Annotated[str, Field(json_schema_extra={"format": "date-time"})]
"""A moment of RFC 3339 in UTC."""


class _Body(BaseModel):
    model_config = ConfigDict(extra="allow")


class Holder(_Body):
    """Who has the probe: a press in its mode, or the self-test, and since when."""

    kind: Literal["press", "self_test"]
    id: str
    mode: Mode | None
    since: Instant | None


class Problem(_Body):
    """An error, RFC 9457: `detail` is the cause, `remedy` what to do; `holder` says who has a probe that is busy."""

    type: str
    title: str
    status: int
    detail: str
    code: FaultCode
    remedy: str
    holder: Holder | None = None


class Fault(_Body):
    """A fault or warning: what the screen calls it, the cause with what was measured, and what to do."""

    code: FaultCode
    title: str
    severity: Literal["fault", "warning"]
    cause: str
    remedy: str


class PressResource(_Body):
    """A press; `code` is that of the fault that ended it.

    Of a scan: `ramps`, how many presses on the lesion are complete; `until`, how sure it is asked to be, as half of the
    90 % interval by unknown; `within_s`, in how many seconds. `light_on_s`: how long the LEDs were on, null where the
    daemon ended before the press did.
    """

    id: str
    mode: Mode
    state: JobState
    progress: float
    reason: str
    code: FaultCode | None
    measurement_id: str | None
    warnings: list[Fault]
    light_on_s: float | None
    ramps: int
    until: dict[str, float] | None
    within_s: float | None
    asked_at: Instant | None = None
    exam_id: str | None = None


class PressList(_Body):
    """Presses, newest first; `next` is the `cursor` of the next page, null on the last one."""

    presses: list[PressResource]
    next: str | None


class EstimatedUnknown(_Body):
    """One unknown: its value, 90 % interval and standard deviation, null where there are none.

    `identifiable`: whether the press determines it. Where it does not, `value` and `std` are the middle and the spread
    of what is possible, in mode paper a guess and null, and no measurement: show "not determined". An open end is that
    of the trained range: the truth may lie beyond. In mode paper `std` is the scatter over the frames, and tells
    nothing of how wrong the value may be.
    """

    value: float | None
    low: float | None
    high: float | None
    std: float | None
    identifiable: bool
    low_is_open: bool = False
    high_is_open: bool = False


class EstimateResource(_Body):
    """What a press says of the lesion, by which model and certificate; `reason` is that of the status, in words.

    `model_sha256` is of the network, which commissioned probes share with their design, `model_card_sha256` of the
    card, by which everything that answers is known; "" in older measurements. `interval_level_percent`: how often the
    intervals hold the truth; older measurements lack it, and theirs is 90.
    """

    size_mm: EstimatedUnknown
    depth_mm: EstimatedUnknown
    youngs_modulus_kpa: EstimatedUnknown
    status: EstimateStatus
    reason: str
    mode: Mode
    model: str
    model_sha256: str
    calibration_id: str
    simulated: bool
    model_card_sha256: str = ""
    interval_level_percent: float = 100 * COVERAGE


class MeasuredFeatures(RootModel[dict[str, float]]):
    """The features of the tactile image that the estimate was computed from, by their names."""


class ForceOfFrame(_Body):
    """The force (N) at which a frame was taken, when (s), its role and its ramp's number.

    `t_s` is of a clock that begins when the probe is switched on: only differences within a recording say something.
    Dark frames may be of some seconds before the press was asked for.
    """

    role: str
    ramp: int
    t_s: float
    force_n: float


class ForceCurve(_Body):
    """How a measurement was pressed, frame by frame as they were taken."""

    frames: list[ForceOfFrame]


class KnownTruth(_Body):
    """What a phantom, real or simulated, is known to hold."""

    size_mm: float
    depth_mm: float
    youngs_modulus_kpa: float


class Voided(_Body):
    """Since when, by whom and why a measurement does not count."""

    at: Instant
    by: str
    reason: str


class Exam(_Body):
    """An exam as it is now; its `version` grows with every change, and is what its ETag says.

    `patient_issuer`: who has issued `patient_ref`, as the worklist says; null where nobody has said so. Two issuers may
    give one number to two people: a patient is both together, and null is like no issuer. Answers of before lack it.
    `own_study`: why an exam of the worklist is sent as a study of its own, for the archive to match by hand; one that
    is sent in the ordered study has none.
    """

    id: str
    seq: int
    version: int
    made_at: Instant
    changed_at: Instant
    kind: ExamKind
    patient_ref: str | None
    patient_issuer: str | None = None
    order_number: str | None
    side: Literal["left", "right"] | None
    clock_position: int | None
    nipple_distance_mm: float | None
    operator: str
    note: str
    own_study: str = ""


class ExamList(_Body):
    """Exams, newest first; `next` is the `cursor` of the next page, null on the last one."""

    exams: list[Exam]
    next: str | None


class AuditEntry(_Body):
    """What was done to an exam, a measurement, a press, a token or the settings, `subject`: before, after, and why.

    `by` is who said he did it, `client` who asked: the own screen, a token's name, or the probe by itself. `hash` is
    SHA-256 over the hash of the entry before and this one without it, as JSON with sorted keys and no spaces.
    """

    seq: int
    hash: str
    at: Instant
    by: str
    client: str = ""
    what: AuditedAct
    subject: str
    reason: str
    before: dict[str, Any] | None
    after: dict[str, Any]


class AuditList(_Body):
    """Entries of the audit, newest first; `next` is the `cursor` of the next page, null on the last one."""

    entries: list[AuditEntry]
    next: str | None


class Measurement(_Body):
    """A press that was answered and kept: the answer, what it was computed from, and what was noticed meanwhile.

    `taken_at` is when the press began, some seconds before the measurement is there; `seq` grows as they are kept.
    `exam_id` is the exam that it belongs to now, `voided` why it does not count; its `version` grows when either
    changes, and is what its ETag says. All else stays as it was measured.
    `force_n` is the mean over `frames`, of `ramps` presses on the lesion; `reached`: whether a scan is as sure as was
    asked (`until`, `within_s`), null when nothing was. `serial` and `software` are those of the probe that measured.
    Fields that have a default are missing in older ones.
    """

    id: str
    seq: int
    taken_at: Instant
    mode: Mode
    estimate: EstimateResource
    features: MeasuredFeatures
    force_n: float
    frames: int
    recording_id: str
    truth: KnownTruth | None
    warnings: list[Fault]
    exam_id: str | None
    voided: Voided | None
    version: int
    ramps: int = 1
    until: dict[str, float] | None = None
    within_s: float | None = None
    reached: bool | None = None
    serial: str | None = None
    software: str | None = None


class MeasurementList(_Body):
    """Measurements, newest first; `next` is the `cursor` of the next page, null on the last one."""

    measurements: list[Measurement]
    next: str | None


class Certificate(_Body):
    """A calibration certificate, or the name of its file and the problem of reading it, "" when there is none."""

    id: str
    problem: str


class CalibrationList(_Body):
    """The certificates there are; `active` is the next start's, `in_use` that of this one."""

    active: str | None
    in_use: str | None
    calibrations: list[Certificate]


class Check(_Body):
    """One check of the self-test: the measured value in its unit, its bound in words, and what to do."""

    part: str
    check: str
    verdict: Verdict
    value: float | None
    unit: str
    bound: str
    cause: str
    remedy: str
    code: FaultCode | None


class OfferedMode(_Body):
    """A mode: what one of its presses takes (frames, s, N), how often the lesion is pressed, and what its answer takes
    and is worth.

    `answer_s`: from the last frame to the answer, median of `answer_presses` on this probe; when there was none yet,
    what is expected by the model card and the other modes' presses. Errors and shares are the model card's, of
    simulated or believed presses; null where it says nothing. `reachable_half_width`: half of the narrowest 90 %
    interval that can be had, by unknown in its own unit; `half_width_by_ramps`: what 5, 10, ... 95 % of the inclusions
    have at most.
    """

    mode: Mode
    frames: int
    kind: Literal["hold", "ramp"]
    from_n: float
    to_n: float
    band_n: tuple[float, float]
    seconds: float
    fewest_ramps: int
    most_ramps: int
    answer_s: float | None
    answer_presses: int
    typical_error_percent: dict[str, float] | None
    answered_ratio: float | None
    determined_ratio: dict[str, float] | None
    reachable_half_width: dict[str, float] | None
    half_width_by_ramps: dict[str, dict[str, tuple[float, ...]]]


class NetworkResource(_Body):
    """Where other machines ask, and the SHA-256 of the certificate that they see there: compare it before pairing."""

    url: str
    certificate_sha256: str


class Device(_Body):
    """Which probe it is, how long its LEDs have been on, in which modes it measures, and how it is reached."""

    serial: str
    software: str
    simulated: bool
    light_on_s: float
    default_mode: Mode
    modes: list[OfferedMode]
    network: NetworkResource | None


class SelfTest(_Body):
    """A self-test; `failed` as a state means that it was not brought to its end."""

    simulated: bool
    id: str
    started_at: Instant
    on_block: bool
    weight_n: float | None
    state: SelfTestState
    verdict: Verdict
    results: list[Check]


class SelfTestSummary(_Body):
    """How far the self-test is: the number of checks that are done."""

    id: str
    state: SelfTestState
    verdict: Verdict
    checks: int


class Tare(_Body):
    """A tare that was taken: by how much the zero of force has moved, and how far it is from that of commissioning."""

    moved_n: float
    zero_shift_n: float


class Liveness(_Body):
    """The daemon runs."""

    status: Literal["live"]


class Readiness(_Body):
    """A press can be measured."""

    status: Literal["ready"]


class HealthOfPart(_Body):
    """Whether a part was seen working within the last seconds, and the code of what it tells."""

    ready: bool
    code: FaultCode | None


class Health(_Body):
    """The parts of the probe under a release."""

    release: str
    parts: dict[HealthPart, HealthOfPart]


class UpdateResource(_Body):
    """What runs, and what the updater says: `outcome` is how the last update ended, in words for the operator."""

    running: str
    state: str
    release: str | None
    previous: str | None
    committed: str | None
    pending: str | None
    leaving: str
    floor: int | None
    progress: float | None
    step: str
    reason: str
    outcome: str
    can_roll_back: bool
    history: list[dict[str, Any]]


class GuidanceLine(_Body):
    """What the operator should do now."""

    code: str
    text: str


class ShownAnswer(_Body):
    """What a press says while it is being kept: the fields of the measurement that it will be."""

    taken_at: Instant
    mode: Mode
    estimate: EstimateResource
    truth: KnownTruth | None
    ramps: int
    reached: bool | None


class ScanStatus(_Body):
    """A scan under way, once a press on the lesion is complete: what all of them tell, each by unknown in its own unit.

    `half_width`: half of each 90 % interval now, `expected_half_width` after the next press; unknowns without numbers
    are left out. `next_offset_mm`: how far beside the lesion's middle that goes. `reason`: that of the estimate so far.
    `failed`: why a press since then does not count.
    """

    ramps: int
    most_ramps: int
    value: dict[str, float | None]
    determined: dict[str, bool]
    half_width: dict[str, float]
    expected_half_width: dict[str, float]
    next_offset_mm: float
    reason: str
    failed: str


class RetentionSettings(_Body):
    """The rule: None of both is never."""

    keep_days: float | None
    free_mb: float | None
    saved_first: bool


class DueRecording(_Body):
    """A recording that the rule deletes, and why."""

    recording_id: str
    measurement_id: str
    taken_at: Instant
    size_bytes: int
    why: str


class DueRecordings(_Body):
    """What the rule deletes now, oldest first; `held_back` recordings wait for a backup, the last is of `saved_at`."""

    rule: RetentionSettings
    saved_at: Instant | None
    removals: list[DueRecording]
    held_back: int
    size_bytes: int


class Status(_Body):
    """One moment of the probe. Forces in N, the band and what is still wanted included.

    `answer` is not on the disk yet, and may still fail to get there; a measurement is, once there is its id.
    """

    simulated: bool
    serial: str
    software: str
    release: str
    step: Step
    press_state: PressStateCode
    guidance: GuidanceLine
    force_n: float | None
    mode: Mode
    kind: Literal["ramp", "hold"]
    target_n: float
    band_n: tuple[float, float]
    wanted_n: list[float]
    full_scale_n: float
    frames_taken: int
    frames_needed: int
    press: PressResource | None
    scan: ScanStatus | None
    answer: ShownAnswer | None
    measurement_id: str | None
    self_test: SelfTestSummary | None
    faults: list[Fault]
