"""How near the modes come to the best that any estimate can do: the mean of the posterior, sampled by a library.

Presses are drawn from the forward model and its noise, so the posterior is exactly right, and no estimate has a
smaller mean square error than its mean. Source: Foreman-Mackey et al., emcee, PASP 125 (2013).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import emcee
import numpy as np

from device.measurement.arrays import Array
from device.measurement.mode import Mode
from device.measurement.parameters import PARAMETERS
from device.measurement.quantities import UNKNOWNS, Bound, require
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.model import RAMP_MODES, RampModel
from host_tools.pages.benchmark import Chapter, Table, at_most
from host_tools.press_models.noisy_presses import random_press_set
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed

SCENES = 50
WALKERS, BURN_IN, STEPS = 48, 1000, 1500
AROUND = 0.2
"""Walkers begin this far around the truth, in coordinates; nearer, they would not have forgotten it in time, and the
reference would be better than any estimate can be."""
BOUND_RATIO: dict[Mode, float] = {"standard": 1.3, "precise": 1.15}


class Sampled(NamedTuple):
    """Mean and standard deviation [3] of the reference posterior, and its autocorrelation time in steps."""

    mean: Array
    std: Array
    autocorrelation: float


class OneScene(NamedTuple):
    """Truth, the reference posterior, and a mode's own mean and spread [3]."""

    truth: Array
    reference: Sampled
    mean: Array
    spread: Array


def posterior_chapter(
    model: RampModel,
    *,
    modes: Sequence[Mode] = RAMP_MODES,
    seed: int = 1,
    scenes: int = SCENES,
    jobs: int = -1,
) -> Chapter:
    """Return the root mean square errors of ramp modes over those of the reference posterior."""
    require("scenes", scenes, Bound(2, np.inf, "presses"), "ask for more")
    benchmarks, rows = [], []
    for mode in modes:
        seen = compared(model, mode, seed=derived_seed(seed, f"posterior of {mode}"), scenes=scenes, jobs=jobs)
        error, best, bound = (_rms(part) for part in _parts(seen))
        for i, name in enumerate(UNKNOWNS):
            case = f"{mode}, {name}"
            benchmarks.append(at_most(case, "RMSE over the posterior's", error[i] / best[i], BOUND_RATIO[mode]))
            rows.append((case, *(f"{part[i]:.4f}" for part in (error, best, bound)), f"{error[i] / bound[i]:.2f}"))
        longest = max(one.reference.autocorrelation for one in seen)
        effective = WALKERS * STEPS / longest
        rows.append((f"{mode}, effective samples of the sampler, fewest", f"{effective:.0f}", "", "", ""))
    header = (
        "mode, unknown",
        "RMSE",
        "RMSE of the posterior mean",
        "the posterior's own spread (bound)",
        "RMSE / bound",
    )
    return Chapter(
        title="As good as the reference posterior",
        claim=(
            f"{scenes} presses drawn from the forward model with camera noise and every nuisance; emcee, {WALKERS} "
            f"walkers of {STEPS} steps after {BURN_IN}."
        ),
        source="Foreman-Mackey et al., PASP 125 (2013); host_tools/scores/posterior.py",
        benchmarks=tuple(benchmarks),
        tables=(Table("Root mean square errors", header, tuple(rows)),),
    )


def compared(model: RampModel, mode: Mode, *, seed: int, scenes: int, jobs: int) -> list[OneScene]:
    """Return a mode's answers to random presses of the forward model, beside the reference posterior."""
    answers = model.answers
    evaluation_set = random_press_set(answers.surrogate, answers.noise[mode], scenes, seed)
    rows = evaluation_set.noisy(np.arange(scenes), np.random.default_rng([seed, 1])).astype(np.float64)
    mean, spread = model.networks(rows)

    def one(number: int) -> OneScene:
        truth = evaluation_set.normalised[number].astype(np.float64)
        found = answers.answer(rows[number], mode, mean[number], spread[number])
        reference = sampled(PressPosterior(rows[number], answers.surrogate, answers.noise[mode]), truth, seed + number)
        return OneScene(truth[: len(UNKNOWNS)], reference, found.mean, found.spread)

    return in_parallel(one, scenes, jobs)


def sampled(posterior: PressPosterior, near: Array, seed: int) -> Sampled:
    """Return what a library's sampler makes of a posterior, begun around coordinates [9].

    Differences between walkers lead along the curve that size, depth and modulus share: ter Braak & Vrugt, Stat.
    Comput. 18 (2008).
    """
    rng = np.random.default_rng(seed)
    begin = np.clip(near + AROUND * rng.standard_normal((WALKERS, len(PARAMETERS))), -0.999, 0.999)
    moves = [(emcee.moves.DEMove(), 0.7), (emcee.moves.DESnookerMove(), 0.1), (emcee.moves.StretchMove(), 0.2)]
    sampler = emcee.EnsembleSampler(WALKERS, len(PARAMETERS), posterior.log_density, vectorize=True, moves=moves)
    sampler.random_state = np.random.RandomState(seed).get_state()
    state = sampler.run_mcmc(begin, BURN_IN)
    sampler.reset()
    sampler.run_mcmc(state, STEPS)
    chain = sampler.get_chain(flat=True)[:, : len(UNKNOWNS)]
    time = float(np.max(sampler.get_autocorr_time(tol=0)[: len(UNKNOWNS)]))
    return Sampled(chain.mean(axis=0), chain.std(axis=0), time)


def _parts(seen: list[OneScene]) -> tuple[Array, Array, Array]:
    """Return the mode's errors, the reference's errors and the reference's spreads [n, 3]."""
    return (
        np.array([one.mean - one.truth for one in seen]),
        np.array([one.reference.mean - one.truth for one in seen]),
        np.array([one.reference.std for one in seen]),
    )


def _rms(errors: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(errors**2, axis=0)))
