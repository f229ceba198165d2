"""Skin of other thickness than the tables know, solved anew: what answers are worth there.

The virtual probe has skin of 1.5 mm, and so have all who learn from it. Here each press has the tables' face and what
a skin adds to it, solved for its scene (`solved_layers`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.radial_profile import SeenPresses
from device.measurement.ramp_modes.surrogate import OFFSET
from device.simulation.physics.slab import Slab
from device.simulation.physics.world import AS_BELIEVED
from host_tools.forward.press_model import PressFailed
from host_tools.pages.benchmark import Chapter, Table
from host_tools.press_models.press_samples import PressedScene, draw_parameters
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed
from host_tools.probe_tables.force_ramps import TissueStack
from host_tools.scores.foreign_presses import OF_PATIENTS, ForeignPresses, seen_presses
from host_tools.scores.one_thing.press_answers import TOLERANT, DesignToTry, with_tolerances
from host_tools.scores.one_thing.solved_layers import in_layers
from host_tools.scores.scored_presses import FIGURES, covered_at_least, figures_of, scored


class SolvedSkin(NamedTuple):
    """A skin: its thickness (mm), and its modulus over that of the tissue below."""

    thickness_mm: float
    modulus_ratio: float

    @property
    def words(self) -> str:
        """As a row of a table names it."""
        return f"{self.thickness_mm:g} mm, {self.modulus_ratio:g} times"

    @property
    def stack(self) -> TissueStack:
        """The skin as the uppermost layer of tissue."""
        return TissueStack((self.thickness_mm,), (self.modulus_ratio, 1.0))


SKINS = SolvedSkin(1.0, 3.0), SolvedSkin(2.0, 2.0), SolvedSkin(2.0, 4.0)
PRESSES = 24
COVERED_AT_LEAST = 0.86
ON_AXIS_MM = 0.1
"""Presses are on the middle: scenes are axisymmetric, and no table of inclusions aside is asked."""


def solved_skins_chapter(
    design: DesignToTry,
    *,
    presses: int = PRESSES,
    skins: Sequence[SolvedSkin] = SKINS,
    seed: int = 1,
    jobs: int = -1,
) -> Chapter:
    """Return how presses on each skin are answered by a probe that allows for tolerances; minutes."""
    own, parameters = with_tolerances(design, seed), on_axis(presses, derived_seed(seed, "solved skins"))
    seen_on = partial(pressed_on_skins, design, skins=skins)
    pressed = in_parallel(lambda i: seen_on(parameters[i], seed=[seed, i]), presses, jobs)
    solved = [number for number, on_skins in enumerate(pressed) if on_skins]
    found = {
        skin: scored(
            own.answers,
            design.model,
            own.critical["standard"],
            ForeignPresses(parameters[solved], [pressed[number][place] for number in solved]),
            jobs,
        )
        for place, skin in enumerate(skins)
    }
    return Chapter(
        title="Skins solved anew",
        claim=f"{len(solved)} random presses on the middle of an inclusion, in mode standard.",
        source="host_tools/scores/one_thing/solved_skins.py; host_tools/scores/one_thing/solved_layers.py",
        benchmarks=tuple(one for skin in skins for one in covered_at_least(skin.words, found[skin], COVERED_AT_LEAST)),
        tables=(
            Table(
                "Skin, its modulus over that of the tissue below",
                ("skin", "answered by", *FIGURES),
                tuple((skin.words, TOLERANT, *figures_of(of_one)) for skin, of_one in found.items()),
            ),
        ),
        facts={"presses": len(solved)},
    )


def on_axis(count: int, seed: int) -> Array:
    """Return parameters [count, 9] of random presses of patients on the middle of an inclusion."""
    parameters = draw_parameters(count, np.random.default_rng(seed), ranges=OF_PATIENTS)
    parameters[:, OFFSET] = ON_AXIS_MM
    return parameters


def pressed_on_skins(
    design: DesignToTry, parameters: Array, *, skins: Sequence[SolvedSkin], seed: Sequence[int]
) -> list[SeenPresses]:
    """Return what is seen of a press with parameters [9] on each skin, with one draw of noise; [] where no solver
    reaches its forces."""
    slab, inclusion = Slab(*map(float, parameters[3:5])), Inclusion(*map(float, parameters[:3]))
    as_tabled = design.tables.ramps(inclusion, slab, AS_BELIEVED)
    try:
        on_skins = [in_layers(as_tabled, slab, inclusion, [skin.stack])[0] for skin in skins]
    except PressFailed:
        return []
    direction_rad, noise = np.random.default_rng(seed).uniform(0, 2 * np.pi, 1), design.model.answers.noise
    pressed = [PressedScene(design.tables, ramps).press(parameters, float(direction_rad[0])) for ramps in on_skins]
    return [seen_presses([one], direction_rad, noise, np.random.default_rng([*seed, 1])) for one in pressed]
