"""Recordings of ramps on phantoms to what commissioning reads of them: profile rows, and what is known of each phantom.

A recording is of the phantom whose name its file or folder has. Size, depth, modulus and tissue are known to their
tolerances; skin and offset are not known, and may lie beyond what the design's bundle was trained for. The camera's
geometry is that of the probe's file, whatever was known when the recording was made.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from device.measurement.arrays import Array
from device.measurement.parameters import EVEN_STD, NOMINAL, PARAMETERS, RANGES, normalise, slope_of_normalised
from device.measurement.quantities import Bound, InvalidQuantity
from device.measurement.ramp_modes.radial_profile import SeenPresses, press_profiles, seen_presses
from device.measurement.recording.recording import Recording
from host_tools.calibration.gates import CalibrationRejected
from host_tools.scenes.phantom_set import BLOCKS_NEEDED, INCLUSION, INCLUSIONS_NEEDED, PhantomSet, StatedPhantom
from host_tools.scenes.probe import Probe
from host_tools.scenes.stated import SIGMAS, SUFFIX

OTHER_PROBE = "name the file of the probe that made it"
UNKNOWN_STD = 1.0
"""Of skin's coordinates, whose trained ranges end at 1."""
TISSUE_OF = {"tissue_modulus_kpa": "tissue_modulus_kpa", "slab_thickness_mm": "tissue_thickness_mm"}
"""Parameters of a press that a phantom states, by the names in its file."""


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
    recordings: Sequence[Recording], names: Sequence[str], phantoms: PhantomSet, probe: Probe
) -> list[PhantomRamp]:
    """Return the ramps of recordings in files of these names, as made by a probe on phantoms.

    Raises `CalibrationRejected` with everything that contradicts them: another probe, an unknown phantom, one that the
    design's model does not hold, a press that is no ramp, or too few.
    """
    problems = list(_problems(recordings, names, phantoms, probe))
    ramps: list[PhantomRamp] = []
    for recording, name in zip(recordings, names, strict=True):
        phantom = _named(name, phantoms)
        if phantom is None or list(_outside(phantom)):
            continue
        try:
            ramps.append(_ramp(recording, phantom, probe))
        except InvalidQuantity as error:
            problems.append(InvalidQuantity(f"{name}: {error.quantity}", error.value, error.bound, error.action))
    if problems:
        raise CalibrationRejected(problems)
    return ramps


def _ramp(recording: Recording, phantom: StatedPhantom, probe: Probe) -> PhantomRamp:
    by_file = replace(recording, camera=recording.camera.seen_as(probe.geometry))
    seen = seen_presses(press_profiles(by_file)[:1])
    return PhantomRamp(phantom.name, seen, *stated_coordinates(phantom))


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


def _problems(
    recordings: Sequence[Recording], names: Sequence[str], phantoms: PhantomSet, probe: Probe
) -> Iterator[InvalidQuantity]:
    found = {name: _named(name, phantoms) for name in names}
    for recording, name in zip(recordings, names, strict=True):
        if recording.serial != probe.serial:
            bound = f"{probe.serial} as in the probe's file"
            yield InvalidQuantity(f"serial of {name}", recording.serial, bound, OTHER_PROBE)
        span, tolerance = probe.cell.counts_per_n, probe.cell.counts_per_n_tolerance
        if recording.cell and abs(recording.cell.counts_per_n - span) > SIGMAS * tolerance:
            bound = f"within {SIGMAS * tolerance:.3g} of the file's {span:g}"
            action = "name the file of the probe that made it, or correct the file"
            yield InvalidQuantity(f"counts_per_n of {name}", recording.cell.counts_per_n, bound, action)
        if found[name] is None:
            action = "name its file as the phantom is named"
            yield InvalidQuantity(f"phantom of {name}", "none", f"one of the set {phantoms.serial}", action)
    stated = [one for one in found.values() if one]
    for phantom in stated:
        yield from _outside(phantom)
    inclusions = sum(one.inclusion is not None for one in stated)
    for what, count, needed in (
        ("phantoms with an inclusion", inclusions, INCLUSIONS_NEEDED),
        ("bare blocks", len(stated) - inclusions, BLOCKS_NEEDED),
    ):
        if count < needed:
            yield InvalidQuantity(f"recorded {what}", count, f"at least {needed}", "record more of them")


def _outside(phantom: StatedPhantom) -> Iterator[InvalidQuantity]:
    """Yield what a phantom states beyond the ranges of the design's model."""
    for name, (low, high, _) in RANGES.items():
        stated = getattr(phantom, TISSUE_OF.get(name, name), None)
        if stated is not None and not low <= stated <= high:
            action = "cast one inside: the model knows no other"
            yield InvalidQuantity(f"{name} of {phantom.name}", stated, str(Bound(low, high, "")), action)


def _named(name: str, phantoms: PhantomSet) -> StatedPhantom | None:
    return next((one for one in phantoms.phantoms if one.name == name), None)
