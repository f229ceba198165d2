"""The chapters of docs/paper_protocol.md on scaled conjugate gradient (SCG) beside Levenberg-Marquardt (LM)."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from device.measurement.arrays import Array
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least, at_most
from host_tools.paper_network.network import LEAST_VARIANCE
from host_tools.paper_network.train import LM_MAX_ITERATIONS, LM_PATIENCE, MAX_ITERATIONS, PATIENCE
from host_tools.replication.networks import OURS
from host_tools.replication.side_by_side import POOR_RATIO, Runs
from host_tools.replication.study import PaperStudy

SOURCE = (
    "Moller, Neural Networks 6:525-533, 1993; Hagan & Menhaj, IEEE Trans. Neural Networks 5(6):989-993, 1994; "
    "the paper's conclusion proposes the latter."
)
HEADER = ("", "SCG", "LM")


def methods(study: PaperStudy) -> Chapter:
    """Return both methods as they train networks: with early stopping, judged on the phantoms."""
    return Chapter(
        f"Levenberg-Marquardt beside scaled conjugate gradient, {study.seeds} seeds",
        "Same starts, same held-out fifths, exact features of the nine phantoms, which never train. Both minimise the "
        "same loss: the mean square, which is half the sum over the three unknowns of their mean squared scaled "
        "residual; or the sum of logarithms, half the sum of the logarithms of the same mean squares plus "
        f"{LEAST_VARIANCE:g}. The second is no sum of squares; LM gets residuals divided by each unknown's scatter, "
        f"anew at every step. A search ends when the held-out loss has not fallen for {PATIENCE} accepted steps "
        f"(LM: {LM_PATIENCE}) or after {MAX_ITERATIONS} iterations (LM: {LM_MAX_ITERATIONS}). Early stopping ends both "
        "before their minimum, and neither is more accurate. LM takes less time on this project's loss; its worst "
        "seeds are worse. Neither fails in size or depth; in Young's modulus nearly every network is worse than a "
        "constant guess.",
        SOURCE,
        tuple(_judged(study)),
        tuple(_side_by_side(name, runs) for name, runs in study.side_by_side.items()),
    )


def _judged(study: PaperStudy) -> Iterable[Benchmark]:
    for name, runs in study.side_by_side.items():
        for method, found in runs.items():
            failed = found.not_finite() + int(found.worse_than_a_constant()[:2].max())
            yield at_most(f"{name}, {method}", "networks that fail in size or depth", failed, 0)
            share = found.worse_than_a_constant()[2] / study.seeds
            yield at_least(f"{name}, {method}", "share that is worse than a constant modulus", share, 0.8)
        for unknown, ratio in zip(("size", "depth"), error_ratio(runs)[:2], strict=True):
            yield at_most(name, f"{unknown} error of one network, LM over SCG", ratio, 1.15)
            yield at_least(name, f"{unknown} error of one network, LM over SCG", ratio, 0.85)
        worst = runs["LM"].percent.max(axis=0) / runs["SCG"].percent.max(axis=0)
        yield at_least(name, "size or depth error of the worst seed, LM over SCG", worst[:2].min(), 1.0)
    yield at_most(OURS.name, "time, LM over SCG", time_ratio(study.side_by_side[OURS.name]), 0.8)


def time_ratio(runs: dict[str, Runs]) -> float:
    """Return the time of LM over that of SCG."""
    return runs["LM"].seconds / runs["SCG"].seconds


def error_ratio(runs: dict[str, Runs]) -> Array:
    """Return the mean error [3] of single networks by LM over that by SCG."""
    return np.asarray(runs["LM"].percent.mean(axis=0) / runs["SCG"].percent.mean(axis=0))


def _side_by_side(name: str, runs: dict[str, Runs]) -> Table:
    both = (runs["SCG"], runs["LM"])
    seeds = len(both[0].trials)
    rows = (
        *_errors(both),
        ("of the mean of all networks (%)", *(_three(found.averaged_percent) for found in both)),
        _counted("failed: not finite", both, Runs.not_finite),
        _counted("failed: allowance of iterations used up", both, Runs.used_up),
        (
            "failed: worse than a constant guess in size, depth, modulus",
            *(_three(found.worse_than_a_constant(), digits=0) + f" of {seeds}" for found in both),
        ),
        ("iterations (median)", *(f"{found.iterations:.0f}" for found in both)),
        *_times(runs),
    )
    return Table(name.capitalize(), HEADER, rows)


def _counted(name: str, both: tuple[Runs, Runs], count: Callable[[Runs], int]) -> tuple[str, ...]:
    return name, *(f"{count(found)} of {len(found.trials)}" for found in both)


def _times(runs: dict[str, Runs]) -> Iterable[tuple[str, ...]]:
    yield "time of one network (ms)", *(f"{runs[method].milliseconds:.0f}" for method in HEADER[1:])
    yield "time, SCG = 1", "1", f"{time_ratio(runs):.2f}"


def _errors(both: tuple[Runs, Runs]) -> Iterable[tuple[str, ...]]:
    yield "mean error of one network: size, depth, modulus (%)", *(_three(found.percent.mean(axis=0)) for found in both)
    yield "of the worst seed for each (%)", *(_three(found.percent.max(axis=0)) for found in both)


def ends(study: PaperStudy) -> Chapter:
    """Return where both methods end when nothing stops them early."""
    both = (study.ends["SCG"], study.ends["LM"])
    best = float(min(found.losses.min() for found in both))
    scg, lm = both
    stuck = scg.poor(float(scg.losses.min())) / study.seeds
    return Chapter(
        "Which of them finds the minimum",
        "The paper says that SCG fails to find the final optimum in some cases. Here nothing stops the searches but "
        f"their {MAX_ITERATIONS} (LM: {LM_MAX_ITERATIONS}) iterations, which take about the same time, and all of the "
        f"{len(study.remaining.truth)} scenes train on the mean square. LM ends far lower. SCG does not stick at bad "
        "places, where some seeds would end high and others low: it is slow, and still on its way. LM has not arrived "
        "either. The networks at the lower end are not the better ones.",
        SOURCE,
        (
            at_most("mean square", "median loss at the end, LM over SCG", loss_ratio(study.ends), 0.75),
            at_least("mean square", "SCG, share of ends far above the best", scg.poor(best) / study.seeds, 0.8),
            at_most("mean square", "SCG, share of ends far above its own best", stuck, 0.1),
            at_most("mean square", "LM, share of ends far above the best", lm.poor(best) / study.seeds, 0.1),
            at_least("mean square", "size error of one network, LM over SCG", error_ratio(study.ends)[0], 1.0),
            at_most("mean square", "time, LM over SCG", time_ratio(study.ends), 1.5),
        ),
        (_ends_table(study.ends, best),),
    )


def loss_ratio(runs: dict[str, Runs]) -> float:
    """Return the median loss at LM's ends over that at SCG's."""
    return float(np.median(runs["LM"].losses) / np.median(runs["SCG"].losses))


def _ends_table(runs: dict[str, Runs], best: float) -> Table:
    both = (runs["SCG"], runs["LM"])
    rows = (
        *(
            (f"{word} loss", *(f"{reduce(found.losses):.4f}" for found in both))
            for word, reduce in (("least", np.min), ("median", np.median), ("largest", np.max))
        ),
        _counted(f"over {POOR_RATIO:g} times the least of both", both, lambda found: found.poor(best)),
        _counted(f"over {POOR_RATIO:g} times its own least", both, lambda found: found.poor(found.losses.min())),
        _counted("allowance of iterations used up", both, Runs.used_up),
        *_errors(both),
        *_times(runs),
    )
    return Table("Without early stopping; loss of the training scenes", HEADER, rows)


def _three(values: Array, digits: int = 1) -> str:
    return ", ".join(f"{value:.{digits}f}" for value in values)
