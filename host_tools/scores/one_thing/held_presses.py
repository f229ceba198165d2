"""Mode quick of probes that somebody built: held presses of foreign probes, before and after commissioning.

Probes, patients and hands are as in `robustness`. A press is read at 0.5 N, with the camera's noise of one frame. As it
ships mode quick is the simulated probe's; commissioned it is trained on what each probe's own phantoms tell of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import UNKNOWNS
from device.measurement.quick_mode.profile import QuickPress
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.simulation.physics.world import World
from device.simulation.scenario import NO_INCLUSION
from host_tools.commissioning.joint_fit import fit_probe
from host_tools.commissioning.left_out import answers_of
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_most
from host_tools.press_models.press_samples import PressedScene, draw_parameters
from host_tools.press_models.quick_training import QuickBudget, camera_of_a_hold
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed
from host_tools.scenes.phantom_set import PhantomSet
from host_tools.scores.foreign_presses import OF_PATIENTS, foreign_phantoms, press_part, probe_part
from host_tools.scores.foreign_probes import foreign_world
from host_tools.scores.one_thing.press_answers import (
    COMMISSIONED,
    SHIPPED,
    DesignToTry,
    has_quick_numbers,
    own_quick_model,
    quick_scores,
)
from host_tools.scores.one_thing.tried_presses import held_press
from host_tools.scores.robustness import FALSE_ALARMS, GROUPS, of_group
from host_tools.scores.scored_presses import FIGURES, ScoredPresses, covered_at_least, figures_of, joined

PROBES, PRESSES, CAMERA = 6, 100, 100
"""Probes, of which each training takes some seven minutes of a core; presses of each; recordings for the noise."""
COVERED = 0.86
"""What is asked of what mode quick answers; it may refuse the rest."""
HeldScores = dict[str, ScoredPresses]


class TriedHolds(NamedTuple):
    """Answers to held presses of one probe, and how many have numbers of as many without an inclusion."""

    scores: HeldScores
    false_alarms: int


class ForeignHolds(NamedTuple):
    """Parameters [n, 9] of presses of a probe, and what mode quick reads of each."""

    parameters: Array
    held: list[QuickPress]


def held_presses_chapter(
    design: DesignToTry,
    phantoms: PhantomSet,
    *,
    probes: int = PROBES,
    presses: int = PRESSES,
    budget: QuickBudget | None = None,
    seed: int = 1,
    jobs: int = -1,
) -> Chapter:
    """Return how held presses of the first of the foreign probes are answered, a core for each probe."""
    camera = camera_of_a_hold(design.tables, CAMERA, derived_seed(seed, "camera of held presses"), jobs)

    def tried(place: int) -> TriedHolds:
        number = place + 1
        probe, own = probe_part(foreign_world(seed, number)), derived_seed(seed, f"probe {number}")
        quick = own_quick_model(design, own_answers(design, probe, phantoms, own), seed, jobs=1, budget=budget)
        parameters, held = foreign_holds(design, probe, camera, presses, own)
        free = foreign_holds(design, probe, camera, presses, own, have_inclusion=False).held
        scores = {
            SHIPPED: quick_scores(parameters, held, design.quick),
            COMMISSIONED: quick_scores(parameters, held, quick),
        }
        return TriedHolds(scores, sum(has_quick_numbers(one, quick) for one in free))

    trials = in_parallel(tried, probes, jobs, smallest_batch=1)
    found, false_alarms = [one.scores for one in trials], sum(one.false_alarms for one in trials)
    share = false_alarms / (probes * presses)
    return Chapter(
        title="Held presses of probes of random tolerances",
        claim=f"Mode quick on {probes} of these probes, {presses} random presses each; phantoms as {phantoms.serial}.",
        source="host_tools/scores/one_thing/held_presses.py; probes: those of the chapter before",
        benchmarks=(
            *_benchmarks(found),
            at_most(COMMISSIONED, "presses without an inclusion that have numbers", share, FALSE_ALARMS),
        ),
        tables=tuple(_tables(found)),
        facts={"probes": probes, "presses": presses, "false_alarms": false_alarms},
    )


def own_answers(design: DesignToTry, probe: World, phantoms: PhantomSet, seed: int) -> OwnAnswers:
    """Return what commissioning finds of a probe on its phantoms."""
    ramps = foreign_phantoms(design.tables, probe, design.model.answers.noise, phantoms, seed=seed, jobs=1)
    return answers_of(design.shared, fit_probe(ramps, design.shared))


def foreign_holds(
    design: DesignToTry, probe: World, camera: Array, count: int, seed: int, *, have_inclusion: bool = True
) -> ForeignHolds:
    """Return presses of a probe on patients, held at 0.5 N; no draw is of `foreign_presses`."""
    of_truths, of_presses = (5, 6) if have_inclusion else (11, 12)
    parameters = draw_parameters(count, np.random.default_rng([seed, of_truths]), ranges=OF_PATIENTS)
    if not have_inclusion:
        parameters[:, : len(UNKNOWNS)] = NO_INCLUSION.as_tuple()
    noise = design.model.answers.noise

    def held(number: int) -> QuickPress:
        rng = np.random.default_rng([seed, of_presses, number])
        scene = PressedScene(design.tables, world=press_part(probe, rng))
        return held_press(scene.press(parameters[number], float(rng.uniform(0, 2 * np.pi))), noise, rng, camera)

    return ForeignHolds(parameters, [held(number) for number in range(count)])


def _whole(found: Sequence[Mapping[str, ScoredPresses]], name: str, group: str) -> ScoredPresses:
    return of_group(joined([one[name] for one in found]), group)


def _benchmarks(found: Sequence[HeldScores]) -> Iterator[Benchmark]:
    for group in GROUPS:
        whole = _whole(found, COMMISSIONED, group)
        yield from covered_at_least(f"commissioned, {group}", whole, COVERED)


def _tables(found: Sequence[HeldScores]) -> Iterator[Table]:
    for group in GROUPS:
        rows = [(name, *figures_of(_whole(found, name, group))) for name in (SHIPPED, COMMISSIONED)]
        yield Table(f"Mode quick, all probes together, inclusions of {group}", ("answered", *FIGURES), tuple(rows))
    of_each = [
        (f"{number}", *figures_of(of_group(one[COMMISSIONED], GROUPS[0]))) for number, one in enumerate(found, start=1)
    ]
    caption = f"Mode quick, each probe, commissioned, inclusions of {GROUPS[0]}"
    yield Table(caption, ("probe", *FIGURES), tuple(of_each))
