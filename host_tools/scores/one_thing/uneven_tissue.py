"""Tissue that is uneven in depth, and other tissue beside the lesion: what answers are worth there, and false alarms.

Tables, models and commissioning know even tissue, whose modulus beside the lesion differs from that over it by a
twentieth. Fat, gland and muscle lie in layers, and elsewhere in others. Here tissue is a stack of layers whose moduli
are drawn, each press solved for itself (`solved_layers`). Layers are even across the face: what lies on one side of the
probe alone is in none of these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import UNKNOWNS, Inclusion
from device.measurement.ramp_modes.radial_profile import SeenPresses
from device.simulation.physics.slab import Slab
from device.simulation.physics.surface_table import PressRamps
from device.simulation.physics.world import AS_BELIEVED
from device.simulation.scenario import NO_INCLUSION
from host_tools.forward.press_model import PressFailed
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_most
from host_tools.press_models.press_samples import PressedScene
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed
from host_tools.probe_tables.force_ramps import TissueStack
from host_tools.scores.foreign_presses import ForeignPresses, seen_presses
from host_tools.scores.one_thing.press_answers import TOLERANT, DesignToTry, with_tolerances
from host_tools.scores.one_thing.solved_layers import in_layers
from host_tools.scores.one_thing.solved_skins import on_axis
from host_tools.scores.scored_presses import FIGURES, ScoredPresses, covered_at_least, figures_of, scored


class UnevenTissue(NamedTuple):
    """How layers differ: standard deviation of the logarithm of each one's modulus, and what all deep ones are over it.

    `is_alike_beside`: whether the same layers lie below the reference press.
    """

    log_spread: float
    deep_ratio: float = 1.0
    is_alike_beside: bool = False

    @property
    def words(self) -> str:
        """As a row of a table names it."""
        if not self.log_spread:
            return f"{self.deep_ratio:g} times as stiff below {DEEP_FROM_MM:g} mm" if self.deep_ratio != 1 else "even"
        return f"uneven by {100 * self.log_spread:.0f} %, {'alike' if self.is_alike_beside else 'other'} beside"


LAYER_MM, LAYERS, DEEP_FROM_MM = 4.0, 6, 8.0
"""Layers are as thick as lobules of fat; below so many the tissue is in one piece."""
ABOVE_BASE_MM = 1.5
EVEN = UnevenTissue(0.0)
KINDS = (
    EVEN,
    UnevenTissue(0.0, deep_ratio=2.0, is_alike_beside=True),
    UnevenTissue(0.2, is_alike_beside=True),
    UnevenTissue(0.1),
    UnevenTissue(0.2),
    UnevenTissue(0.3),
)
PRESSES = 48
COVERED_AT_LEAST, FALSE_ALARMS = 0.86, 0.015


class UnevenPress(NamedTuple):
    """What is seen of a press in one kind of tissue, with its inclusion and without."""

    with_inclusion: SeenPresses
    without: SeenPresses


def uneven_tissue_chapter(
    design: DesignToTry, *, presses: int = PRESSES, kinds: Sequence[UnevenTissue] = KINDS, seed: int = 1, jobs: int = -1
) -> Chapter:
    """Return how presses in each kind of tissue are answered by a probe that allows for tolerances; a quarter hour."""
    own, parameters = with_tolerances(design, seed), on_axis(presses, derived_seed(seed, "uneven tissue"))
    pressed = in_parallel(
        lambda number: pressed_in(design, parameters[number], kinds=kinds, seed=[seed, number]), presses, jobs
    )
    solved = [number for number, in_kinds in enumerate(pressed) if in_kinds]
    no_inclusions = parameters[solved]
    no_inclusions[:, : len(UNKNOWNS)] = NO_INCLUSION.as_tuple()
    score = partial(scored, own.answers, design.model, own.critical["standard"], jobs=jobs)
    found = {
        kind.words: (
            score(taken=ForeignPresses(parameters[solved], [pressed[n][place].with_inclusion for n in solved])),
            score(taken=ForeignPresses(no_inclusions, [pressed[n][place].without for n in solved])),
        )
        for place, kind in enumerate(kinds)
    }
    return Chapter(
        title="Uneven tissue",
        claim=f"{len(solved)} random presses on the middle of an inclusion, and as many without one, in mode standard.",
        source="host_tools/scores/one_thing/uneven_tissue.py; host_tools/scores/one_thing/solved_layers.py",
        benchmarks=tuple(one for words, of_kind in found.items() for one in _benchmarks(words, *of_kind, len(solved))),
        tables=(
            Table(
                "Tissue, presses on an inclusion",
                ("tissue", "answered by", *FIGURES),
                tuple((words, TOLERANT, *figures_of(on_it)) for words, (on_it, _) in found.items()),
            ),
            Table(
                "Tissue, presses where there is no inclusion",
                ("tissue", "presses", "contrast stands out", "have numbers", "share"),
                tuple((words, *_alarms(without, len(solved))) for words, (_, without) in found.items()),
            ),
        ),
        facts={"presses": len(solved)},
    )


def _benchmarks(words: str, on_it: ScoredPresses, without: ScoredPresses, presses: int) -> list[Benchmark]:
    share = float(without.is_answered.sum()) / presses
    said = at_most(words, "presses without an inclusion that have numbers", share, FALSE_ALARMS)
    return [*covered_at_least(words, on_it, COVERED_AT_LEAST), said]


def _alarms(without: ScoredPresses, presses: int) -> tuple[str, ...]:
    answered = int(without.is_answered.sum())
    return f"{presses}", f"{len(without.number)}", f"{answered}", f"{100 * answered / presses:.1f} %"


def pressed_in(
    design: DesignToTry, parameters: Array, *, kinds: Sequence[UnevenTissue], seed: Sequence[int]
) -> list[UnevenPress]:
    """Return what is seen of a press with parameters [9] in each kind of tissue, with one draw of layers and noise; []
    where no solver reaches its forces."""
    slab, inclusion = Slab(*map(float, parameters[3:5])), Inclusion(*map(float, parameters[:3]))
    as_tabled = design.tables.ramps(inclusion, slab, AS_BELIEVED)
    over, beside = zip(*(stacks_of(kind, slab, np.random.default_rng([*seed, 2])) for kind in kinds), strict=True)
    try:
        here = in_layers(as_tabled, slab, inclusion, over)
        there = in_layers(as_tabled, slab, None, beside)
    except PressFailed:
        return []
    return [
        _seen(design, parameters, on_it, reference, np.random.default_rng(seed))
        for on_it, reference in zip(here, there, strict=True)
    ]


def stacks_of(kind: UnevenTissue, slab: Slab, rng: np.random.Generator) -> tuple[TissueStack, TissueStack]:
    """Return the layers over a lesion and beside it; kinds that are drawn alike differ by their spread alone."""
    tops_mm = LAYER_MM * np.arange(1, LAYERS + 1)
    count = int((tops_mm < slab.thickness_mm - ABOVE_BASE_MM).sum())
    over, beside = np.clip(rng.standard_normal((2, LAYERS + 1)), -2, 2)[:, : count + 1]
    is_deep = np.r_[0.0, tops_mm[:count]] >= DEEP_FROM_MM

    def stack(drawn: Array) -> TissueStack:
        ratios = np.where(is_deep, kind.deep_ratio, 1.0) * np.exp(kind.log_spread * drawn)
        return TissueStack((LAYER_MM,) * count, tuple(map(float, ratios)))

    return stack(over), stack(over if kind.is_alike_beside else beside)


def _seen(
    design: DesignToTry, parameters: Array, here: PressRamps, there: PressRamps, rng: np.random.Generator
) -> UnevenPress:
    direction_rad, noise = rng.uniform(0, 2 * np.pi, 1), design.model.answers.noise
    field, no_inclusion = here.inclusion_field, parameters.copy()
    no_inclusion[: len(UNKNOWNS)] = NO_INCLUSION.as_tuple()
    without = here._replace(inclusion_field=replace(field, fields_per_n=np.zeros_like(field.fields_per_n)))
    scenes = (here, parameters), (without, no_inclusion)
    rings = [
        PressedScene(design.tables, ramps, reference_ramps=there).press(values, float(direction_rad[0]))
        for ramps, values in scenes
    ]
    return UnevenPress(*(seen_presses([one], direction_rad, noise, rng) for one in rings))
