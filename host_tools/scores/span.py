"""What a load cell whose span is off does to the answers: the one error of force that the noise model leaves out.

A cell that reads every force too large by a ratio is left out because it costs hardly anything, which is measured here
and not assumed: the shift of the linearised answer, over the spread that the answer states. Whether a larger error is
noticed is measured, too: by the misfit, whose power is that of a chi-square test whose mean the error moves.
Source: Kay, Fundamentals of Statistical Signal Processing II (1998), 2.2.3, noncentral chi-square.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import ncx2

from device.measurement.arrays import Array
from device.measurement.estimate import SPOKEN
from device.measurement.mode import Mode
from device.measurement.parameters import COUNT, EVEN_STD, normalise
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.model import RAMP_MODES, RampModel
from device.measurement.ramp_modes.noise import as_one_row
from device.measurement.ramp_modes.surrogate import OFFSET
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Chapter, Table, at_most
from host_tools.press_models.press_samples import draw_parameters, profile_rows
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed

PRESSES, SCANS = 120, 40
SPAN_ERROR_RATIO = 0.005
NEGLIGIBLE = 0.2
"""A shift of so many stated spreads makes errors 2 % larger: they add as squares."""
SCAN_MM = (0.5, 3.0, 4.0)
"""Where the ramps of a scan of three lie."""
LARGER_RATIOS = (0.02, 0.05, 0.1)
HEADER = ("span off by", "in", "noticed by the misfit, one ramp", "scan of three", "size (spreads)", "depth (spreads)",
          "modulus (spreads)")  # fmt: skip
WHERE = {"all presses": True, "presses on the lesion only": False}
"""Whether the reference press has the error, too."""


class Moved(NamedTuple):
    """What an error of a press or a scan does: shift of the answer over its spread [3], and what no answer explains.

    `unexplained`: in standard deviations of the noise; `columns`: how many the row has.
    """

    shift: Array
    unexplained: float
    columns: int


def span_chapter(model: RampModel, tables: ProbeTables, *, jobs: int = -1) -> Chapter:
    """Return by how many of their stated spreads answers shift, root mean square over random presses."""
    parameters = draw_parameters(PRESSES, np.random.default_rng(derived_seed(1, "span")))

    def one(number: int) -> Array:
        alone = np.array([parameters[number, OFFSET]])
        return _moved(model.answers, tables, parameters[number], alone, SPAN_ERROR_RATIO, is_everywhere=True).shift

    rms = _rms(in_parallel(one, PRESSES, jobs))
    return Chapter(
        title=f"A cell whose span is off by {SPAN_ERROR_RATIO:.1%}",
        claim=f"{PRESSES} random presses without noise, at forces {SPAN_ERROR_RATIO:.1%} larger than the cell says.",
        source="host_tools/scores/span.py",
        benchmarks=tuple(
            at_most(f"standard, {SPOKEN[name]}", "shift over stated spread, RMS", float(rms[i]), NEGLIGIBLE)
            for i, name in enumerate(UNKNOWNS)
        ),
        tables=(Table("Larger errors, and whether they are noticed", HEADER,
                      tuple(_row(model, tables, parameters[:SCANS], ratio, where, jobs)
                            for where in WHERE for ratio in LARGER_RATIOS)),),
    )  # fmt: skip


def _row(
    model: RampModel, tables: ProbeTables, parameters: Array, ratio: float, where: str, jobs: int
) -> tuple[str, ...]:
    """Return what an error does to presses [n, 9] pressed once and in a scan; shifts are those of the scan."""

    def of_scan(offsets_mm: Array) -> list[Moved]:
        def one(number: int) -> Moved:
            return _moved(model.answers, tables, parameters[number], offsets_mm, ratio, is_everywhere=WHERE[where])

        return in_parallel(one, len(parameters), jobs)

    found = dict(zip(RAMP_MODES, map(of_scan, (np.array(SCAN_MM[:1]), np.array(SCAN_MM))), strict=True))
    noticed = (
        f"{np.mean([power(one, _critical(model, mode)) for one in of_mode]):.0%}" for mode, of_mode in found.items()
    )
    return f"{ratio:.0%}", where, *noticed, *(f"{one:.2f}" for one in _rms([one.shift for one in found["precise"]]))


def _critical(model: RampModel, mode: Mode) -> float:
    return model.critical[mode].misfit_ratio


def power(moved: Moved, critical_ratio: float) -> float:
    """Return how often the misfit of such a press is above a critical ratio, where noise is what the model says."""
    return float(ncx2.sf(critical_ratio * moved.columns, moved.columns, max(moved.unexplained**2, 1e-12)))


def _moved(
    answers: RampAnswers,
    tables: ProbeTables,
    parameters: Array,
    offsets_mm: Array,
    ratio: float,
    *,
    is_everywhere: bool,
) -> Moved:
    """Return what an error of the span does to presses [9] at offsets [N], linearised about the truth."""
    each = np.tile(parameters, (len(offsets_mm), 1))
    each[:, OFFSET] = offsets_mm
    exact = profile_rows(tables, each)
    off = profile_rows(tables, each, span_ratio=1 + ratio, reference_span_ratio=None if is_everywhere else 1.0)
    reach_mm = answers.reach_mm(len(offsets_mm))
    posterior = PressPosterior(exact, answers.surrogate, answers.noise, reach_mm, np.zeros(len(exact)))
    at = np.append(normalise(parameters[None])[0, :OFFSET], 2 * offsets_mm / reach_mm - 1)
    (jacobian,) = posterior.residuals_and_jacobian(at[None])[1]
    return moved_by(posterior.whitened(as_one_row(off) - as_one_row(exact)), jacobian)


def moved_by(change: Array, jacobian: Array) -> Moved:
    """Return what a whitened change [S] of a row does, for its whitened derivatives [S, k] and even priors."""
    covariance = np.linalg.inv(jacobian.T @ jacobian + np.eye(jacobian.shape[1]) / EVEN_STD**2)
    step = covariance @ jacobian.T @ change
    left = np.append(change - jacobian @ step, step / EVEN_STD)
    return Moved(step[:COUNT] / np.sqrt(np.diag(covariance))[:COUNT], float(np.linalg.norm(left)), len(change))


def _rms(shifts: list[Array]) -> Array:
    return np.asarray(np.sqrt(np.mean(np.square(shifts), axis=0)))
