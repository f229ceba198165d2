"""Tissue that is uneven in depth, and other tissue beside the lesion: what answers are worth there, and false alarms.

Tables, models and commissioning know even tissue, whose modulus beside the lesion differs from that over it by a
twentieth. Fat, gland and muscle lie in layers, and elsewhere in others. Here tissue is a stack of layers whose moduli
are drawn, each press solved for itself (`solved_layers`). A scan begins with that press; its second one, beside the
inclusion, is solved in three dimensions. Layers are even across the face: what lies on one side of the probe alone is
in none of these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.mode import Mode
from device.measurement.quantities import UNKNOWNS, Inclusion
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.radial_profile import SeenPresses
from device.measurement.ramp_modes.surrogate import OFFSET
from device.simulation.physics.slab import Slab
from device.simulation.physics.surface_table import PressRamps
from device.simulation.physics.world import AS_BELIEVED
from device.simulation.scenario import NO_INCLUSION
from device.simulation.virtual_probe import ProbeTables
from host_tools.forward.press_model import PressFailed
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_most
from host_tools.press_models.press_samples import PressedRings, PressedScene
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed
from host_tools.probe_tables.force_ramps import TissueStack
from host_tools.scores.foreign_presses import FURTHER_MM, ForeignPresses, seen_presses
from host_tools.scores.one_thing.press_answers import TOLERANT, DesignToTry, with_tolerances
from host_tools.scores.one_thing.solved_layers import aside_in_layers, in_layers
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
PRESSES, SCANS, SCANNED = 48, 24, ", scans of two"
COVERED_AT_LEAST, FALSE_ALARMS = 0.86, 0.015


class OnAndOff(NamedTuple):
    """What is seen on an inclusion, and where there is none."""

    on_it: SeenPresses
    without: SeenPresses


class UnevenPress(NamedTuple):
    """What is seen in one kind of tissue of a press, and of the scan that begins with it: of that press alone, where no
    scan is asked for."""

    single: OnAndOff
    scan: OnAndOff


def uneven_tissue_chapter(
    design: DesignToTry,
    *,
    presses: int = PRESSES,
    scans: int = SCANS,
    kinds: Sequence[UnevenTissue] = KINDS,
    seed: int = 1,
    jobs: int = -1,
) -> Chapter:
    """Return how presses in each kind of tissue are answered by a probe that allows for tolerances, and scans of two
    that begin with the first of these; an hour."""
    own, parameters = with_tolerances(design, seed), on_axis(presses, derived_seed(seed, "uneven tissue"))
    pressed = in_parallel(
        lambda number: pressed_in(design, parameters[number], kinds=kinds, seed=[seed, number], is_scan=number < scans),
        presses,
        jobs,
    )
    solved = [number for number, in_kinds in enumerate(pressed) if in_kinds]
    no_inclusions = np.array(parameters)
    no_inclusions[:, : len(UNKNOWNS)] = NO_INCLUSION.as_tuple()

    def answered(mode: Mode, place: int, numbers: Sequence[int]) -> _Answered:
        score = partial(scored, own.answers, design.model, own.critical[mode], jobs=jobs)
        seen = [pressed[n][place].single if mode == "standard" else pressed[n][place].scan for n in numbers]
        on_it, without = zip(*seen, strict=True)
        return _Answered(
            score(taken=ForeignPresses(parameters[numbers], list(on_it))),
            score(taken=ForeignPresses(no_inclusions[numbers], list(without))),
            len(numbers),
        )

    scanned = [number for number in solved if number < scans]
    found = {kind.words: answered("standard", place, solved) for place, kind in enumerate(kinds)}
    if scanned:
        found |= {f"{kind.words}{SCANNED}": answered("precise", place, scanned) for place, kind in enumerate(kinds)}
    return Chapter(
        title="Uneven tissue",
        claim=f"{len(solved)} random presses on the middle of an inclusion, and as many without one, in mode standard; "
        f"{len(scanned)} scans of two that begin with the first of these, in mode precise.",
        source="host_tools/scores/one_thing/uneven_tissue.py; host_tools/scores/one_thing/solved_layers.py",
        benchmarks=tuple(one for words, of_kind in found.items() for one in _benchmarks(words, of_kind)),
        tables=(
            Table(
                "Tissue, presses on an inclusion",
                ("tissue", "answered by", *FIGURES),
                tuple((words, TOLERANT, *figures_of(of_kind.on_it)) for words, of_kind in found.items()),
            ),
            Table(
                "Tissue, presses where there is no inclusion",
                ("tissue", "presses", "contrast stands out", "have numbers", "share"),
                tuple((words, *_alarms(of_kind)) for words, of_kind in found.items()),
            ),
        ),
        facts={"presses": len(solved), "scans": len(scanned)},
    )


class _Answered(NamedTuple):
    """Answers in one kind of tissue to so many presses or scans on an inclusion, and to as many without one."""

    on_it: ScoredPresses
    without: ScoredPresses
    presses: int

    @property
    def alarms(self) -> int:
        """How many of those without an inclusion have numbers."""
        return int(self.without.is_answered.sum())


def _benchmarks(words: str, found: _Answered) -> list[Benchmark]:
    said = at_most(words, "presses without an inclusion that have numbers", found.alarms / found.presses, FALSE_ALARMS)
    return [*covered_at_least(words, found.on_it, COVERED_AT_LEAST), said]


def _alarms(found: _Answered) -> tuple[str, ...]:
    share = f"{100 * found.alarms / found.presses:.1f} %"
    return f"{found.presses}", f"{len(found.without.number)}", f"{found.alarms}", share


def pressed_in(
    design: DesignToTry,
    parameters: Array,
    *,
    kinds: Sequence[UnevenTissue],
    seed: Sequence[int],
    is_scan: bool = False,
) -> list[UnevenPress]:
    """Return what is seen of a press with parameters [9] in each kind of tissue, with one draw of layers and noise; []
    where no solver reaches its forces."""
    slab, inclusion = Slab(*map(float, parameters[3:5])), Inclusion(*map(float, parameters[:3]))
    as_tabled = design.tables.ramps(inclusion, slab, AS_BELIEVED)
    over, beside = zip(*(stacks_of(kind, slab, np.random.default_rng([*seed, 2])) for kind in kinds), strict=True)
    further_mm = np.random.default_rng([*seed, 3]).uniform(*FURTHER_MM, 1 if is_scan else 0)
    try:
        here = in_layers(as_tabled, slab, inclusion, over)
        there = in_layers(as_tabled, slab, None, beside)
        aside = [
            aside_in_layers(design.tables.off_axis, slab, inclusion, float(offset_mm), over) for offset_mm in further_mm
        ]
    except PressFailed:
        return []
    tables = [replace(design.tables, off_axis=one) for one in aside[0]] if is_scan else [design.tables] * len(kinds)
    places = np.tile(parameters, (1 + len(further_mm), 1))
    places[1:, OFFSET] = further_mm
    noise = design.model.answers.noise
    return [
        _seen(_Scenes(of_kind, design.tables, on_it, reference), places, noise, np.random.default_rng(seed))
        for of_kind, on_it, reference in zip(tables, here, there, strict=True)
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


class _Scenes(NamedTuple):
    """One kind of tissue: tables of the inclusion aside and of none, ramps over the inclusion and of the reference."""

    tables: ProbeTables
    without: ProbeTables
    here: PressRamps
    there: PressRamps

    def press(self, parameters: Array, direction_rad: float) -> PressedRings:
        """Return a press on the inclusion."""
        return PressedScene(self.tables, self.here, reference_ramps=self.there).press(parameters, direction_rad)

    def press_without(self, parameters: Array, direction_rad: float) -> PressedRings:
        """Return the same press where there is no inclusion."""
        field, no_inclusion = self.here.inclusion_field, parameters.copy()
        no_inclusion[: len(UNKNOWNS)] = NO_INCLUSION.as_tuple()
        without = self.here._replace(inclusion_field=replace(field, fields_per_n=np.zeros_like(field.fields_per_n)))
        return PressedScene(self.without, without, reference_ramps=self.there).press(no_inclusion, direction_rad)


def _seen(scenes: _Scenes, places: Array, noise: PressNoise, rng: np.random.Generator) -> UnevenPress:
    """Return what is seen of a press at the first of the places [N, 9], and of a scan of all of them."""
    direction_rad = rng.uniform(0, 2 * np.pi, len(places))
    pressed = [
        [press(at, float(angle)) for at, angle in zip(places, direction_rad, strict=True)]
        for press in (scenes.press, scenes.press_without)
    ]

    def seen_of_first(count: int) -> OnAndOff:
        return OnAndOff(*(seen_presses(rings[:count], direction_rad[:count], noise, rng) for rings in pressed))

    return UnevenPress(seen_of_first(1), seen_of_first(len(places)))
