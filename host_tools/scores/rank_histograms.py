"""Whether the posterior is right as a whole: ranks of the truth in it, its own regions, and the energy score.

Where inclusions are drawn as the posterior believes and presses from the forward model and its noise, the truth is a
sample of the posterior like any other: its rank is even, and 90 % regions hold it in nine of ten presses.
Ramps of a scan lie where a hand puts them, the first within 2 mm; the posterior believes each evenly over 8 mm.
Sources: Talts et al., arXiv:1804.06788 (2018), simulation-based calibration; Gneiting & Raftery, JASA 102 (2007),
section 4.2, energy score.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from device.measurement.arrays import Array
from device.measurement.confidence_belt import COVERAGE
from device.measurement.estimate import SPOKEN
from device.measurement.mode import Mode
from device.measurement.parameters import COUNT, normalise
from device.measurement.quantities import UNKNOWNS, Bound, require
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.joint_region import joint_region
from device.measurement.ramp_modes.model import RAMP_MODES, RampModel
from device.measurement.ramp_modes.posterior import TOGETHER, WeightedSamples, best_everywhere, weighted_samples
from device.measurement.ramp_modes.surrogate import OFFSET
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least, at_most
from host_tools.press_models.noisy_presses import random_scan
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.ramp_training import further_offsets_mm
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed

PRESSES = {"standard": 480, "precise": 240}
BINS = 8
CHANCE = 0.001
"""A histogram of even ranks is called uneven so rarely."""
JOINT_ERROR = 0.03
"""A region's share may lie so far from what it promises, as that of an interval."""
DRAWS = 150
"""So many samples of a posterior whose distances make its energy score."""
JOINT = "size and depth", "all three"
"""What `TOGETHER` is called."""
HEADER = ("mode, unknown", *(f"rank {number + 1} of {BINS}" for number in range(BINS)))
SCORE_HEADER = ("mode", "energy score", "that of the ranges alone", "ratio")


class RankedPress(NamedTuple):
    """Of one press: rank [3] of each truth, whether the ellipse of each of `JOINT` holds it, energy scores.

    The second energy score is that of the ranges alone.
    """

    rank: Array
    in_region: NDArray[np.bool_]
    energy_score: float
    energy_score_of_ranges: float


def rank_chapter(model: RampModel, *, seed: int = 1, presses: int | None = None, jobs: int = -1) -> Chapter:
    """Return rank histograms, joint coverage and energy score of modes standard and precise."""
    counts = {mode: PRESSES[mode] if presses is None else presses for mode in RAMP_MODES}
    require("presses", min(counts.values()), Bound(10 * BINS, np.inf, "presses"), "ask for more")
    found = {mode: ranked_presses(model, mode, count, seed=seed, jobs=jobs) for mode, count in counts.items()}
    numbers = ", ".join(f"{count} in {mode}" for mode, count in counts.items())
    return Chapter(
        title="The posterior is right as a whole",
        claim=f"Random presses drawn from the forward model with camera noise and every nuisance ({numbers}).",
        source="Talts et al., arXiv:1804.06788 (2018); host_tools/scores/rank_histograms.py",
        benchmarks=tuple(one for mode, of_mode in found.items() for one in _benchmarks(mode, of_mode)),
        tables=(
            Table(
                "Share of truths by their rank in the posterior; even is right",
                HEADER,
                tuple(_histogram_row(mode, i, of_mode) for mode, of_mode in found.items() for i in range(COUNT)),
            ),
            Table("Energy score, mean over the presses", SCORE_HEADER, tuple(map(_score_row, found, found.values()))),
        ),
    )


def ranked_presses(model: RampModel, mode: Mode, count: int, *, seed: int, jobs: int) -> list[RankedPress]:
    """Return the ranks of random presses of a mode."""
    own = derived_seed(seed, f"ranks of {mode}")
    rng = np.random.default_rng(own)
    truth = normalise(draw_parameters(count, rng))
    further = further_offsets_mm(count, rng) if mode == "precise" else [np.zeros(0)] * count
    return in_parallel(lambda i: _ranked(model, truth[i], further[i], [own, i]), count, jobs)


def _ranked(model: RampModel, truth: Array, further_mm: Array, seed: list[int]) -> RankedPress:
    rng, answers = np.random.default_rng(seed), model.answers
    offsets_mm = np.append(truth[OFFSET] + 1, further_mm)
    rows, direction_rad = random_scan(answers.surrogate, answers.noise, truth, offsets_mm, rng)
    answer = model.answer(rows, direction_rad)
    posterior = PressPosterior(
        rows, answers.surrogate, answers.noise, answers.reach_mm(len(rows)), direction_rad=direction_rad
    )
    _, in_cells, others = best_everywhere(posterior, answer.fit.best)
    return ranked(weighted_samples(posterior, in_cells, others), truth[:COUNT], rng)


def ranked(samples: WeightedSamples, truth: Array, rng: np.random.Generator) -> RankedPress:
    """Return how a posterior's samples judge a truth [3]."""
    at, weight = samples.at[:, :COUNT], samples.weight
    drawn = at[rng.choice(len(at), DRAWS, p=weight)]
    of_ranges = normalise(draw_parameters(DRAWS, rng))[:, :COUNT]
    return RankedPress(
        weight @ (at < truth),
        np.array([joint_region(at[:, :count], weight).holds(truth[:count]) for count in TOGETHER]),
        energy_score(drawn, truth),
        energy_score(of_ranges, truth),
    )


def energy_score(samples: Array, truth: Array) -> float:
    """Return the mean distance of samples [n, k] from the truth [k] less half of that between any two of them.

    The truth's own distribution has the least mean score.
    """
    between = np.linalg.norm(samples[:, None] - samples, axis=2).sum() / (len(samples) * (len(samples) - 1))
    return float(np.linalg.norm(samples - truth, axis=1).mean() - between / 2)


def unevenness(ranks: Array) -> float:
    """Return Pearson's chi-square of ranks [n] in `BINS` even parts; its mean is BINS - 1 where ranks are even."""
    counts, expected = np.histogram(ranks, BINS, (0, 1))[0], len(ranks) / BINS
    return float(np.sum((counts - expected) ** 2) / expected)


def _benchmarks(mode: Mode, presses: Sequence[RankedPress]) -> list[Benchmark]:
    ranks = np.array([one.rank for one in presses])
    most = float(chi2.isf(CHANCE, BINS - 1))
    benchmarks = [
        at_most(f"{mode}, {SPOKEN[name]}", "unevenness of the ranks, chi-square", unevenness(ranks[:, i]), most)
        for i, name in enumerate(UNKNOWNS)
    ]
    inside = np.array([one.in_region for one in presses])
    for i, name in enumerate(JOINT):
        share = float(inside[:, i].mean())
        benchmarks.append(at_least(f"{mode}, {name}", "90 % region holds", share, COVERAGE - JOINT_ERROR))
    return benchmarks


def _histogram_row(mode: Mode, unknown: int, presses: Sequence[RankedPress]) -> tuple[str, ...]:
    counts, _ = np.histogram([one.rank[unknown] for one in presses], BINS, (0, 1))
    return f"{mode}, {SPOKEN[UNKNOWNS[unknown]]}", *(f"{count / len(presses):.1%}" for count in counts)


def _score_row(mode: Mode, presses: Sequence[RankedPress]) -> tuple[str, ...]:
    own, of_ranges = (float(np.mean(part)) for part in zip(*((one[2], one[3]) for one in presses), strict=True))
    return mode, f"{own:.3f}", f"{of_ranges:.3f}", f"{own / of_ranges:.2f}"
