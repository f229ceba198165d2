"""The eight inclusions of the Breast Mechanical Imager, pressed with this probe.

Two of them are larger than any that the modes are trained for: what is asked is whether the answer, or its refusal, can
be trusted. All eight are counted, too: one that gets no numbers as the guess of
the trained ranges. Source: Egorov & Sarvazyan, IEEE Trans. Medical Imaging 27 (2008),
table II, whose own error in size is 7.5 %.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from device.files.shipped import PROTOCOLS
from device.measurement.arrays import Array
from device.measurement.calibration import Calibration
from device.measurement.confidence_belt import COVERAGE
from device.measurement.estimate import Estimate
from device.measurement.mode import Mode
from device.measurement.parameters import NOMINAL, PARAMETERS
from device.measurement.ramp_modes.estimate import estimate_ramp
from device.measurement.ramp_modes.model import RampModel
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.ramp_modes.surrogate import MODULUS, SIZE
from device.simulation.physics.surface_table import PressRamps
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.phantom_sets import BREAST_IMAGER_SLAB_MM, Phantom, breast_imager
from host_tools.cramer_rao.bounds import limits
from host_tools.cramer_rao.protocol import read_protocol
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least, at_most
from host_tools.press_models.recorded_presses import in_parallel, recorded_press
from host_tools.press_models.seeds import derived_seed, press_seed
from host_tools.scenes.scene import Scene
from host_tools.scores.score_recordings import percent_error

PUBLISHED_PERCENT = 7.5
MEAN_OF_GAUSSIAN = float(np.sqrt(2 / np.pi))
"""Mean size of a Gaussian error of standard deviation one."""

MODE: Mode = "standard"
BOUND_RATIO = 1.3
"""Errors over the least that any estimate can have, at most; one that knows its box may have less."""
REPEATS = 3
"""Recordings of each inclusion, each with camera noise and drifts of its own."""


def breast_imager_chapter(
    model: RampModel, calibration: Calibration, tables: ProbeTables, *, jobs: int = -1
) -> Chapter:
    """Return the errors in size of mode standard, and whether the intervals of the modulus cover."""
    phantoms = list(breast_imager())
    ramps = in_parallel(lambda i: phantoms[i].ramps(), len(phantoms), jobs)
    best = known_at_best(phantoms, jobs=jobs)
    seed = derived_seed(1, "breast imager")
    found = [
        estimates(model, calibration, tables, phantom, solved, press_seed(seed, REPEATS * number))
        for number, (phantom, solved) in enumerate(zip(phantoms, ramps, strict=True))
    ]
    return Chapter(
        title="The Breast Mechanical Imager's eight inclusions",
        claim=f"Spheres 10 mm deep in 35 mm of 5 kPa, {REPEATS} recordings each with every drift.",
        source="Egorov & Sarvazyan, IEEE Trans. Medical Imaging 27 (2008), table II",
        benchmarks=tuple(_benchmarks(phantoms, found, best[:, 0])),
        tables=(
            Table("Each inclusion, mean over its recordings", HEADER, tuple(map(_row, phantoms, found))),
            _bounds(phantoms, best),
        ),
        facts={"published_percent": PUBLISHED_PERCENT},
    )


HEADER = ("size (mm)", "modulus (kPa)", "answered", "size found", "error, others guessed", "size determined",
          "E determined", "90 % interval of E (kPa)")  # fmt: skip


def known_at_best(phantoms: Sequence[Phantom], *, jobs: int = -1) -> Array:
    """Return the least standard deviations of size and modulus [phantom, 2] in %, the mode's box as prior."""
    protocol = read_protocol(PROTOCOLS / f"{MODE}.toml")

    def stds_percent(i: int) -> Array:
        scene = phantoms[i].scene or Scene(phantoms[i].inclusion)
        return np.asarray(100 * limits(scene, protocol).std_with_box[[SIZE, MODULUS]])

    return np.array(in_parallel(stds_percent, len(phantoms), jobs))


def _bounds(phantoms: Sequence[Phantom], best: Array) -> Table:
    truths = [(f"{one.inclusion.size_mm:g}", f"{one.inclusion.youngs_modulus_kpa:g}") for one in phantoms]
    rows = [(*truth, *(f"{std:.0f} %" for std in row)) for truth, row in zip(truths, best, strict=True)]
    rows.append(("all", "mean error", *(f"{error:.1f} %" for error in MEAN_OF_GAUSSIAN * best.mean(axis=0))))
    return Table(
        "Known at best: standard deviations by the Cramer-Rao bound with the box as prior (`host_tools limits`)",
        ("size (mm)", "modulus (kPa)", "size", "Young's modulus"),
        tuple(rows),
    )


def estimates(
    model: RampModel,
    calibration: Calibration,
    tables: ProbeTables,
    phantom: Phantom,
    ramps: PressRamps | None,
    seed: int,
) -> list[Estimate]:
    """Return what the device says of the recordings of one phantom."""
    at = {**NOMINAL, **vars(phantom.inclusion), "slab_thickness_mm": BREAST_IMAGER_SLAB_MM}
    parameters = np.array([at[name] for name in PARAMETERS])
    recordings = (
        recorded_press(tables, parameters, MODE, number, levels=ErrorLevels(), ramps=ramps)
        for number in range(seed, seed + REPEATS)
    )
    return [estimate_ramp(recording, MODE, model, calibration) for recording in recordings]


def _benchmarks(
    phantoms: Sequence[Phantom], found: Sequence[Sequence[Estimate]], best_percent: Array
) -> list[Benchmark]:
    scored = [
        (phantom.inclusion, one, best)
        for phantom, of_one, best in zip(phantoms, found, best_percent, strict=True)
        for one in of_one
        if one.size_mm.value is not None
    ]
    sizes = [
        (100 * abs(e.size_mm.value / t.size_mm - 1), best)
        for t, e, best in scored
        if e.size_mm.identifiable and e.size_mm.value
    ]
    error, least = np.mean(sizes, axis=0) if sizes else (np.nan, np.nan)
    of_all = np.mean([_guessed_percent(phantom, of_one) for phantom, of_one in zip(phantoms, found, strict=True)])
    moduli = [(truth.youngs_modulus_kpa, one.youngs_modulus_kpa) for truth, one, _ in scored]
    covered = [q.low <= truth <= q.high for truth, q in moduli if q.low and q.high]
    least *= MEAN_OF_GAUSSIAN
    return [
        at_most("size, all eight", "mean error (%), those without numbers guessed", float(of_all), PUBLISHED_PERCENT),
        at_most("size, where determined", "mean error (%)", float(error), PUBLISHED_PERCENT),
        at_most(
            "size, where determined", f"mean error over the least, {least:.1f} %", float(error / least), BOUND_RATIO
        ),
        at_least(
            "Young's modulus, where answered", "covered", float(np.mean(covered)) if covered else float("nan"), COVERAGE
        ),
    ]


def _guessed_percent(phantom: Phantom, found: Sequence[Estimate]) -> float:
    """Return the mean error of the size over all recordings of an inclusion, those without numbers guessed."""
    return float(np.mean([percent_error(phantom.inclusion, one, "size_mm") for one in found]))


def _row(phantom: Phantom, found: Sequence[Estimate]) -> tuple[str, ...]:
    answered = [one for one in found if one.size_mm.value is not None]
    known = [one for one in answered if one.size_mm.identifiable]
    moduli = [one for one in answered if one.youngs_modulus_kpa.identifiable]
    size = f"{np.mean([one.size_mm.value for one in answered]):.2f}" if answered else "-"
    ends = [(one.youngs_modulus_kpa.low, one.youngs_modulus_kpa.high) for one in answered]
    interval = "{:.0f} to {:.0f}".format(*np.mean(np.array(ends, dtype=float), axis=0)) if ends else "-"
    truth = phantom.inclusion
    return (
        f"{truth.size_mm:g}", f"{truth.youngs_modulus_kpa:g}", f"{len(answered)} of {len(found)}", size,
        f"{_guessed_percent(phantom, found):.1f} %",
        f"{len(known)}", f"{len(moduli)}", interval,
    )  # fmt: skip
