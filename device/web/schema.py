"""What the API answers with, as its OpenAPI schema describes it: states and fault codes as enumerations.

Answers are described, not filtered: fields are only ever added within v1, so a client ignores those it does not know.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from device.fault_table import FaultCode
from device.instrument.press.states import PressState
from device.instrument.self_test.report import SelfTestState, Verdict
from device.instrument.status import JobState, Step
from device.instrument.watch.readiness import HealthPart
from device.measurement.mode import Mode

PressStateCode = StrEnum("PressStateCode", [(state.name, state.code) for state in PressState])  # type: ignore[misc]
"""Every state of a press. (The type check cannot see members that a table makes.)"""


class _Body(BaseModel):
    model_config = ConfigDict(extra="allow")


class Problem(_Body):
    """An error, RFC 9457: `detail` is the cause, `remedy` what to do."""

    type: str
    title: str
    status: int
    detail: str
    code: FaultCode
    remedy: str


class Fault(_Body):
    """A fault or warning: what the screen calls it, the cause with what was measured, and what to do."""

    code: FaultCode
    title: str
    severity: Literal["fault", "warning"]
    cause: str
    remedy: str


class PressResource(_Body):
    """A press; `code` is that of the fault that ended it."""

    id: str
    mode: Mode
    state: JobState
    progress: float
    reason: str
    code: FaultCode | None
    measurement_id: str | None
    warnings: list[Fault]
    light_on_s: float


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
    """A mode: what one of its two presses takes (frames, s, N), and what its answer takes and is worth.

    `answer_s`: from the last frame to the answer, median of `answer_presses` on this probe; when there was none yet,
    what is expected by the model card and the other modes' presses. Errors and shares are the model card's, of
    simulated presses; null where it says nothing.
    """

    mode: Mode
    frames: int
    kind: Literal["hold", "ramp"]
    from_n: float
    to_n: float
    seconds: float
    answer_s: float | None
    answer_presses: int
    typical_error_percent: dict[str, float] | None
    answered_ratio: float | None
    determined_ratio: dict[str, float] | None


class Device(_Body):
    """Which probe it is, how long its LEDs have been on, and in which modes it measures."""

    serial: str
    software: str
    simulated: bool
    light_on_s: float
    default_mode: Mode
    modes: list[OfferedMode]


class SelfTest(_Body):
    """A self-test; `failed` as a state means that it was not brought to its end."""

    simulated: bool
    id: str
    started_at: str
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

    taken_at: str
    mode: Mode
    estimate: dict[str, Any]
    truth: dict[str, float] | None


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
    answer: ShownAnswer | None
    measurement_id: str | None
    self_test: SelfTestSummary | None
    faults: list[Fault]


def answers(status: int, model: type[BaseModel]) -> dict[int | str, dict[str, Any]]:
    """Return the description of a route's good answer, for FastAPI's `responses`."""
    return {status: {"model": model}}


def _problem_schema() -> dict[str, Any]:
    """Return the problem's schema; its codes are those of the faults, which the schema names elsewhere already."""
    schema = Problem.model_json_schema(ref_template="#/components/schemas/{model}")
    return {key: value for key, value in schema.items() if key != "$defs"}


PROBLEM: dict[int | str, dict[str, Any]] = {
    "default": {"description": "Any error", "content": {"application/problem+json": {"schema": _problem_schema()}}}
}
"""What every route may answer instead."""
