"""What a load cell whose span is off does to the answers: the one error of force that the noise model leaves out.

A cell that reads every force too large by a ratio is left out because it costs hardly anything, which is measured here
and not assumed: the shift of the linearised answer, over the spread that the answer states.
"""

from __future__ import annotations

import numpy as np

from device.measurement.arrays import Array
from device.measurement.estimate import SPOKEN
from device.measurement.mode import Mode
from device.measurement.parameters import EVEN_STD, normalise
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.model import RAMP_MODES, RampAnswers
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Chapter, at_most
from host_tools.press_models.press_samples import draw_parameters, profile_rows
from host_tools.press_models.seeds import derived_seed

PRESSES = 120
SPAN_ERROR_RATIO = 0.005
NEGLIGIBLE = 0.2
"""A shift of so many stated spreads makes errors 2 % larger: they add as squares."""


def span_chapter(answers: RampAnswers, tables: ProbeTables) -> Chapter:
    """Return by how many of their stated spreads answers shift, root mean square over random presses."""
    parameters = draw_parameters(PRESSES, np.random.default_rng(derived_seed(1, "span")))
    change = profile_rows(tables, parameters, span_ratio=1 + SPAN_ERROR_RATIO) - profile_rows(tables, parameters)
    benchmarks = []
    for mode in RAMP_MODES:
        shifts = [
            _shift(answers, mode, normalised, of_row)
            for normalised, of_row in zip(normalise(parameters), change, strict=True)
        ]
        rms = np.sqrt(np.mean(np.square(shifts), axis=0))
        benchmarks += [
            at_most(f"{mode}, {SPOKEN[name]}", "shift over stated spread, RMS", float(rms[i]), NEGLIGIBLE)
            for i, name in enumerate(UNKNOWNS)
        ]
    return Chapter(
        title=f"A cell whose span is off by {SPAN_ERROR_RATIO:.1%}",
        claim=f"{PRESSES} random presses without noise, at forces {SPAN_ERROR_RATIO:.1%} larger than the cell says.",
        source="host_tools/scores/span.py",
        benchmarks=tuple(benchmarks),
    )


def _shift(answers: RampAnswers, mode: Mode, normalised: Array, change: Array) -> Array:
    """Return the shift of the linearised answer to one press over its spread [3], for a change [P] of its row."""
    (row,), (jacobian,) = answers.surrogate.rows_and_jacobian(normalised[None])
    weighted = np.linalg.solve(answers.noise[mode].covariance(row), jacobian)
    covariance = np.linalg.inv(jacobian.T @ weighted + np.eye(len(normalised)) / EVEN_STD**2)
    unknowns = slice(len(UNKNOWNS))
    return np.asarray((covariance @ weighted.T @ change)[unknowns] / np.sqrt(np.diag(covariance))[unknowns])
