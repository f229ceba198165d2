"""What a ramp tells when nothing disturbs it: rows without noise, tissue, skin and offset known.

What is left is the surrogate's own error, turned into size, depth and modulus. The rows are the virtual probe's.
Source of the figures to compare with: Lee & Won, IEEE JBHI 17(2), 2013, and its successors: 0.58 % in size, 3.82 % in
depth and 2.51 % in modulus at best.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from device.measurement.arrays import Array
from device.measurement.parameters import denormalise, normalise
from device.measurement.quantities import UNKNOWNS, Bound, require
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.surrogate import DEPTH, MODULUS, SIZE, PressRows
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Chapter, Table, at_most
from host_tools.press_models.mode_statistics import OCTILES, octile_of
from host_tools.press_models.press_samples import draw_parameters, profile_rows
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed

PRESSES, FEWEST_PRESSES = 160, 40
SIZES_MM, DEPTHS_MM, MODULI_KPA = (5.0, 15.0), (4.0, 8.0), (40.0, 120.0)
"""The part of the paper's box for which a figure was asked."""
DETERMINED_SIZES_MM, DETERMINED_DEPTHS_MM = (8.0, 15.0), (4.0, 6.0)
"""The part of it for which one of the modulus was."""
BOUNDS_PERCENT = (0.5, 1.0, 2.5)
ALONG = np.zeros(1)
"""The inclusion lies along the image's rows from the axis."""
STARTS = tuple(product((-0.5, 0.5), (-0.5, 0.5), (-0.7, 0.0, 0.7)))
"""Coordinates of size, depth and modulus from which fits are begun; the best counts, for there are local minima."""


def noise_free_chapter(
    answers: RampAnswers, tables: ProbeTables, *, presses: int = PRESSES, seed: int = 1, jobs: int = -1
) -> Chapter:
    """Return the errors of size, depth and modulus from exact rows, columns weighed as the camera knows them.

    Raises `InvalidQuantity` for fewer than 40 presses, of which there might be none that scores the modulus.
    """
    require("presses without noise", presses, Bound(FEWEST_PRESSES, np.inf, "presses"), "ask for more")
    surrogate, std = answers.surrogate, np.sqrt(np.diag(answers.noise.camera))
    parameters = _parameters(presses, derived_seed(seed, "noise-free"))
    normalised = normalise(parameters)
    rows = in_parallel(lambda i: profile_rows(tables, parameters[i : i + 1])[0], presses, jobs)
    found = np.array(in_parallel(lambda i: known_nuisances_fit(surrogate, rows[i], normalised[i], std), presses, jobs))
    percent = 100 * np.abs(found - parameters[:, : len(UNKNOWNS)]) / parameters[:, : len(UNKNOWNS)]
    inside = _between(parameters[:, SIZE], DETERMINED_SIZES_MM) & _between(parameters[:, DEPTH], DETERMINED_DEPTHS_MM)
    everywhere = np.ones(presses, dtype=bool)
    scored = (everywhere, everywhere, inside)
    parts = [percent[chosen, i] for i, chosen in enumerate(scored)]
    rows_of_table = tuple(
        (name, str(len(part)), *(f"{value:.3f}" for value in (part.mean(), part.std(), part.min(), part.max())))
        for name, part in zip(UNKNOWNS, parts, strict=True)
    )
    return Chapter(
        title="Without noise, all else known",
        claim=(
            f"{presses} random presses of the simulated probe (size 5-15 mm, depth 4-8 mm, 40-120 kPa; the modulus is "
            "scored from 8 mm and down to 6 mm deep), rows without noise, tissue, skin and offset told."
        ),
        source="host_tools/scores/noise_free.py",
        benchmarks=tuple(
            at_most(name, "mean error (%)", float(part.mean()), bound)
            for name, part, bound in zip(UNKNOWNS, parts, BOUNDS_PERCENT, strict=True)
        ),
        tables=(
            Table("Errors in %", ("unknown", "presses", "mean", "SD", "min", "max"), rows_of_table),
            _by_octiles([parameters[chosen, i] for i, chosen in enumerate(scored)], parts),
        ),
    )


def _by_octiles(truths: Sequence[Array], percents: Sequence[Array]) -> Table:
    """Return the mean errors of each unknown by octiles of its truths [n]."""
    rows = []
    for name, truth, percent in zip(UNKNOWNS, truths, percents, strict=True):
        of_octile = [percent[octile_of(truth) == number] for number in range(OCTILES)]
        rows.append((name, *(f"{part.mean():.3f}" if len(part) else "-" for part in of_octile)))
    header = ("unknown", *(f"octile {number + 1}" for number in range(OCTILES)))
    return Table("Mean errors in % by octiles of the truth, lowest first", header, tuple(rows))


def known_nuisances_fit(surrogate: PressRows, row: Array, normalised: Array, std: Array) -> Array:
    """Return size, depth and modulus that fit a row [P] best, the nuisances of coordinates [9] being known.

    Columns count by their standard deviations `std` [P].
    """
    known = normalised[len(UNKNOWNS) :]

    def whole(at: Array) -> Array:
        return np.concatenate([at, known])

    fits = [
        least_squares(
            lambda at: (surrogate.rows(whole(at)[None], ALONG)[0] - row) / std,
            np.array(start),
            jac=lambda at: surrogate.rows_and_jacobian(whole(at)[None], ALONG)[1][0][:, : len(UNKNOWNS)] / std[:, None],
            bounds=(-1.0, 1.0),
            x_scale=1e-2,
            xtol=1e-10,
            ftol=1e-10,
            gtol=1e-12,
        )
        for start in STARTS
    ]
    return denormalise(whole(min(fits, key=lambda fit: fit.cost).x))[: len(UNKNOWNS)]


def _parameters(presses: int, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    drawn = draw_parameters(40 * presses, rng)
    inside = _between(drawn[:, SIZE], SIZES_MM) & _between(drawn[:, DEPTH], DEPTHS_MM)
    return drawn[inside & _between(drawn[:, MODULUS], MODULI_KPA)][:presses]


def _between(values: Array, ends: tuple[float, float]) -> NDArray[np.bool_]:
    return (ends[0] <= values) & (values <= ends[1])
