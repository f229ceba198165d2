"""How near mode standard comes to the best that any estimate can do: the mean of the posterior, sampled by a library.

Presses are drawn from the forward model and its noise, so the posterior is exactly right, and no estimate has a
smaller mean square error than its mean. The library's sample is trusted as far as its runs agree: one begins around the
truth, the other around the mode's own mean.
Sources: Foreman-Mackey et al., emcee, PASP 125 (2013); Gelman & Rubin, Stat. Sci. 7 (1992) and Vehtari et al., Bayesian
Anal. 16 (2021) on split R-hat, its bound and the fewest effective samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import emcee
import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import PARAMETERS
from device.measurement.quantities import UNKNOWNS, Bound, require
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.model import RampModel
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least, at_most
from host_tools.press_models.noisy_presses import random_press_set
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed

SCENES, RESAMPLED = 200, 2000
"""Few presses err most: how well so many tell a ratio of errors is resampled, and said."""
WALKERS, BURN_IN, STEPS, LONGER = 48, 1000, 1000, 8
"""Runs that do not agree are as much longer as the last: where two hollows explain a press, walkers change rarely."""
MOST_BURN_INS = 4
AROUND = 0.2
"""Walkers begin this far around the truth or the mode's mean, in coordinates; nearer, they would not have forgotten
either in time, and the reference would be better than any estimate can be, or agree with the mode."""
MOVES = ((emcee.moves.DEMove(), 0.8), (emcee.moves.StretchMove(), 0.2))
"""Differences between walkers lead along the curve that size, depth and modulus share: ter Braak, Stat. Comput. 16
(2006). No snooker moves: those of emcee 3.1.6 narrow what they sample, a Gaussian of nine dimensions to 0.87 of its
spread where they are half of all."""
LOST = 15.0
"""A walker is lost whose logarithm of the density stays so far below the best one's: it sits in a hollow that no other
leads out of, and that would have to be e^15 times as large to count. After Hou et al., ApJ 745 (2012), section 4."""
BOUND_RATIO = 1.1
MEDIAN_R_HAT, MOST_R_HAT, FEWEST_EFFECTIVE = 1.01, 1.05, 400
"""Halves of runs worth 400 samples in all differ by chance, too: the largest of hundreds of R-hat by 2 %."""


class Sampled(NamedTuple):
    """Mean and standard deviation [3] of the reference posterior, and how far its sample can be trusted.

    `effective_samples`: of the unknown that has fewest; `r_hat`: of the unknown whose runs differ most; `lost`: walkers
    of both runs that are lost to the end; `longer`: how many times as long the runs were.
    """

    mean: Array
    std: Array
    effective_samples: float
    r_hat: float
    lost: int = 0
    longer: int = 1


class OneScene(NamedTuple):
    """Truth, the reference posterior, and the mode's own mean and spread [3]."""

    truth: Array
    reference: Sampled
    mean: Array
    spread: Array


def posterior_chapter(model: RampModel, *, seed: int = 1, scenes: int = SCENES, jobs: int = -1) -> Chapter:
    """Return the root mean square errors of mode standard over those of the reference posterior."""
    require("scenes", scenes, Bound(2, np.inf, "presses"), "ask for more")
    seen = compared(model, seed=derived_seed(seed, "posterior of standard"), scenes=scenes, jobs=jobs)
    error, best, bound = (_rms(part) for part in _parts(seen))
    ratios = [
        at_most(f"standard, {name}", "RMSE over the posterior's", error[i] / best[i], BOUND_RATIO)
        for i, name in enumerate(UNKNOWNS)
    ]
    chance, longer = standard_error(*_parts(seen)[:2]), sum(one.reference.longer > 1 for one in seen)
    rows = [
        (name, *(f"{part[i]:.4f}" for part in (error, best, bound)), f"{error[i] / bound[i]:.2f}",
         f"{error[i] / best[i]:.2f}", f"{chance[i]:.2f}")
        for i, name in enumerate(UNKNOWNS)
    ]  # fmt: skip
    header = (
        "unknown",
        "RMSE",
        "RMSE of the posterior mean",
        "the posterior's own spread (bound)",
        "RMSE / bound",
        "RMSE / the posterior mean's",
        "standard error of that",
    )
    return Chapter(
        title="As good as the reference posterior",
        claim=(
            f"{scenes} presses drawn from the forward model with camera noise and every nuisance; emcee, two runs "
            f"of {WALKERS} walkers and {STEPS} steps, each after {BURN_IN}; of {longer} presses, whose runs did not "
            f"agree, {LONGER} times as long."
        ),
        source="Foreman-Mackey et al., PASP 125 (2013); Vehtari et al., Bayesian Anal. 16 (2021); "
        "host_tools/scores/posterior.py",
        benchmarks=(*ratios, *_trust([one.reference for one in seen])),
        tables=(Table("Root mean square errors", header, tuple(rows)), _spreads(seen)),
    )


def _trust(references: list[Sampled]) -> list[Benchmark]:
    r_hat = [one.r_hat for one in references]
    return [
        at_most("sampler, all presses", "median split R-hat", float(np.median(r_hat)), MEDIAN_R_HAT),
        at_most("sampler, all presses", "largest split R-hat", float(np.max(r_hat)), MOST_R_HAT),
        at_least(
            "sampler, all presses",
            "fewest effective samples",
            min(one.effective_samples for one in references),
            FEWEST_EFFECTIVE,
        ),
        at_most("sampler, all presses", "walkers that are lost", float(sum(one.lost for one in references)), 0.0),
    ]


def _spreads(seen: list[OneScene]) -> Table:
    """Return by how much the mode's own posterior differs from the reference, press by press."""
    shift = np.array([np.abs(one.mean - one.reference.mean) / one.reference.std for one in seen])
    ratio = np.array([one.spread / one.reference.std for one in seen])
    rows = [
        (name, f"{np.median(shift[:, i]):.3f}", f"{np.quantile(shift[:, i], 0.9):.3f}",
         *(f"{np.quantile(ratio[:, i], share):.3f}" for share in (0.1, 0.5, 0.9)))
        for i, name in enumerate(UNKNOWNS)
    ]  # fmt: skip
    header = ("unknown", "means apart, median (reference spreads)", "nine in ten below",
              "spread over the reference's: one in ten below", "median", "nine in ten below")  # fmt: skip
    return Table("The same posterior, press by press", header, tuple(rows))


def compared(model: RampModel, *, seed: int, scenes: int, jobs: int) -> list[OneScene]:
    """Return the mode's answers to random presses of the forward model, beside the reference posterior."""
    answers = model.answers
    evaluation_set = random_press_set(answers.surrogate, answers.noise, scenes, seed)
    rows = evaluation_set.noisy(np.arange(scenes), np.random.default_rng([seed, 1])).astype(np.float64)
    guesses = model.first_guesses(rows)

    def one(number: int) -> OneScene:
        truth = evaluation_set.normalised[number].astype(np.float64)
        direction_rad = evaluation_set.direction_rad[[number]]
        found = answers.answer(rows[number][None], guesses[number][None], direction_rad)
        posterior = PressPosterior(rows[number], answers.surrogate, answers.noise, direction_rad=direction_rad)
        reference = sampled(posterior, np.array([truth, found.fit.mean]), seed + number)
        return OneScene(truth[: len(UNKNOWNS)], reference, found.mean, found.spread)

    return in_parallel(one, scenes, jobs)


def sampled(posterior: PressPosterior, near: Array, seed: int) -> Sampled:
    """Return what a library's sampler makes of a posterior, each run begun around coordinates of its own [runs, 9]."""
    for longer in (1, LONGER):
        runs = [_run(posterior, begun, [seed, number, longer], longer) for number, begun in enumerate(near)]
        chains, effective, lost = zip(*runs, strict=True)
        r_hat = split_r_hat(chains)
        if r_hat <= MOST_R_HAT:
            break
    together = np.concatenate(chains).reshape(-1, len(UNKNOWNS))
    return Sampled(together.mean(axis=0), together.std(axis=0), float(sum(effective)), r_hat, sum(lost), longer)


def _run(posterior: PressPosterior, near: Array, seed: list[int], longer: int) -> tuple[Array, float, int]:
    """Return the unknowns' chain [steps, walkers, 3] of one run, what its samples are worth, and how many are lost."""
    rng = np.random.default_rng(seed)
    sampler = emcee.EnsembleSampler(WALKERS, len(PARAMETERS), posterior.log_density, vectorize=True, moves=[*MOVES])
    sampler.random_state = np.random.RandomState(seed).get_state()
    state = _burnt_in(sampler, _begun(posterior, near, rng), longer * BURN_IN, rng)
    sampler.run_mcmc(state, longer * STEPS)
    longest = float(np.max(sampler.get_autocorr_time(tol=0)[: len(UNKNOWNS)]))
    chain = np.asarray(sampler.get_chain()[:, :, : len(UNKNOWNS)])
    return chain, WALKERS * len(chain) / longest, int(_lost(sampler.get_log_prob()).sum())


def _burnt_in(sampler: emcee.EnsembleSampler, begin: Array, steps: int, rng: np.random.Generator) -> emcee.State:
    """Return where walkers [walkers, 9] are after so many steps of which nothing is kept, lost ones begun again.

    Those that are lost after the last round stay so, and are counted in what follows.
    """
    for _ in range(MOST_BURN_INS):
        state = sampler.run_mcmc(begin, steps)
        lost = _lost(sampler.get_log_prob()[steps // 2 :])
        sampler.reset()
        if not lost.any():
            break
        begin = _begun_again(state.coords, lost, rng)
    return state


def _lost(log_density: Array) -> NDArray[np.bool_]:
    """Return which walkers are lost, of the logarithms of the density [steps, walkers]."""
    level = np.median(log_density, axis=0)
    return np.asarray(level < level.max() - LOST)


def _begun_again(at: Array, lost: NDArray[np.bool_], rng: np.random.Generator) -> Array:
    """Return walkers [walkers, 9] of which the lost ones lie beside the others now, a tenth of the way to any."""
    found, any_other = rng.choice(np.flatnonzero(~lost), lost.sum()), rng.choice(len(at), lost.sum())
    again = np.array(at)
    again[lost] = at[found] + 0.1 * (at[any_other] - at[found])
    return again


def _begun(posterior: PressPosterior, near: Array, rng: np.random.Generator) -> Array:
    """Return where walkers begin [walkers, 9], around coordinates [9]: all possible, or one might never move.

    Where little is possible nearby they begin further away, turn by turn.
    """
    begin, around = np.empty((0, len(PARAMETERS))), AROUND
    while len(begin) < WALKERS:
        tried = np.clip(near + around * rng.standard_normal((WALKERS, len(PARAMETERS))), -0.999, 0.999)
        begin = np.vstack([begin, tried[np.isfinite(posterior.log_density(tried))]])
        around *= 1.1
    return begin[:WALKERS]


def split_r_hat(chains: Sequence[Array]) -> float:
    """Return the largest split R-hat of runs' chains [steps, walkers, k]: 1 where halves of runs agree.

    Walkers of one run learn from each other, so all of them are one chain; what would differ are its halves and others.
    """
    halves = [half.reshape(-1, half.shape[-1]) for chain in chains for half in np.array_split(chain, 2)]
    within = np.mean([half.var(axis=0, ddof=1) for half in halves], axis=0)
    between = np.var([half.mean(axis=0) for half in halves], axis=0, ddof=1)
    draws = min(map(len, halves))
    return float(np.sqrt(np.max((draws - 1) / draws + between / within)))


def _parts(seen: list[OneScene]) -> tuple[Array, Array, Array]:
    """Return the mode's errors, the reference's errors and the reference's spreads [n, 3]."""
    return (
        np.array([one.mean - one.truth for one in seen]),
        np.array([one.reference.mean - one.truth for one in seen]),
        np.array([one.reference.std for one in seen]),
    )


def standard_error(errors: Array, of_reference: Array) -> Array:
    """Return the standard error [3] of the ratio of root mean square errors [n, 3], which are of the same presses.

    Source: Efron & Tibshirani, An Introduction to the Bootstrap (1993), section 6.2.
    """
    chosen = np.random.default_rng(0).integers(len(errors), size=(RESAMPLED, len(errors)))
    squares = [np.mean(part[chosen] ** 2, axis=1) for part in (errors, of_reference)]
    return np.asarray(np.sqrt(squares[0] / squares[1]).std(axis=0))


def _rms(errors: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(errors**2, axis=0)))
