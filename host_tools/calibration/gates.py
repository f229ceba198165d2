"""What a calibration must measure to become a certificate: each gate with its value, its bound and what to do.

A calibration that fails any of them is rejected, with all that it fails at once; there is no way round a gate.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.calibration import Validity
from device.measurement.estimate import SATURATED_RATIO
from device.measurement.paper_mode.estimate import PAPER_UNITS
from device.measurement.paper_mode.lines import Regression
from device.measurement.paper_mode.trained_press import FORCE_TOLERANCE
from device.measurement.quantities import UNKNOWNS, Bound, Inclusion, InvalidQuantity, require
from device.measurement.recording.recording import RecordedCell, Recording
from device.measurement.recording.tactile_image import saturated_ratio
from device.measurement.recording.untouched_face import UntouchedFace
from host_tools.calibration.certified_probe import lit_beside
from host_tools.scenes.phantom_set import INCLUSIONS_NEEDED
from host_tools.scenes.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW

LEAST_R_SQUARED = dict(zip(PAPER_UNITS, (0.95, 0.95, 0.85), strict=True))
LARGEST_LEFT_OUT_RATIO = dict(zip(PAPER_UNITS, (0.30, 0.30, 0.50), strict=True))
"""Leave-one-out standard deviation over that of the phantoms' feature.

R2 and this ratio of O1, O2, O3 on the nine phantoms of the simulated probe (`host_tools phantom`, `calibrate`): three
good sets (--seed 100, 200, 300) 0.980-0.983, 0.973, 0.899-0.911 and 0.21-0.23, 0.24-0.25, 0.41-0.44. Pressed 3 mm
beside the lesion (--offset-mm 3) 0.94, 0.98, 0.78 and 0.38, 0.21, 0.63; a third of the face wet 0.98, 0.93, 0.87 and
0.21, 0.38, 0.52: the bounds part those from the good ones. Two phantoms' truths exchanged: R2 of O1 0.78 at the median.
Which phantoms are taken counts, too: of nine at random, pressed well, O3 had 0.82 and 0.56, and they are rejected.
"""
LEAST_SPREAD_RATIO = 0.5
"""Part of the box of the network's training that the phantoms must span in each unknown."""
CLOCKS_APART_DAYS = 1.0
"""By so much the clock of the probe may be ahead of the workstation's."""
MAX_DARK_COUNTS = 24.0
"""As the default of the daemon's `light.max_dark_counts`, above which it takes something to shine.

Eight above the black level of an OV9281, 16 of 256 (raspberrypi/libcamera, src/ipa/rpi/vc4/data/ov9281_mono.json).
"""
MOST_ZERO_N = 0.003
"""How far from zero an untouched face may read, as in `device/instrument/watch/zero_watch.py`."""


@dataclass(frozen=True)
class Gate:
    """One quantity of a calibration, its bound, and what to do when it is outside."""

    quantity: str
    value: float
    bound: Bound
    action: str

    @property
    def problem(self) -> InvalidQuantity | None:
        """Return what is wrong, None when the gate is passed."""
        if self.bound.holds(self.value):
            return None
        return InvalidQuantity(self.quantity, f"{self.value:.4g}", str(self.bound), self.action)

    def as_record(self) -> dict[str, object]:
        """Return the gate as JSON object."""
        passes = self.problem is None
        bound = str(self.bound)
        return {"quantity": self.quantity, "value": self.value, "bound": bound, "passes": passes, "action": self.action}


class CalibrationRejected(InvalidQuantity):
    """All that keeps recordings from becoming a certificate, a line each; `problems` has them one by one."""

    def __init__(self, problems: Sequence[InvalidQuantity]) -> None:
        first = problems[0]
        super().__init__(first.quantity, first.value, first.bound, first.action)
        self.problems = tuple(problems)
        self.args = ("\n".join(str(problem) for problem in problems),)

    def __reduce__(self) -> tuple[type[CalibrationRejected], tuple[tuple[InvalidQuantity, ...]]]:  # type: ignore[override]
        """Carry the error to another process."""
        return type(self), (self.problems,)


def require_all(gates: Iterable[Gate], problems: Iterable[InvalidQuantity] = ()) -> None:
    """Raise `CalibrationRejected` with the gates that are not passed and the problems beside them, if any."""
    failed = [*problems, *(gate.problem for gate in gates if gate.problem)]
    if failed:
        raise CalibrationRejected(failed)


def unusable(recordings: Sequence[Recording], force_n: float, phantom_serial: str = "") -> list[InvalidQuantity]:
    """Return what keeps phantom recordings from being one probe's calibration, all of it.

    `phantom_serial` is the set of those that name none.
    """
    problems: list[InvalidQuantity] = []
    for recording in recordings:
        problems += _unusable(recording, force_n)
    return [*problems, *disagreements(recordings, phantom_serial)]


def _unusable(recording: Recording, force_n: float) -> list[InvalidQuantity]:
    """Return what is wrong with one recording alone."""
    problems = [
        InvalidQuantity(name, f"missing in {recording.id}", bound, action)
        for name, value, bound, action in (
            ("truth", recording.truth, "the phantom's inclusion", "add it or leave it out"),
            ("cell", recording.cell, "slope and tare of the load cell", "record the phantom with this software"),
        )
        if value is None
    ]
    press = recording.with_role("press")
    if not press:
        found = f"press frames of {recording.id}"
        return [*problems, InvalidQuantity(found, 0, "at least 1 frames", "record the phantom again")]
    try:
        measured_n = float(np.mean([frame.force_n for frame in press]))
        bound = Bound(force_n * (1 - FORCE_TOLERANCE), force_n * (1 + FORCE_TOLERANCE), "N")
        require(f"mean force of {recording.id}", measured_n, bound, "press the phantom with the force of --force-n")
    except InvalidQuantity as problem:
        problems.append(problem)
    return problems


def identity_of(recording: Recording) -> str:
    """Return what tells a recording from others: the hash of its last frame, for no camera takes a frame twice.

    Not its name or its time: those of an imported one are typed.
    """
    return hashlib.sha256(recording.frames[-1].counts.tobytes()).hexdigest()


def given_again(recordings: Sequence[Recording], names: Sequence[str]) -> Iterator[InvalidQuantity]:
    """Yield each recording that is there again: it would count as evidence of its own."""
    taken = [identity_of(one) for one in recordings]
    for place, name in enumerate(names):
        if (before := taken.index(taken[place])) < place:
            again = f"that of {names[before]} again"
            yield InvalidQuantity(f"recording of {name}", again, "another recording", "give each once")


def disagreements(recordings: Sequence[Recording], phantom_serial: str = "") -> Iterator[InvalidQuantity]:
    """Yield what recordings of one probe's calibration must have in common, and do not; and what is there twice.

    `phantom_serial` is the set of those that name none.
    """
    yield from given_again(recordings, [f"{one.id} of {one.started_at}" for one in recordings])
    for quantity, values, action in _must_agree(recordings, phantom_serial):
        if len(set(values)) > 1:
            found = " and ".join(sorted({str(value) for value in values}))
            yield InvalidQuantity(quantity, found, "the same in all recordings", action)


def _must_agree(recordings: Sequence[Recording], phantom_serial: str) -> Iterable[tuple[str, list[object], str]]:
    """Yield what a certificate says once for all recordings, as they say it.

    The probe and its camera, to which it is bound; counts per newton, by which all forces were read; the set of
    phantoms, on which it rests. Not the cell's tare: forces count from that of each start, whatever was noted before.
    """
    yield "serial", [one.serial for one in recordings], "calibrate each probe on its own"
    settings, sets = "record all phantoms with the same settings", "calibrate on one set of phantoms"
    yield "camera", [one.camera for one in recordings], settings
    yield "counts_per_n", [one.cell.counts_per_n for one in recordings if one.cell], settings
    yield "phantom_serial", [one.phantom_serial or phantom_serial or "none" for one in recordings], sets


def agreed_cell(recordings: Sequence[Recording]) -> RecordedCell:
    """Return the load cell of recordings without `disagreements`; its tare where those that know one know the same."""
    cells = [one.cell for one in recordings if one.cell]
    tares = {one.tare_counts for one in cells if one.tare_counts is not None}
    return RecordedCell(cells[0].counts_per_n, tares.pop() if len(tares) == 1 else None)


def number_gate(recordings: Sequence[Recording]) -> Gate:
    """Return the gate of how many phantoms there are: several recordings of one are evidence of one."""
    bound = Bound(INCLUSIONS_NEEDED, 10_000, "phantoms")
    return Gate("phantoms", len(set(phantom_numbers(recordings))), bound, "record more phantoms")


def phantom_numbers(recordings: Sequence[Recording]) -> list[int]:
    """Return for each recording the number of its phantom; those of one truth are of one, for nothing tells them."""
    known: dict[object, int] = {}
    return [known.setdefault(one.truth or id(one), len(known)) for one in recordings]


def recording_gates(recordings: Sequence[Recording], untouched: UntouchedFace) -> list[Gate]:
    """Return the gates of what was recorded, before anything is fitted; the recordings are usable."""
    spreads = _spread_gates([one.truth for one in recordings if one.truth])
    return [number_gate(recordings), *spreads, *light_gates(recordings, untouched)]


def light_gates(recordings: Sequence[Recording], untouched: UntouchedFace) -> list[Gate]:
    """Return the gates of the light in the recordings: none from outside, and no more than the camera can count."""
    dark, action = Bound(0.0, MAX_DARK_COUNTS, "counts"), "shade the probe, or lower its black level, and record anew"
    return [Gate("dark level", untouched.dark_counts, dark, action), saturation_gate(recordings)]


def saturation_gate(recordings: Sequence[Recording]) -> Gate:
    """Return the gate of pixels that count no further, in the worst frame."""
    saturated = max(saturated_ratio(frame.counts) for one in recordings for frame in one.frames)
    return Gate("saturated pixels", saturated, Bound(0.0, SATURATED_RATIO, ""), "lower the light, and record anew")


def zero_gates(recording: Recording) -> Iterator[Gate]:
    """Yield the gates of the forces' zero: what dark frames read, and lit ones of the untouched face where there are.

    An offset of 3 mN moves the answers of a ramp by more than their intervals, and no misfit tells it. A cell that was
    tared once and has crept since reads zero in dark frames alone: 25 mN made a depth of 9.8 mm 7.9 (6.2 to 9.1).
    """
    bound = Bound(-MOST_ZERO_N, MOST_ZERO_N, "N")
    dark_n = [one.force_n for one in recording.frames if one.role == "dark"]
    action = "take what they read off every force_n, or record again with dark frames that nothing touches"
    yield Gate("mean force of the dark frames", float(np.mean(dark_n)), bound, action)
    if untouched_n := [one.force_n for one in lit_beside(recording)[0]]:
        action = "tare while nothing touches the face, and record again; leave out frames that touch it faintly"
        yield Gate("mean force of the lit, untouched frames", float(np.mean(untouched_n)), bound, action)


def age_gate(validity: Validity, made_at: str) -> Gate:
    """Return the gate of the oldest recording's age: no certificate is expired, or older than its phantoms."""
    life_days = validity.days_left(validity.measured_at)
    age_days = life_days - validity.days_left(made_at)
    bound = Bound(-CLOCKS_APART_DAYS, life_days, "days", high_included=False)
    return Gate("age of the oldest recording", age_days, bound, "check both clocks, or record the phantoms again")


def _spread_gates(truths: Sequence[Inclusion]) -> list[Gate]:
    """Return how much of the training's box the phantoms span in each unknown."""
    spans = np.ptp([truth.as_tuple() for truth in truths], axis=0) / np.subtract(PAPER_BOX_HIGH, PAPER_BOX_LOW)
    bound = Bound(LEAST_SPREAD_RATIO, 100.0, "of the trained range")
    return [
        Gate(f"spread of the phantoms' {name}", float(span), bound, "add phantoms that differ more in it")
        for name, span in zip(UNKNOWNS, spans, strict=True)
    ]


def fit_gates(lines: Sequence[Regression], features: NDArray[np.float64]) -> list[Gate]:
    """Return the gates of the three regressions; `features` [phantoms, 3] are the deformation features."""
    gates = []
    for line, name, spread in zip(lines, PAPER_UNITS, features.std(axis=0, ddof=1), strict=True):
        action = "check the phantoms' truths, wipe face and phantoms, and press on the middle of each inclusion"
        r_squared, left_out = line.r_squared, line.leave_one_out_std / float(spread)
        gates += [
            Gate(f"R2 of {name}", r_squared, Bound(LEAST_R_SQUARED[name], 1.0, ""), action),
            Gate(
                f"leave-one-out error of {name}",
                left_out,
                Bound(0.0, LARGEST_LEFT_OUT_RATIO[name], "of the phantoms' spread"),
                action,
            ),
        ]
    return gates
