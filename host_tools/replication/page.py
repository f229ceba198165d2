"""The paper's protocol to the tables and numbers of docs/paper_protocol.md.

Errors in a cell go by size, depth and Young's modulus, in per cent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np

from device.measurement.arrays import Array
from host_tools.pages.benchmark import Table
from host_tools.paper_network.evaluate import PAPER_PERCENT
from host_tools.paper_network.network import LEAST_VARIANCE
from host_tools.paper_network.train import LM_MAX_ITERATIONS, LM_PATIENCE, MAX_ITERATIONS, PATIENCE
from host_tools.replication.networks import OURS, PLAIN, RECIPES
from host_tools.replication.protocol import ProtocolStep
from host_tools.replication.side_by_side import POOR_RATIO, Runs
from host_tools.replication.study import LIGHTS, PaperStudy

WORDS = ("size", "depth", "modulus")
COLUMNS = ("linear light", "traced light")
METHODS = ("", "SCG", "LM")
MEANS = f"Mean relative error of {', '.join(WORDS)} (%)"

TableRows = Iterable[tuple[str, ...]]


def paper_tables(study: PaperStudy) -> dict[str, Callable[[], Table]]:
    """Return the page's tables by name, each to be computed; the first takes a minute, and each of the last three."""
    return {
        "letter": lambda: _table_one(study, ProtocolStep.LETTER),
        "phantoms": lambda: _phantoms(study),
        "means": lambda: _means(study),
        "refitted": lambda: _table_one(study, ProtocolStep.REFITTED),
        "noise": lambda: _table_one(study, ProtocolStep.NOISE),
        "choices": lambda: _choices(study),
        "side_by_side": lambda: _side_by_side(study.side_by_side[PLAIN.name], PLAIN.name),
        "side_by_side_ours": lambda: _side_by_side(study.side_by_side[OURS.name], OURS.name),
        "ends": lambda: _ends(study.ends),
    }


def paper_facts(study: PaperStudy) -> dict[str, Any]:
    """Return the numbers that the page's prose quotes; `growth` is by what factor mean errors [3] are larger."""
    letter = {light: study.mean_percent(light, ProtocolStep.LETTER) for light in LIGHTS}
    refitted = {light: study.mean_percent(light, ProtocolStep.REFITTED) for light in LIGHTS}
    noise = {light: study.mean_percent(light, ProtocolStep.NOISE) for light in LIGHTS}
    runs = study.side_by_side[OURS.name]
    return {
        "seeds": study.seeds,
        "presses": study.presses,
        "scenes": len(study.all.truth),
        "scenes_that_train": len(study.remaining.truth),
        "excluded_scenes": study.excluded_rows,
        "paper_percent": _floats(PAPER_PERCENT["mean"]),
        "letter_percent": {light: _floats(letter[light]) for light in LIGHTS},
        "constant_percent": _floats(study.constant_percent),
        "growth": {
            "refitted": {light: _floats(refitted[light] / letter[light]) for light in LIGHTS},
            "noise": {light: _floats(noise[light] / refitted[light]) for light in LIGHTS},
            "traced": _floats(letter["physical"] / letter["linear"]),
            "one_network": _floats(study.single_trial_percent / letter["linear"]),
        },
        "least_r_squared": {light: float(study.views(light).r_squared().min()) for light in LIGHTS},
        "lm_over_scg": {
            "end_loss": float(np.median(study.ends["LM"].losses) / np.median(study.ends["SCG"].losses)),
            "error": _floats(runs["LM"].percent.mean(axis=0) / runs["SCG"].percent.mean(axis=0)),
            "time": runs["LM"].seconds / runs["SCG"].seconds,
        },
        "least_variance": LEAST_VARIANCE,
        "patience": {"SCG": PATIENCE, "LM": LM_PATIENCE},
        "most_iterations": {"SCG": MAX_ITERATIONS, "LM": LM_MAX_ITERATIONS},
    }


def _floats(values: Iterable[float]) -> list[float]:
    return [float(f"{value:.6g}") for value in values]


def _table_one(study: PaperStudy, step: ProtocolStep) -> Table:
    """Mean, SD, min and max as the paper's table I has them, the paper's own beside ours."""
    paper = {name: np.array(figures) for name, figures in PAPER_PERCENT.items()}
    tables = [paper, *(study.errors(light, step).totals() for light in LIGHTS)]
    rows = [(name, *(f"{table[name][i]:.1f}" for i in range(len(WORDS)) for table in tables)) for name in paper]
    caption = f"{step.value[0].upper()}{step.value[1:]}: relative errors (%)"
    header = ("", *(f"{unknown}, {source}" for unknown in WORDS for source in ("the paper", *COLUMNS)))
    return Table(caption, header, tuple(rows))


def _phantoms(study: PaperStudy) -> Table:
    tables = [study.errors(light, ProtocolStep.LETTER) for light in LIGHTS]
    rows = tuple(
        (str(i + 1), *(_three(row, digits=2) for row in (truth, *(table.estimate[i] for table in tables))))
        for i, truth in enumerate(study.phantoms.truth)
    )
    caption = "The nine behind the first table: size (mm), depth (mm), modulus (kPa)"
    return Table(caption, ("phantom", "truth", *COLUMNS), rows)


def _means(study: PaperStudy) -> Table:
    rows = [(step.value, *(_three(study.mean_percent(light, step)) for light in LIGHTS)) for step in ProtocolStep]
    alone = ("as the paper, but one network instead of the mean", _three(study.single_trial_percent), "")
    guess = ("nothing: a constant guess", *[_three(study.constant_percent)] * len(LIGHTS))
    return Table(MEANS, ("the networks get", *COLUMNS), (*rows, alone, guess))


def _choices(study: PaperStudy) -> Table:
    steps = {ProtocolStep.LETTER: "no noise, fitted on all nine", ProtocolStep.NOISE: "noise, fitted on eight"}
    header = ("trained on", "inputs and loss", *(f"{name}, {how}" for name in COLUMNS for how in steps.values()))

    def row(scenes: str, name: str, recipe: str) -> tuple[str, ...]:
        return scenes, name, *(_three(study.mean_percent(light, step, recipe)) for light in LIGHTS for step in steps)

    others = [row("125", recipe.name, recipe.name) for recipe in RECIPES]
    return Table(MEANS, header, (row("133", RECIPES[0].name, ""), *others))


def _side_by_side(runs: dict[str, Runs], name: str) -> Table:
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
        *_times(both),
    )
    return Table(name.capitalize(), METHODS, rows)


def _ends(runs: dict[str, Runs]) -> Table:
    both = (runs["SCG"], runs["LM"])
    best = float(min(found.losses.min() for found in both))
    rows = (
        *(
            (f"{word} loss", *(f"{reduce(found.losses):.4f}" for found in both))
            for word, reduce in (("least", np.min), ("median", np.median), ("largest", np.max))
        ),
        _counted(f"over {POOR_RATIO:g} times the least of both", both, partial(Runs.poor, best=best)),
        _counted(f"over {POOR_RATIO:g} times its own least", both, lambda found: found.poor(found.losses.min())),
        _counted("allowance of iterations used up", both, Runs.used_up),
        *_errors(both),
        *_times(both),
    )
    return Table("Without early stopping; loss of the training scenes", METHODS, rows)


def _counted(name: str, both: tuple[Runs, Runs], count: Callable[[Runs], int]) -> tuple[str, ...]:
    return name, *(f"{count(found)} of {len(found.trials)}" for found in both)


def _times(both: tuple[Runs, Runs]) -> TableRows:
    scg, lm = both
    yield "time of one network (ms)", *(f"{found.milliseconds:.0f}" for found in both)
    yield "time, SCG = 1", "1", f"{lm.seconds / scg.seconds:.2f}"


def _errors(both: tuple[Runs, Runs]) -> TableRows:
    yield "mean error of one network: size, depth, modulus (%)", *(_three(found.percent.mean(axis=0)) for found in both)
    yield "of the worst seed for each (%)", *(_three(found.percent.max(axis=0)) for found in both)


def _three(values: Array, digits: int = 1) -> str:
    return ", ".join(f"{value:.{digits}f}" for value in values)
