"""What the forward model's polynomials miss, turned into errors of the unknowns: without noise, and of scans.

Without noise, tissue, skin and offset known, what is left of a ramp's answer is the polynomials' own error. The rows
are the virtual probe's. Source of the figures to compare with: Lee & Won, IEEE JBHI 17(2), 2013, and its successors:
0.58 % in size, 3.82 % in depth and 2.51 % in modulus at best.

Several ramps of a scan share what is missed, and no noise tells it. The same scans are answered twice, with the same
noise: as the polynomials say them, and as the tables do. How far a miss moves each unknown is taken to first order at
the truth. Source: Bos, Parameter Estimation for Scientists and Engineers (2007), section 5.7, on the bias of least
squares under a wrong model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from device.measurement.arrays import Array
from device.measurement.parameters import COUNT, EVEN_STD, denormalise, normalise
from device.measurement.quantities import UNKNOWNS, Bound, require
from device.measurement.ramp_modes.answers import RampAnswer, RampAnswers
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.model import RampModel
from device.measurement.ramp_modes.noise import as_one_row
from device.measurement.ramp_modes.radial_profile import RESPONSE
from device.measurement.ramp_modes.surrogate import DEPTH, MODULUS, OFFSET, SIZE, PressRows
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least, at_most
from host_tools.press_models.mode_outcome import evaluated
from host_tools.press_models.mode_statistics import OCTILES, octile_of
from host_tools.press_models.noisy_presses import noisy_scan
from host_tools.press_models.press_samples import draw_parameters, profile_rows
from host_tools.press_models.ramp_training import FURTHER_MM, further_offsets_mm
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
SCANS, RAMPS = 240, (1, 2, 3, 5)
"""So many tell a share of 90 % to 2 %."""
MOVES_AT_MOST, HOLDS_AT_LEAST = 0.4, 0.84
"""A move of 0.4 makes the errors 8 % larger than the spread says."""
HEADER = ("ramps", "size moves by", "depth moves by", "E moves by", "half of them by less than", "the farthest of them",
          "joint region holds, polynomials", "joint region holds, tables")  # fmt: skip


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


class PressedScan(NamedTuple):
    """Of the first ramps of a scan: moves [3] of the unknowns by what is missed, and the answers to both rows."""

    moves: Array
    without: RampAnswer
    missed: RampAnswer


def missed_chapter(
    model: RampModel, tables: ProbeTables, *, scans: int = SCANS, seed: int = 1, jobs: int = -1
) -> Chapter:
    """Return what the polynomials miss of random scans of 1 to 5 ramps, and how often joint regions hold with it.

    Raises `InvalidQuantity` for fewer than two scans.
    """
    require("scans", scans, Bound(2, np.inf, "scans"), "ask for more")
    own = derived_seed(seed, "missed in scans")
    rng = np.random.default_rng(own)
    parameters = draw_parameters(scans, rng)
    longest = len(FURTHER_MM)
    further = [further_offsets_mm(longest, rng)[-1] for _ in range(scans)]
    each = in_parallel(lambda i: _pressed(model, tables, parameters[i], further[i], [own, i]), scans, jobs)
    truth = normalise(parameters)[:, :COUNT]
    rows, benchmarks = [], []
    for ramps, found in zip(RAMPS, zip(*each, strict=True), strict=True):
        moves, *answers = zip(*found, strict=True)
        held = [_size_and_depth_held(truth, of_rows) for of_rows in answers]
        root = np.sqrt(np.mean(np.square(moves), axis=0))
        half_and_all = np.median(np.abs(moves)), np.abs(moves).max()
        rows.append((f"{ramps}", *(f"{one:.2f}" for one in (*root, *half_and_all)), *(f"{h:.0%}" for h in held)))
        benchmarks += _benchmarks(ramps, float(root.max()), held[1])
    return Chapter(
        title="What the forward model's polynomials miss",
        claim=f"{scans} random scans, each answered as polynomials say it and as tables do.",
        source="host_tools/scores/noise_free.py; device/measurement/ramp_modes/surrogate.py",
        benchmarks=tuple(benchmarks),
        tables=(Table("By the number of ramps", HEADER, tuple(rows)),),
    )


def _benchmarks(ramps: int, moves: float, held: float) -> list[Benchmark]:
    case = f"{ramps} ramps" if ramps > 1 else "1 ramp"
    return [
        at_most(case, "root mean square move of an unknown (spreads)", moves, MOVES_AT_MOST),
        at_least(case, "joint region of size and depth holds, rows of the tables", held, HOLDS_AT_LEAST),
    ]


def _size_and_depth_held(truth: Array, answers: Sequence[RampAnswer]) -> float:
    return float(np.mean(np.asarray(evaluated(truth, answers).in_region)[:, 0]))


def _pressed(
    model: RampModel, tables: ProbeTables, parameters: Array, further_mm: Array, seed: list[int]
) -> list[PressedScan]:
    """Return what is found of the first of a scan's ramps, for each number in `RAMPS`."""
    rng = np.random.default_rng(seed)
    offsets_mm = np.append(parameters[OFFSET], further_mm)
    direction_rad = rng.uniform(0, 2 * np.pi, len(offsets_mm))
    each = np.tile(parameters, (len(offsets_mm), 1))
    each[:, OFFSET] = offsets_mm
    said = model.answers.surrogate.rows(normalise(each), direction_rad)
    true = profile_rows(tables, each, direction_rad)
    for rows in (said, true):
        rows[1:, RESPONSE] = rows[0, RESPONSE]
    missed, noise = true - said, model.answers.noise
    noisy = noisy_scan(said, noise, rng)
    # What is missed is in it as it is: drawn as noise as well it would count twice.
    exact = noisy_scan(said, replace(noise, forward=None), rng) + missed
    return [
        PressedScan(
            moved_by(missed[:ramps], said[:ramps], model, parameters, offsets_mm[:ramps], direction_rad[:ramps]),
            model.answer(noisy[:ramps], direction_rad[:ramps]),
            model.answer(exact[:ramps], direction_rad[:ramps]),
        )
        for ramps in RAMPS
    ]


def moved_by(
    missed: Array, rows: Array, model: RampModel, parameters: Array, offsets_mm: Array, direction_rad: Array
) -> Array:
    """Return how far the unknowns [3] of presses at parameters [9] move when `missed` [N, P] is added to `rows` [N, P].

    To first order, over their spreads at the truth. Presses lie at offsets and in directions [N].
    """
    reach_mm = model.answers.reach_mm(len(rows))
    at = np.append(normalise(parameters)[:OFFSET], 2 * offsets_mm / reach_mm - 1)
    posterior = PressPosterior(rows, model.answers.surrogate, model.answers.noise, reach_mm, direction_rad)
    (jacobian,) = posterior.residuals_and_jacobian(at[None])[1]
    covariance = np.linalg.inv(jacobian.T @ jacobian + np.eye(len(at)) / EVEN_STD**2)
    move = covariance @ (jacobian.T @ posterior.whitened(as_one_row(missed)))
    return np.asarray((move / np.sqrt(np.diag(covariance)))[:COUNT])
