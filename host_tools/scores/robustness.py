"""What a builder's tolerances and a hand's habits cost: presses of foreign probes, before and after commissioning.

The same presses are answered by the design's bundle as it ships, by one that allows for a builder's tolerances, and by
the bundle that commissioning made of this probe's own phantoms; beside them those of a probe that is known exactly and
suffers the same hand. Mechanics are always the virtual probe's own; its optics are another block's, scattered by
another law, in a chapter of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.commissioned.own_probe import OwnProbe
from device.measurement.ramp_modes.commissioned.row_derivatives import MEAN, STD, RowDerivatives
from device.measurement.ramp_modes.model import RampModel
from device.simulation.physics.world import AS_BELIEVED, World
from device.simulation.virtual_probe import ProbeTables
from host_tools.commissioning.commission import LARGEST_MISFIT_RATIO, limits
from host_tools.commissioning.joint_fit import PROBE, Design, ProbeFit, fit_probe
from host_tools.commissioning.left_out import answers_of, left_out
from host_tools.optics.other_light import other_optics
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least, at_most
from host_tools.press_models.seeds import derived_seed
from host_tools.scenes.phantom_set import PhantomSet
from host_tools.scores.foreign_presses import foreign_phantoms, foreign_presses, probe_part
from host_tools.scores.foreign_probes import foreign_world
from host_tools.scores.scored_presses import ScoredPresses, joined, scored, tolerant

PROBES, PRESSES, MOST_KNOWN = 20, 60, 300
TOLERANT = 10
"""Presses of each probe that are also answered by its tolerances alone."""
NEGLIGIBLE = 1e-6
HEADER = (
    "answered by", "refused", "size covered", "depth covered", "both covered", "size, depth determined", "E determined",
    "size RMSE (mm)", "depth RMSE (mm)", "median misfit",
)  # fmt: skip
GOALS = {"pooled": 0.86, "each probe": 0.80, "joint": 0.84, "answered": 0.95, "rmse": 1.3}
OTHER_GOALS = {"pooled": 0.83, "answered": 0.90, "rmse": 1.6}
"""Of other optics nothing is asked of each probe, nor of both at once."""
OTHER_PROBES = 4


def robustness_chapter(
    model: RampModel,
    derivatives: RowDerivatives,
    tables: ProbeTables,
    phantoms: PhantomSet,
    *,
    probes: int = PROBES,
    presses: int = PRESSES,
    seed: int = 1,
    jobs: int = -1,
    say: Callable[[str], None] = lambda step: None,
) -> Chapter:
    """Return how presses of foreign probes are answered, before and after commissioning on phantoms."""
    design = Design(model.answers, derivatives)
    trials = []
    for number in range(1, probes + 1):
        say(f"probe {number} of {probes}")
        trials.append(_tried(design, model, tables, phantoms, number, presses, seed, jobs))
    known = _of_known(design, model, tables, min(probes * presses, MOST_KNOWN), seed, jobs)
    return Chapter(
        title="Probes of random tolerances",
        claim=f"{probes} probes, {presses} random presses each, everything at once; phantoms as {phantoms.serial}.",
        source="host_tools/scores/robustness.py; probes: scenarios/worlds, their cameras undone by a grid target",
        benchmarks=tuple(_benchmarks([trial.scores["commissioned"] for trial in trials], known, GOALS)),
        tables=(_table_of_all(trials, known), _table_of_each(trials)),
        facts={"probes": probes, "presses": presses},
    )


def other_optics_chapter(
    model: RampModel,
    derivatives: RowDerivatives,
    tables: ProbeTables,
    phantoms: PhantomSet,
    *,
    probes: int = OTHER_PROBES,
    presses: int = PRESSES,
    seed: int = 1,
    jobs: int = -1,
    say: Callable[[str], None] = lambda step: None,
) -> Chapter:
    """Return the same of probes whose light is another block's, scattered by another law than the models'."""
    say("light of another block")
    design, foreign = Design(model.answers, derivatives), replace(tables, light=other_optics())
    trials = []
    for number in range(1, probes + 1):
        say(f"probe {number} of {probes} with other optics")
        own = derived_seed(seed, "other optics")
        trials.append(_tried(design, model, foreign, phantoms, number, presses, own, jobs))
    known = _of_known(design, model, tables, min(probes * presses, MOST_KNOWN), seed, jobs)
    commissioned = [trial.scores["commissioned"] for trial in trials]
    return Chapter(
        title="Probes of other optics",
        claim=f"{probes} probes of random tolerances, {presses} random presses each; phantoms as {phantoms.serial}.",
        source="host_tools/scores/robustness.py; light: host_tools/optics/other_light.py",
        benchmarks=tuple(_benchmarks(commissioned, known, OTHER_GOALS)),
        tables=(_table_of_all(trials, known), _table_of_each(trials)),
        facts={"probes": probes, "presses": presses},
    )


class _TriedProbe(NamedTuple):
    """Answers to presses of one probe, by who answers them, and what commissioning found."""

    number: int
    scores: dict[str, ScoredPresses]
    fit: ProbeFit


def _tried(
    design: Design,
    model: RampModel,
    tables: ProbeTables,
    phantoms: PhantomSet,
    number: int,
    presses: int,
    seed: int,
    jobs: int,
) -> _TriedProbe:
    """Return how presses of one foreign probe are answered, before and after commissioning on its phantoms."""
    probe = probe_part(foreign_world(seed, number))
    noise, own = model.answers.noise, derived_seed(seed, f"probe {number}")
    taken = foreign_presses(tables, probe, noise, presses, seed=own, jobs=jobs)
    ramps = foreign_phantoms(tables, probe, noise, phantoms, seed=own, jobs=jobs)
    fit = fit_probe(ramps, design)
    answers = answers_of(design, fit)
    critical = limits(answers, model, left_out(ramps, design, model.first_guesses, fit, jobs), seed)
    scores = {
        "as it ships": scored(model.answers, model, model.critical["standard"], taken, jobs),
        "with tolerances": scored(tolerant(design), model, critical, taken.first(TOLERANT), jobs),
        "commissioned": scored(answers, model, critical, taken, jobs),
    }
    return _TriedProbe(number, scores, fit)


def _table_of_all(trials: Sequence[_TriedProbe], known: ScoredPresses) -> Table:
    names = tuple(trials[0].scores)
    rows = [(name, *_row(joined([trial.scores[name] for trial in trials]))) for name in names]
    return Table("All probes together", HEADER, (*rows, ("known exactly", *_row(known))))


def _table_of_each(trials: Sequence[_TriedProbe]) -> Table:
    rows = [
        (
            f"{trial.number}",
            *_row(trial.scores["commissioned"]),
            f"{trial.fit.levels.model_ratio:.1%}",
            f"{trial.fit.believed.discrepancy_ratio:.0%}",
        )
        for trial in trials
    ]
    return Table("Each probe, commissioned", ("probe", *HEADER[1:], "model error", "lacking"), tuple(rows))


def _benchmarks(
    commissioned: Sequence[ScoredPresses], known: ScoredPresses, goals: Mapping[str, float]
) -> list[Benchmark]:
    whole = joined(commissioned)
    covered, names = whole.covered(), UNKNOWNS[:2]
    rms, of_known = (np.sqrt((one.error_mm() ** 2).mean(axis=0)) for one in (whole, known))
    each = np.array([one.covered().mean(axis=0) for one in commissioned])
    least = {
        "answered": [("answered over those of a known probe", whole.is_answered.mean() / known.is_answered.mean())],
        "pooled": [(f"{name} covered, pooled", covered[:, i].mean()) for i, name in enumerate(names)],
        "each probe": [(f"{name} covered, worst probe", each[:, i].min()) for i, name in enumerate(names)],
        "joint": [("size and depth covered", covered.all(axis=1).mean())],
    }
    return [
        *(
            at_least("commissioned", what, float(found), goals[goal])
            for goal, figures in least.items()
            if goal in goals
            for what, found in figures
        ),
        *(
            at_most("commissioned", f"{name} RMSE over a known probe's", float(rms[i] / of_known[i]), goals["rmse"])
            for i, name in enumerate(names)
        ),
    ]


def _of_known(design: Design, model: RampModel, tables: ProbeTables, count: int, seed: int, jobs: int) -> ScoredPresses:
    """Return presses of the design's own probe, known exactly, by the same hand on the same patients."""
    probe: World = AS_BELIEVED
    probe = replace(probe, texture=probe_part(foreign_world(seed, 1)).texture)
    taken = foreign_presses(
        tables, probe, model.answers.noise, count, seed=derived_seed(seed, "presses of a known probe"), jobs=jobs
    )
    mean, std = np.array(MEAN), np.array(STD)
    mean[PROBE], std[PROBE] = 0.0, NEGLIGIBLE
    believed = tolerant(design)
    own = OwnProbe(design.derivatives, mean, np.diag(std**2), believed.own.levels)
    answers = OwnAnswers(believed.surrogate, believed.noise, own)
    critical = replace(limits(answers, model, [], seed), misfit_ratio=LARGEST_MISFIT_RATIO)
    return scored(answers, model, critical, taken, jobs)


def _row(found: ScoredPresses) -> tuple[str, ...]:
    known, covered = found.evaluated.is_known[found.is_answered], found.covered()
    if not len(known):
        return ("100 %", *[""] * 7, f"{np.median(found.misfit_ratio):.2f}")
    rms = np.sqrt((found.error_mm() ** 2).mean(axis=0))
    shares = (
        1 - found.is_answered.mean(),
        *covered.mean(axis=0),
        covered.all(axis=1).mean(),
        known[:, :2].all(axis=1).mean(),
        known[:, 2].mean(),
    )
    return (
        *(f"{100 * share:.0f} %" for share in shares),
        *(f"{one:.2f}" for one in rms),
        f"{np.median(found.misfit_ratio):.2f}",
    )
