"""What a builder's tolerances and a hand's habits cost: presses of foreign probes, before and after commissioning.

The same presses are answered by the design's bundle as it ships, by one that allows for a builder's tolerances, by the
bundle that commissioning made of this probe's own phantoms, and by the probe as if it were known exactly; scans of two,
of other patients, by the last two. Mechanics are always the virtual probe's own; its optics are another block's,
scattered by another law, in a chapter of their own. There the probe that is known exactly has the design's optics: what
lies between both is all that the light costs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.commissioned.row_derivatives import NAMES, STD, RowDerivatives
from device.measurement.ramp_modes.estimate import stands_out
from device.measurement.ramp_modes.model import CriticalValues, RampModel
from device.simulation.physics.world import AS_BELIEVED, World
from device.simulation.virtual_probe import ProbeTables
from host_tools.commissioning.commission import limits
from host_tools.commissioning.joint_fit import FLOOR, PROBE, Design, ProbeFit, fit_probe
from host_tools.commissioning.left_out import answers_of, checked_answer
from host_tools.optics.other_light import other_optics
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least, at_most
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed
from host_tools.scenes.phantom_set import PhantomSet
from host_tools.scores.foreign_presses import (
    ForeignPresses,
    foreign_phantoms,
    foreign_presses,
    probe_part,
)
from host_tools.scores.foreign_probes import foreign_world
from host_tools.scores.scored_presses import FIGURES, ScoredPresses, figures_of, joined, paired, scored, tolerant

PROBES, PRESSES, PRESSES_OF_DESIGN = 20, 60, 200
"""Foreign probes, presses of each, and at most so many presses of the design's own probe."""
FEW = 10
"""Presses of each probe that are also answered by its tolerances alone, and as the design ships."""
SOFT_KPA = 15.0
GROUPS = f"{SOFT_KPA:g} kPa and more", f"below {SOFT_KPA:g} kPa"
"""Hard and soft inclusions are scored apart: the soft ones are hardly stiffer than tissue may be."""
SHIPPED, TOLERANCES, COMMISSIONED, KNOWN = "as it ships", "with tolerances", "commissioned", "known exactly"
SCANS, KNOWN_SCANS = (f"{name}, scans of two" for name in (COMMISSIONED, KNOWN))
BESIDE = {COMMISSIONED: KNOWN, SCANS: KNOWN_SCANS}
"""Who answers, and the probe known exactly that the same presses are held against."""
GOALS = {"pooled": 0.86, "each probe": 0.80, "joint": 0.84, "answered": 0.95, "rmse": 1.3}
OTHER_GOALS = {"pooled": 0.83, "answered": 0.90, "rmse": 1.6}
"""Of other optics nothing is asked of each probe, nor of both at once."""
OTHER_PROBES = 4
FALSE_ALARMS = 0.015
"""Share of presses without an inclusion that may have numbers; mode quick's own limit is set to it."""
LEAST_MM = 1e-9
"""Errors below are none: nothing is divided by them."""


class TrialSetup(NamedTuple):
    """What all probes of a chapter share: the design's model, derivatives and tables, phantoms, a seed, and jobs."""

    model: RampModel
    derivatives: RowDerivatives
    tables: ProbeTables
    phantoms: PhantomSet
    seed: int
    jobs: int

    @property
    def design(self) -> Design:
        """What commissioning starts from."""
        return Design(self.model.answers, self.derivatives)


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
) -> Chapter:
    """Return how presses of foreign probes are answered, before and after commissioning on phantoms."""
    setup = TrialSetup(model, derivatives, tables, phantoms, seed, jobs)
    return _chapter(
        "Probes of random tolerances",
        f"{probes} probes, {presses} random presses and half as many scans each, everything at once; "
        f"phantoms as {phantoms.serial}.",
        "host_tools/scores/robustness.py; probes: scenarios/worlds, their cameras undone by a grid target",
        _trials(setup, tables, probes, presses),
        _of_design(setup, min(probes * presses, PRESSES_OF_DESIGN)),
        GOALS,
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
) -> Chapter:
    """Return the same of probes whose light is another block's, scattered by another law than the models'."""
    setup = TrialSetup(model, derivatives, tables, phantoms, derived_seed(seed, "other optics"), jobs)
    foreign = replace(tables, light=other_optics())
    return _chapter(
        "Probes of other optics",
        f"{probes} probes of random tolerances, {presses} random presses and half as many scans each; "
        f"phantoms as {phantoms.serial}.",
        "host_tools/scores/robustness.py; light: host_tools/optics/other_light.py",
        _trials(setup, foreign, probes, presses),
        _of_design(setup, min(probes * presses, PRESSES_OF_DESIGN)),
        OTHER_GOALS,
    )


class InclusionFree(NamedTuple):
    """Of so many presses or scans where there is no inclusion: in how many the contrast stands out, and which of them
    have numbers."""

    presses: int
    stand_out: int
    answered: int

    def row(self) -> tuple[str, ...]:
        """Return the cells of a table."""
        return (*map(str, self), f"{100 * self.answered / self.presses:.1f} %")


class TriedProbe(NamedTuple):
    """Answers to presses of one probe, by who answers them, and what commissioning found.

    `inclusion_free`: what `COMMISSIONED` and `SCANS` make of tissue without an inclusion.
    """

    number: int
    scores: dict[str, ScoredPresses]
    fit: ProbeFit
    inclusion_free: dict[str, InclusionFree]

    def of_group(self, group: str) -> TriedProbe:
        """Return the same with inclusions of one of `GROUPS` alone."""
        return self._replace(scores={name: of_group(one, group) for name, one in self.scores.items()})


def of_group(found: ScoredPresses, group: str) -> ScoredPresses:
    """Return the presses on inclusions of one of `GROUPS`."""
    return found.part((found.youngs_modulus_kpa() < SOFT_KPA) == (group == GROUPS[1]))


def _trials(setup: TrialSetup, lit: ProbeTables, probes: int, presses: int) -> list[TriedProbe]:
    """Return how presses of foreign probes are answered, each probe on a core of its own."""
    allowing = tolerant(setup.design)
    critical = limits(allowing, setup.model, setup.seed)["standard"]

    def tried(place: int) -> TriedProbe:
        return _tried(setup, lit, place + 1, presses, (allowing, critical))

    return in_parallel(tried, probes, setup.jobs, smallest_batch=1)


def _tried(
    setup: TrialSetup, lit: ProbeTables, number: int, presses: int, allowing: tuple[OwnAnswers, CriticalValues]
) -> TriedProbe:
    """Return how presses of one foreign probe, `lit` as its tables say, are answered by all who may.

    `allowing`: what answers by a builder's tolerances alone, and above what it refuses.
    """
    model, design, jobs = setup.model, setup.design, 1
    probe = probe_part(foreign_world(setup.seed, number))
    noise, own = model.answers.noise, derived_seed(setup.seed, f"probe {number}")
    taken, of_design = _as_lit(setup, lit, probe, presses, own)
    scans, scans_of_design = _as_lit(setup, lit, probe, (presses + 1) // 2, own, are_scans=True)
    ramps = foreign_phantoms(lit, probe, noise, setup.phantoms, seed=own, jobs=jobs)
    fit = fit_probe(ramps, design)
    answers, known = answers_of(design, fit), known_probe(design, probe)
    critical, critical_of_known = (limits(one, model, setup.seed) for one in (answers, known))
    few = taken.first(FEW)
    scores = {
        SHIPPED: scored(model.answers, model, model.critical["standard"], few, jobs),
        TOLERANCES: scored(allowing[0], model, allowing[1], few, jobs),
        COMMISSIONED: scored(answers, model, critical["standard"], taken, jobs),
        KNOWN: scored(known, model, critical_of_known["standard"], of_design, jobs),
        SCANS: scored(answers, model, critical["precise"], scans, jobs),
        KNOWN_SCANS: scored(known, model, critical_of_known["precise"], scans_of_design, jobs),
    }
    nothing, of_two = (
        foreign_presses(lit, probe, noise, count, seed=own, jobs=jobs, are_scans=are_scans, have_inclusion=False)
        for count, are_scans in ((presses, False), ((presses + 1) // 2, True))
    )
    free = {
        COMMISSIONED: inclusion_free(answers, model, critical["standard"], nothing),
        SCANS: inclusion_free(answers, model, critical["precise"], of_two),
    }
    return TriedProbe(number, scores, fit, free)


def inclusion_free(
    answers: OwnAnswers, model: RampModel, critical: CriticalValues, taken: ForeignPresses
) -> InclusionFree:
    """Return how often presses or scans where there is no inclusion have numbers."""
    shown = [one for one in taken.seen if any(stands_out(row, answers.noise) for row in one.rows)]
    answered = sum(checked_answer(answers, model, critical, one).has_numbers for one in shown)
    return InclusionFree(len(taken.seen), len(shown), answered)


def _as_lit(
    setup: TrialSetup, lit: ProbeTables, probe: World, count: int, seed: int, *, are_scans: bool = False
) -> tuple[ForeignPresses, ForeignPresses]:
    """Return presses or scans of a probe that is `lit` as its tables say, and the same with the design's light."""

    def pressed(tables: ProbeTables) -> ForeignPresses:
        noise = setup.model.answers.noise
        return foreign_presses(tables, probe, noise, count, seed=seed, jobs=1, are_scans=are_scans)

    own = pressed(lit)
    return own, own if lit is setup.tables else pressed(setup.tables)


def true_directions(world: World) -> Array:
    """Return what a world's probe is along the directions of `PROBE` [D], in their units."""
    layers = world.layers
    of_probe = {
        "contact_exponent": world.contact.exponent - 1,
        "face_modulus_log_ratio": math.log(layers.face_modulus_ratio),
        "middle_modulus_log_ratio": math.log(layers.middle_modulus_ratio),
        "backing_modulus_log_ratio": math.log(layers.backing_modulus_ratio),
        "cell_span_ratio": world.cell_span_ratio - 1,
        "face_motion_ratio": world.face_motion_ratio,
    }
    return np.array([of_probe[NAMES[number]] for number in PROBE])


def known_probe(design: Design, world: World) -> OwnAnswers:
    """Return what answers presses of a world's probe that is known exactly, whoever presses it on whomever.

    Its directions are believed as closely as after commissioning, for linear terms do not carry them whole. What has no
    direction - the largest contact, light of single sides, texture - this probe does not know either.
    """
    believed = tolerant(design)
    mean, covariance = np.array(believed.own.mean), np.array(believed.own.covariance)
    mean[PROBE] = true_directions(world)
    covariance[np.ix_(PROBE, PROBE)] = np.diag((FLOOR * STD[PROBE]) ** 2)
    return OwnAnswers(believed.surrogate, believed.noise, replace(believed.own, mean=mean, covariance=covariance))


def _of_design(setup: TrialSetup, count: int) -> ScoredPresses:
    """Return presses of the design's own probe, known exactly, by the same hands on the same patients."""
    probe = replace(AS_BELIEVED, texture=probe_part(foreign_world(setup.seed, 1)).texture)
    own = derived_seed(setup.seed, "presses of a known probe")
    taken = foreign_presses(setup.tables, probe, setup.model.answers.noise, count, seed=own, jobs=setup.jobs)
    known = known_probe(setup.design, probe)
    critical = limits(known, setup.model, setup.seed)["standard"]
    return scored(known, setup.model, critical, taken, setup.jobs)


def _chapter(
    title: str,
    claim: str,
    source: str,
    trials: Sequence[TriedProbe],
    of_design: ScoredPresses,
    goals: Mapping[str, float],
) -> Chapter:
    of_groups = {group: [trial.of_group(group) for trial in trials] for group in GROUPS}
    pressed = {group: of_one for group, of_one in of_groups.items() if _count(of_one)}
    tables = [
        table
        for group, of_one in pressed.items()
        for table in (_table_of_all(group, of_one, of_group(of_design, group)), _table_of_each(group, of_one))
    ]
    free = {name: _all_free(trials, name) for name in (COMMISSIONED, SCANS)}
    tables.append(Table(
        "Presses and scans where there is no inclusion",
        ("answered by", "presses", "contrast stands out", "have numbers", "share"),
        tuple((name, *one.row()) for name, one in free.items()),
    ))  # fmt: skip
    return Chapter(
        title=title,
        claim=claim,
        source=source,
        benchmarks=tuple(
            one
            for group, of_one in pressed.items()
            for one in benchmarks(group, of_one, goals if group == GROUPS[0] else _of_soft(goals))
        )
        + tuple(
            at_most(name, "presses without an inclusion that have numbers", one.answered / one.presses, FALSE_ALARMS)
            for name, one in free.items()
        ),
        tables=tuple(tables),
        facts={
            "probes": len(trials),
            "presses": [len(one.scores[COMMISSIONED].is_answered) for one in trials],
            "inclusion_free": {name: one._asdict() for name, one in free.items()},
            "refused_as_it_ships": round(1 - _whole(trials, SHIPPED).share_answered(), 3),
            "groups": {group: _facts(of_one) for group, of_one in pressed.items()},
        },
    )


def _all_free(trials: Sequence[TriedProbe], name: str) -> InclusionFree:
    """Return the counts of all probes together."""
    return InclusionFree(*(sum(counts) for counts in zip(*(one.inclusion_free[name] for one in trials), strict=True)))


def _of_soft(goals: Mapping[str, float]) -> dict[str, float]:
    """Return what is asked of soft inclusions: of each probe nothing, for so few of its presses are on them."""
    return {name: goal for name, goal in goals.items() if name != "each probe"}


def _count(trials: Sequence[TriedProbe]) -> int:
    return sum(len(trial.scores[COMMISSIONED].is_answered) for trial in trials)


def _whole(trials: Sequence[TriedProbe], name: str) -> ScoredPresses:
    return joined([trial.scores[name] for trial in trials])


def _table_of_all(group: str, trials: Sequence[TriedProbe], of_design: ScoredPresses) -> Table:
    rows = [(name, *figures_of(_whole(trials, name))) for name in trials[0].scores]
    rows.append(("the design's own probe", *figures_of(of_design)))
    return Table(f"All probes together, inclusions of {group}", ("answered by", *FIGURES), tuple(rows))


def _table_of_each(group: str, trials: Sequence[TriedProbe]) -> Table:
    rows = [
        (
            f"{trial.number}",
            *figures_of(trial.scores[COMMISSIONED]),
            *("" if np.isnan(ratio) else f"{ratio:.2f}" for ratio in rmse_ratio([trial])),
            f"{trial.fit.levels.model_ratio:.1%}",
            f"{trial.fit.believed.discrepancy_ratio:.0%}",
        )
        for trial in trials
    ]
    header = ("probe", *FIGURES, "size RMSE over known", "depth RMSE over known", "model error", "lacking")
    return Table(f"Each probe, commissioned, inclusions of {group}", header, tuple(rows))


class Pairs(NamedTuple):
    """The same presses, of all probes, by the commissioned probe and by the one known exactly."""

    found: ScoredPresses
    known: ScoredPresses

    def answered_ratio(self) -> float:
        """Return the share of what the known probe answers that the commissioned one answers; NaN of nothing."""
        return _share(self.found.is_answered, self.known.is_answered)

    def determined_ratio(self) -> float:
        """Return the same of presses whose size and depth are determined."""
        found, known = (one.is_answered & one.evaluated.is_known[:, :2].all(axis=1) for one in (self.found, self.known))
        return _share(found, known)

    def rmse_ratio(self) -> Array:
        """Return errors of size and depth [2] over the known probe's, of what both answer; NaN of nothing."""
        both = self.found.is_answered & self.known.is_answered
        if not both.any():
            return np.full(2, np.nan)
        of_found, of_known = (np.sqrt((one.part(both).error_mm() ** 2).mean(axis=0)) for one in self)
        return np.asarray(of_found / np.maximum(of_known, LEAST_MM))


def _share(found: NDArray[np.bool_], known: NDArray[np.bool_]) -> float:
    return float(found[known].mean()) if known.any() else np.nan


def pairs_of(trials: Sequence[TriedProbe], name: str = COMMISSIONED) -> Pairs:
    """Return the pairs of all probes, by one of those in `BESIDE`."""
    found, known = zip(*(paired(one.scores[name], one.scores[BESIDE[name]]) for one in trials), strict=True)
    return Pairs(joined(found), joined(known))


def rmse_ratio(trials: Sequence[TriedProbe]) -> Array:
    """Return errors of size and depth [2] of probes over those of the same probes known exactly."""
    return pairs_of(trials).rmse_ratio()


def benchmarks(group: str, trials: Sequence[TriedProbe], goals: Mapping[str, float]) -> list[Benchmark]:
    """Return what commissioned probes reach of what is asked for, of inclusions of one group, in presses and scans.

    There are few scans: of those of one probe, and of soft inclusions, nothing is asked.
    """
    of_scans = {name: goal for name, goal in goals.items() if name != "each probe"}
    asked = {COMMISSIONED: goals} | ({SCANS: of_scans} if group == GROUPS[0] else {})
    return [
        benchmark
        for name, of_name in asked.items()
        if len(_whole(trials, name).is_answered)
        for benchmark in _benchmarks(f"{name}, {group}", trials, name, of_name)
    ]


def _benchmarks(case: str, trials: Sequence[TriedProbe], name: str, goals: Mapping[str, float]) -> Iterator[Benchmark]:
    whole, names, pairs = _whole(trials, name), UNKNOWNS[:2], pairs_of(trials, name)
    each = np.array([trial.scores[name].determined_covered() for trial in trials])
    covered = whole.determined_covered()
    least = {
        "answered": [
            ("answered, of what the probe known exactly answers", pairs.answered_ratio()),
            ("size and depth determined, of where the probe known exactly has both", pairs.determined_ratio()),
        ],
        "pooled": [(f"{unknown} covered, determined, pooled", covered[i]) for i, unknown in enumerate(names)],
        "each probe": [
            (f"{unknown} covered, determined, worst probe", min(share for share in each[:, i] if share == share))
            for i, unknown in enumerate(names)
            if not np.isnan(each[:, i]).all()
        ],
        "joint": [("joint region of size and depth holds", whole.region_holds())],
    }
    for goal, figures in least.items():
        for what, found in figures if goal in goals else ():
            yield at_least(case, what, float(found), goals[goal])
    for unknown, ratio in zip(names, map(float, pairs.rmse_ratio()), strict=True):
        yield at_most(case, f"{unknown} RMSE over the same probe's known exactly", ratio, goals["rmse"])


def _facts(trials: Sequence[TriedProbe]) -> dict[str, dict[str, float | None]]:
    """Return the shares of one group that the page's prose quotes; None without answers."""

    def of(found: ScoredPresses) -> dict[str, float | None]:
        size, depth = found.determined_covered()
        both = found.covered().all(axis=1).mean() if found.is_answered.any() else np.nan
        shares = {"size": size, "depth": depth, "both": both, "region": found.region_holds()}
        return {name: None if np.isnan(one) else round(float(one), 3) for name, one in shares.items()}

    return {name: of(_whole(trials, name)) for pair in BESIDE.items() for name in pair}
