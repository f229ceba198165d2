"""Presses of one design of truths, whatever differs: a ramp, a scan of two, and a held press, with one draw of noise.

Truths, directions and noise depend on seed and number alone: what two causes make of the same presses differs by the
causes. Noise is as it is believed of the simulated probe. A held press is read at 0.5 N of the cubic through the ramp;
its camera noise is that of the ramp's largest force.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.parameters import Range
from device.measurement.quick_mode.profile import QuickPress
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.radial_profile import CONTRAST, SeenPresses
from device.measurement.ramp_modes.surrogate import OFFSET
from device.measurement.recording.ring_means import RINGS, RingMeans
from device.simulation.physics.world import World
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.phantom import TARGET_N
from host_tools.press_models.press_samples import PressedRings, PressedScene, draw_parameters
from host_tools.press_models.quick_training import (
    HarmonicNoise,
    HeldHarmonics,
    QuickPressSet,
    force_weights,
    quick_rows,
)
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed
from host_tools.scores.foreign_presses import FURTHER_MM, OF_PATIENTS, ForeignPresses, seen_presses

SCANS_IN_TEN = 3


class Setting(NamedTuple):
    """What a press is made with: tables of what is pressed, and what probe and press truly are."""

    tables: ProbeTables
    world: World


SettingsOf = Callable[[int, np.random.Generator], Sequence[Setting]]
"""Number of a press, and where its chance is from, to the settings of the first press and of the second of its scan."""


class TruthDesign(NamedTuple):
    """Parameters [n, 9] that answers ought to find, those [n, 9] that are pressed, and offsets of second presses [n].

    The first `scans` are pressed twice.
    """

    parameters: Array
    pressed: Array
    further_mm: Array
    scans: int
    seed: int


class TriedPresses(NamedTuple):
    """What is seen of single presses [n], of the first as scans of two [scans], and of the held presses [n]."""

    single: ForeignPresses
    scans: ForeignPresses
    held: list[QuickPress]


def scans_of(presses: int) -> int:
    """Return how many of so many presses are pressed twice: a scan takes three times as long to answer."""
    return max(presses * SCANS_IN_TEN // 10, 1)


def random_design(presses: int, scans: int, seed: int, *, ranges: dict[str, Range] = OF_PATIENTS) -> TruthDesign:
    """Return random truths over ranges, those of all patients unless given."""
    rng = np.random.default_rng(derived_seed(seed, "truths of one thing at a time"))
    parameters = draw_parameters(presses, rng, ranges=ranges)
    return TruthDesign(parameters, parameters, rng.uniform(*FURTHER_MM, presses), scans, seed)


def tried_presses(design: TruthDesign, settings_of: SettingsOf, noise: PressNoise, *, jobs: int = -1) -> TriedPresses:
    """Return the presses of a design in the settings of each."""
    of_noise, of_cause = (derived_seed(design.seed, f"{what} of one thing at a time") for what in ("noise", "chance"))

    def pressed(number: int) -> tuple[SeenPresses, QuickPress]:
        settings = settings_of(number, np.random.default_rng([of_cause, number]))
        return _pressed(design, number, settings, noise, np.random.default_rng([of_noise, number]))

    seen, held = zip(*in_parallel(pressed, len(design.parameters), jobs), strict=True)
    return TriedPresses(
        ForeignPresses(design.parameters, [_first(one) for one in seen]),
        ForeignPresses(design.parameters[: design.scans], list(seen[: design.scans])),
        list(held),
    )


def _pressed(
    design: TruthDesign, number: int, settings: Sequence[Setting], noise: PressNoise, rng: np.random.Generator
) -> tuple[SeenPresses, QuickPress]:
    direction_rad, of_held = rng.uniform(0, 2 * np.pi, 2), np.random.default_rng(rng.integers(2**63))
    count = 2 if number < design.scans else 1
    at = np.tile(design.pressed[number], (2, 1))
    at[1, OFFSET] = design.further_mm[number]
    scene = PressedScene(settings[0].tables, world=settings[0].world)
    rings = [scene.press(at[0], float(direction_rad[0]))]
    if count > 1:
        again = scene if _is_same(*settings) else PressedScene(settings[1].tables, world=settings[1].world)
        rings.append(again.press(at[1], float(direction_rad[1])))
    seen = seen_presses(rings, direction_rad[:count], noise, rng)
    return seen, held_press(rings[0], noise, of_held)


def _is_same(first: Setting, second: Setting) -> bool:
    return first.tables is second.tables and first.world == second.world


def _first(seen: SeenPresses) -> SeenPresses:
    """Return the first press of a scan alone."""
    return SeenPresses(*(part[:1] for part in seen if part is not None))


def held_press(
    pressed: PressedRings, noise: PressNoise, rng: np.random.Generator, camera: Array | None = None
) -> QuickPress:
    """Return what mode quick reads of a press that is held at 0.5 N, with noise.

    `camera` [11, 11] is the covariance of the camera's noise, that of the ramp's largest force unless given.
    """
    force_n = np.array([TARGET_N])
    exact = quick_rows(pressed.as_row()[None], force_n)
    camera = noise.camera[CONTRAST, CONTRAST][-RINGS:, -RINGS:] if camera is None else camera
    held = QuickPressSet(np.zeros((1, 1), np.float32), exact.astype(np.float32), camera, noise.levels)
    (weights,) = force_weights(force_n)
    rings = RingMeans(*(np.tensordot(weights, part, 1)[None] for part in pressed.rings))
    row = held.noisy(np.zeros(1, np.intp), rng)[0].astype(np.float64)
    first, second = (np.stack([rings.cosine[:, at, 1:], rings.sine[:, at, 1:]], axis=1) for at in (0, 1))
    seen = HarmonicNoise(noise, camera).add(HeldHarmonics(first, second[:, :, :-1]), exact[:, :RINGS], rng)
    return QuickPress(row, float(seen.elongation_ratios()[0]))
