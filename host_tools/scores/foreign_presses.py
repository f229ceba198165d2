"""Presses and phantoms of probes that differ from the design in all that a builder's tolerances and a hand leave open.

A world of `foreign_probes` is split: what is the probe's stays, what is a press' own - tilts, skin and tissue over the
lesion, relaxation, light between the presses, the patch of skin - is drawn anew for each; a further press of a scan has
tilt and light of its own, on the same patient. The probe's camera is left out: a grid target tells it, and it is undone
in the image. Rows are exact, of the virtual probe's own light and faces, with noise and drift as they are believed of
the design's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.parameters import PARAMETERS, RANGES, Range, box_of, denormalise
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.commissioned.own_posterior import seen_with_noise, to_bright_side
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.radial_profile import RESPONSE, SeenPresses
from device.measurement.ramp_modes.surrogate import OFFSET
from device.measurement.recording.led_sides import LedRatio
from device.simulation.physics.lens import AS_CERTIFIED
from device.simulation.physics.world import OverLesion, PressTilts, Relaxation, TrueLight, World
from device.simulation.scenario import NO_INCLUSION
from device.simulation.virtual_probe import ProbeTables
from host_tools.commissioning.phantom_ramps import PhantomRamp, stated_coordinates
from host_tools.press_models.press_samples import PressedRings, PressedScene, draw_parameters, harmonics_along
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.scenes.phantom_set import PhantomSet

TRIMMED = 0.1
"""What is left of the LEDs' imbalance: `light.target_counts` has the sides made alike."""
PHANTOM_OFFSET_MM = 0.5
"""How far off the middle of a phantom's inclusion the probe is set down, standard deviation in x and y."""
SURFACES = {"contact_pressure_kpa": (1.6, 2.4), "albedo": (0.42, 0.58), "spread_mm": (0.85, 1.2)}
"""Skins of two surfaces, the ends of their ranges: phantoms have one or the other."""
STIFFEST_SKIN = 2.0
"""Largest modulus of a patient's skin, its uppermost 1.5 mm, over that of the tissue below; a casting has none."""
FURTHER_MM = 2.0, 5.0
"""Offsets of the second press of a scan."""
OF_PATIENTS = RANGES | {"tissue_modulus_kpa": Range(2.4, 27.0, by_ratio=True)}
"""Tissue over a lesion may be a tenth softer or stiffer, and gives way by a twentieth: the tables hold that, too."""


class ForeignPresses(NamedTuple):
    """Parameters [n, 9] of presses, and what is `seen` of each, with noise."""

    parameters: Array
    seen: list[SeenPresses]

    def first(self, count: int) -> ForeignPresses:
        """Return the first of the presses."""
        return ForeignPresses(self.parameters[:count], self.seen[:count])


def probe_part(world: World) -> World:
    """Return what a world says of the probe alone, its camera undone and its sides made alike."""
    x, y, minus_x, minus_y = (1 + TRIMMED * (side - 1) for side in world.light.side_ratio)
    light = TrueLight(side_ratio=(x, y, minus_x, minus_y))
    return replace(
        world, camera=AS_CERTIFIED, lesion=OverLesion(), tilt=PressTilts(), relaxation=Relaxation(), light=light
    )


def press_part(probe: World, rng: np.random.Generator, *, on_phantom: bool = False) -> World:
    """Return the world of one press of a probe, as hand and skin would have it; a phantom is one casting."""
    about = 0.0 if on_phantom else 1.0
    tilts = 0.3 * rng.standard_normal(4)
    lesion = 1 + about * np.array([0.03, 0.02, 0.05]) * np.clip(rng.standard_normal(3), -2, 2)
    lit = _sides(rng)
    lost, constant_s, beside, lesion_rate = rng.uniform((0.02, 2.0, 0.1, 0.1), (0.05, 10.0, 0.2, 0.2))
    texture = replace(probe.texture, seed=int(rng.integers(2**31)))
    stiffer = STIFFEST_SKIN ** (about * rng.uniform())
    return replace(
        probe,
        tilt=PressTilts(*map(float, tilts)),
        lesion=OverLesion(*map(float, lesion)),
        relaxation=Relaxation(float(lost), float(constant_s), float(beside), float(lesion_rate)),
        light=replace(probe.light, lesion_side_ratio=lit),
        layers=replace(probe.layers, skin_modulus_ratio=float(stiffer)),
        texture=texture,
    )


def pressed_again(first: World, rng: np.random.Generator) -> World:
    """Return the world of a further press of a scan: of the hand and of the light another one, on the same patient."""
    x_deg, y_deg = map(float, 0.3 * rng.standard_normal(2))
    tilt = replace(first.tilt, lesion_x_deg=x_deg, lesion_y_deg=y_deg)
    return replace(first, tilt=tilt, light=replace(first.light, lesion_side_ratio=_sides(rng)))


def _sides(rng: np.random.Generator) -> LedRatio:
    x, y, left, below = map(float, 1 + 0.005 * rng.standard_normal(4))
    return x, y, left, below


def foreign_presses(
    tables: ProbeTables,
    probe: World,
    noise: PressNoise,
    count: int,
    *,
    seed: int,
    jobs: int = -1,
    are_scans: bool = False,
    have_inclusion: bool = True,
) -> ForeignPresses:
    """Return random presses of a probe on patients, in tissue that people have, or scans of two of them.

    Parameters of a scan are those of its first press; the second lies beside the inclusion, where there is one.
    """
    of_truths, of_presses = {  # no draw is of two of these, nor of phantoms or holds
        (False, True): (0, 1), (True, True): (3, 4), (False, False): (7, 8), (True, False): (9, 10),
    }[are_scans, have_inclusion]  # fmt: skip
    parameters = draw_parameters(count, np.random.default_rng([seed, of_truths]), ranges=OF_PATIENTS)
    if not have_inclusion:
        parameters[:, : len(UNKNOWNS)] = NO_INCLUSION.as_tuple()

    def pressed(number: int) -> SeenPresses:
        rng = np.random.default_rng([seed, of_presses, number])
        each, worlds = parameters[[number]], [press_part(probe, rng)]
        if are_scans:
            each = np.tile(each, (2, 1))
            each[1, OFFSET] = rng.uniform(*FURTHER_MM)
            worlds.append(pressed_again(worlds[0], rng))
        return _seen(tables, each, worlds, noise, rng)

    return ForeignPresses(parameters, in_parallel(pressed, count, jobs))


def foreign_phantoms(
    tables: ProbeTables, probe: World, noise: PressNoise, phantoms: PhantomSet, *, seed: int, jobs: int = -1
) -> list[PhantomRamp]:
    """Return the ramps of a probe on phantoms, whose true numbers lie about those stated by their tolerances."""

    def pressed(number: int) -> PhantomRamp:
        phantom, rng = phantoms.phantoms[number], np.random.default_rng([seed, 2, number])
        stated, std, has_inclusion = stated_coordinates(phantom)
        values = _true_values(stated, std, number, rng)
        if not has_inclusion:
            values[: len(UNKNOWNS)] = NO_INCLUSION.as_tuple()
        seen = _seen(tables, values[None], [press_part(probe, rng, on_phantom=True)], noise, rng)
        return PhantomRamp(phantom.name, seen, stated, std, has_inclusion)

    return in_parallel(pressed, len(phantoms.phantoms), jobs)


def _true_values(stated: Array, std: Array, number: int, rng: np.random.Generator) -> Array:
    """Return the parameters [9] of a phantom: as stated but for tolerances, of one of two surfaces, off its middle."""
    middle, half = box_of(OF_PATIENTS)
    missed = std * np.clip(rng.standard_normal(len(stated)), -2, 2)
    values = denormalise(np.clip(stated + missed, middle - half, middle + half))
    for name, ends in SURFACES.items():
        values[PARAMETERS.index(name)] = ends[number % 2] * (1 + 0.03 * rng.standard_normal())
    values[PARAMETERS.index("offset_mm")] = min(float(np.hypot(*(PHANTOM_OFFSET_MM * rng.standard_normal(2)))), 2.0)
    return values


def _seen(
    tables: ProbeTables, parameters: Array, worlds: Sequence[World], noise: PressNoise, rng: np.random.Generator
) -> SeenPresses:
    """Return what is read of presses with one reference, of parameters [N, 9] each in its world, with noise."""
    direction_rad = rng.uniform(0, 2 * np.pi, len(parameters))
    rings = [
        PressedScene(tables, world=world).press(at, float(angle))
        for at, world, angle in zip(parameters, worlds, direction_rad, strict=True)
    ]
    return seen_presses(rings, direction_rad, noise, rng)


def seen_presses(
    rings: Sequence[PressedRings], direction_rad: Array, noise: PressNoise, rng: np.random.Generator
) -> SeenPresses:
    """Return what is read of presses with one reference whose inclusions lie in directions [N], with noise."""
    columns = np.array([seen_columns(one, float(angle)) for one, angle in zip(rings, direction_rad, strict=True)])
    columns[1:, RESPONSE] = columns[0, RESPONSE]
    return to_bright_side(seen_with_noise(columns, noise, rng), direction_rad)


def seen_columns(pressed: PressedRings, direction_rad: float) -> Array:
    """Return all that is seen of one press [S], along its inclusion's direction in the image."""
    across = [part.ravel() for part in harmonics_along(pressed.rings, direction_rad, across=True)]
    return np.concatenate([pressed.as_row(direction_rad), *across])
