"""Recordings of ramps on phantoms to what commissioning reads of them: profile rows, and what is known of each phantom.

A recording is of the phantom whose name its file or folder has. Size, depth, modulus and tissue are known to their
tolerances; skin and offset are not known, and may lie beyond what the design's bundle was trained for. The camera's
geometry is that of the probe's file, whatever was known when the recording was made.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from device.measurement.arrays import Array
from device.measurement.parameters import EVEN_STD, NOMINAL, PARAMETERS, RANGES, normalise, slope_of_normalised
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.radial_profile import SeenPresses, press_profile, seen_presses
from device.measurement.recording.recording import Recording
from host_tools.calibration.gates import CalibrationRejected, given_again, saturation_gate, zero_gates
from host_tools.calibration.known_bench import another_set, truth_contradiction
from host_tools.scenes.phantom_set import (
    BLOCKS_NEEDED,
    INCLUSION,
    INCLUSIONS_NEEDED,
    TISSUE_OF,
    PhantomSet,
    StatedPhantom,
)
from host_tools.scenes.probe import Probe
from host_tools.scenes.stated import SIGMAS, SUFFIX

EACH_ALONE = "record each place as a press of mode standard with its own beside, in a file of this name elsewhere"
OTHER_PROBE = "name the file of the probe that made it"
UNKNOWN_STD = 1.0
"""Of skin's coordinates, whose trained ranges end at 1."""


@dataclass(frozen=True, eq=False)
class PhantomRamp:
    """A ramp on a phantom: what is `seen` of its one press, coordinates [9] as stated, and their spread.

    A bare block has no inclusion: only its reference response says something.
    """

    name: str
    seen: SeenPresses
    stated: Array
    std: Array
    has_inclusion: bool


def phantom_ramps(
    recordings: Sequence[Recording],
    names: Sequence[str],
    phantoms: PhantomSet | None,
    probe: Probe | None,
    unread: Sequence[str] = (),
) -> list[PhantomRamp]:
    """Return the ramps of recordings in files of these names, as made by a probe on phantoms.

    `unread` are names of recordings that cannot be read, whose phantoms count as recorded. Without the phantoms or the
    probe, whose file does not hold, only what does not ask for it is told.
    Raises `CalibrationRejected` with everything that contradicts them: another probe, an unknown phantom or another
    truth, one that the design's model does not hold, a press that is no ramp, or too few.
    """
    problems = [
        *chain.from_iterable(_of_probe(one, name, probe) for one, name in zip(recordings, names, strict=True) if probe),
        *chain.from_iterable(_of_press(one, name) for one, name in zip(recordings, names, strict=True)),
        *_of_several_spans(recordings),
        *given_again(recordings, names),
        *(_of_phantoms(recordings, names, phantoms, unread) if phantoms else ()),
    ]
    ramps: list[PhantomRamp] = []
    for recording, name in zip(recordings, names, strict=True):
        try:
            seen = _seen(recording, probe)
        except InvalidQuantity as error:
            problems.append(InvalidQuantity(f"{name}: {error.quantity}", error.value, error.bound, error.action))
            continue
        phantom = _named(name, phantoms)
        if phantom and not list(phantom.outside()):
            ramps.append(PhantomRamp(phantom.name, seen, *stated_coordinates(phantom)))
    if problems:
        raise CalibrationRejected(problems)
    return ramps


def counts_per_n_of(recordings: Sequence[Recording]) -> float | None:
    """Return the span by which recordings took forces, None where none says it."""
    return next((one.cell.counts_per_n for one in recordings if one.cell), None)


def _seen(recording: Recording, probe: Probe | None) -> SeenPresses:
    """Return what is seen of the one press, through the camera of the probe's file."""
    camera = recording.camera.seen_as(probe.geometry) if probe else recording.camera
    return seen_presses([press_profile(replace(recording, camera=camera))])


def stated_coordinates(phantom: StatedPhantom) -> tuple[Array, Array, bool]:
    """Return what a phantom states as coordinates [9], their standard deviations [9], and whether it has an inclusion.

    What it does not state has the middle of its range, and a spread wider than that.
    """
    names = {one: one for one in INCLUSION if phantom.inclusion} | TISSUE_OF
    middle = {name: (RANGES[name].low * RANGES[name].high) ** 0.5 for name in INCLUSION} | NOMINAL | {"offset_mm": 1.0}
    values = np.array([getattr(phantom, names[one]) if one in names else middle[one] for one in PARAMETERS])
    slopes = slope_of_normalised(values)
    std = np.array([
        getattr(phantom, names[one] + SUFFIX) / slope if one in names else UNKNOWN_STD
        for one, slope in zip(PARAMETERS, slopes, strict=True)
    ])  # fmt: skip
    std[PARAMETERS.index("offset_mm")] = EVEN_STD
    return normalise(values), std, phantom.inclusion is not None


def _of_probe(recording: Recording, name: str, probe: Probe) -> Iterator[InvalidQuantity]:
    """Yield what a recording says otherwise than the file of the probe: serial number, frame, span."""
    frame, expected = (f"{one.width_px} x {one.height_px} px" for one in (recording.camera, probe.camera))
    for quantity, value, wanted in (("serial", recording.serial, probe.serial), ("frame", frame, expected)):
        if value != wanted:
            yield InvalidQuantity(f"{quantity} of {name}", value, f"{wanted} as in the probe's file", OTHER_PROBE)
    span, tolerance = probe.cell.counts_per_n, probe.cell.counts_per_n_tolerance
    if recording.cell and abs(recording.cell.counts_per_n - span) > SIGMAS * tolerance:
        bound = f"within {SIGMAS * tolerance:.3g} of the file's {span:g}"
        action = f"{OTHER_PROBE}, or correct the file"
        yield InvalidQuantity(f"counts_per_n of {name}", recording.cell.counts_per_n, bound, action)


def _of_press(recording: Recording, name: str) -> Iterator[InvalidQuantity]:
    """Yield what no fit can make up for: a zero that is off, dark or lit, pixels that count no further, and a scan."""
    for gate in (*zero_gates(recording), saturation_gate([recording])):
        if problem := gate.problem:
            yield InvalidQuantity(f"{problem.quantity} of {name}", problem.value, problem.bound, problem.action)
    # A scan's ramps have one reference, and so its noise and its skin: taken as ramps of their own these count twice.
    if (ramps := len(recording.ramps())) > 1:
        yield InvalidQuantity(f"ramps of {name}", ramps, "1: a scan's presses share what is beside", EACH_ALONE)


def _of_several_spans(recordings: Sequence[Recording]) -> Iterator[InvalidQuantity]:
    spans = sorted({one.cell.counts_per_n for one in recordings if one.cell})
    if len(spans) > 1:
        found = " and ".join(f"{one:g}" for one in spans)
        action = "record all phantoms under one setting: the probe is commissioned for its forces"
        yield InvalidQuantity("counts_per_n of the recordings", found, "the same in all", action)


def _of_phantoms(
    recordings: Sequence[Recording], names: Sequence[str], phantoms: PhantomSet, unread: Sequence[str]
) -> Iterator[InvalidQuantity]:
    """Yield what does not agree with the phantoms' file, and how many of its phantoms are missing."""
    for recording, name in zip(recordings, names, strict=True):
        yield from another_set(recording, name, phantoms)
        phantom = _named(name, phantoms)
        if phantom is None:
            action = "name its file as the phantom is named"
            yield InvalidQuantity(f"phantom of {name}", "none", f"one of the set {phantoms.serial}", action)
        elif contradiction := truth_contradiction(recording, name, phantom):
            yield contradiction
    stated = [one for name in dict.fromkeys((*names, *unread)) if (one := _named(name, phantoms))]
    for phantom in stated:
        yield from phantom.outside()
    inclusions = sum(one.inclusion is not None for one in stated)
    for what, count, needed in (
        ("phantoms with an inclusion", inclusions, INCLUSIONS_NEEDED),
        ("bare blocks", len(stated) - inclusions, BLOCKS_NEEDED),
    ):
        if count < needed:
            yield InvalidQuantity(f"recorded {what}", count, f"at least {needed}", "record more of them")


def _named(name: str, phantoms: PhantomSet | None) -> StatedPhantom | None:
    return next((one for one in phantoms.phantoms if one.name == name), None) if phantoms else None
