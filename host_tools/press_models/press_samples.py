"""Random presses of the virtual probe without camera noise: unknowns and nuisances to rows of the press profile.

What the surrogate learns from. Light comes from the probe's own tables and optics, on pixels as coarse as the profile
bins them; forces are exactly the profile's, so nothing is fitted. One inclusion-free press serves several inclusions.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from joblib import Parallel, delayed

from device.measurement.arrays import Array
from device.measurement.parameters import HIGH, PARAMETERS, RANGES, Range, box_of, denormalise, is_possible
from device.measurement.quantities import UNKNOWNS, Inclusion, InvalidQuantity
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N, first_harmonic, second_harmonic
from device.measurement.ramp_modes.surrogate import OFFSET
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.ring_means import RingMeans, ring_weights
from device.measurement.recording.tactile_image import Image
from device.simulation.hand import BESIDE_MM
from device.simulation.physics.image_formation import ScatteredImage
from device.simulation.physics.layer_table import DepthRatios
from device.simulation.physics.lens import Lens
from device.simulation.physics.pressed_face import PressedFace, ProbePlacement
from device.simulation.physics.skin import Skin
from device.simulation.physics.slab import Slab
from device.simulation.physics.surface_table import PressRamps
from device.simulation.physics.world import AS_BELIEVED, World
from device.simulation.physics.world_face import WorldFace
from device.simulation.virtual_probe import ProbeTables

SHAPE, SCALE = (164, 192), PixelScale(0.125, 0.10938)
"""The probe's frame in pixels of the profile's binning: it cuts the outermost ring at top and bottom."""
LENS = Lens(blur_px=0.2)
LIT = (0.6, 0.6, 0.6, 0.6)
INCLUSIONS_A_SKIN = 3
"""Inclusions that are pressed on one tissue and skin: their inclusion-free press is made once."""
CHUNK = 24
BESIDE_TO_MM = 8.0
"""Largest offset of a press of a scan: three millimetres from the rim of the face."""
MOST_DRAWS = 1000
"""So often tissue is drawn again for inclusions that are told, before they are refused."""


class Draw(Protocol):
    """How parameters [count, 9] are drawn, consecutive ones on one tissue and skin."""

    def __call__(self, count: int, rng: np.random.Generator, *, inclusions_a_skin: int = 1) -> Array:
        """Return them."""


@dataclass(frozen=True, eq=False)
class PressSamples:
    """Parameters [n, 9] in the order of `PARAMETERS`, rows [n, P] of the profile, directions [n] of the inclusion."""

    parameters: Array
    rows: Array
    direction_rad: Array

    def split(self, count: int) -> tuple[PressSamples, PressSamples]:
        """Return the first `count` presses and the others."""
        return self._part(slice(0, count)), self._part(slice(count, None))

    def _part(self, of: slice) -> PressSamples:
        return PressSamples(self.parameters[of], self.rows[of], self.direction_rad[of])


def draw_parameters(
    count: int, rng: np.random.Generator, *, inclusions_a_skin: int = 1, ranges: dict[str, Range] = RANGES
) -> Array:
    """Return parameters [count, 9], even over ranges; the offset is even over its disk.

    Consecutive `inclusions_a_skin` rows share tissue and skin. What is not possible is drawn again: all of it, or the
    inclusion alone where others share its tissue.
    """
    unknowns, (middle, half) = len(UNKNOWNS), box_of(ranges)
    drawn_again = slice(0, unknowns) if inclusions_a_skin > 1 else slice(0, OFFSET)
    at = rng.uniform(-1, 1, (count, len(PARAMETERS)))
    at[:, unknowns:] = np.repeat(at[::inclusions_a_skin, unknowns:], inclusions_a_skin, axis=0)[:count]
    at[:, OFFSET] = 2 * np.sqrt(rng.uniform(0, 1, count)) - 1
    values = denormalise(middle + half * at)
    while (impossible := ~is_possible(values)).any():
        at[impossible, drawn_again] = rng.uniform(-1, 1, (int(impossible.sum()), drawn_again.stop))
        values = denormalise(middle + half * at)
    return values


def draw_around(inclusions: Array, rng: np.random.Generator, *, ranges: dict[str, Range] = RANGES) -> Array:
    """Return parameters [n, 9] of inclusions [n, 3] in tissue and under skins that are drawn, where that is possible.

    Raises `InvalidQuantity` for one that is possible in no tissue of the ranges.
    """
    parameters = draw_parameters(len(inclusions), rng, ranges=ranges)
    parameters[:, : len(UNKNOWNS)] = inclusions
    for _ in range(MOST_DRAWS):
        if not (impossible := ~is_possible(parameters)).any():
            return parameters
        again = draw_parameters(int(impossible.sum()), rng, ranges=ranges)
        parameters[impossible, len(UNKNOWNS) :] = again[:, len(UNKNOWNS) :]
    size_mm, depth_mm, modulus_kpa = parameters[impossible][0, : len(UNKNOWNS)]
    stated = f"{size_mm:.3g} mm, {depth_mm:.3g} mm deep, {modulus_kpa:.3g} kPa"
    raise InvalidQuantity("inclusion", stated, "possible in some tissue of the ranges", "choose another")


def draw_beside(
    count: int, rng: np.random.Generator, *, inclusions_a_skin: int = 1, ranges: dict[str, Range] = RANGES
) -> Array:
    """Return the same [count, 9], but for offsets that are even from where those of one press end to `BESIDE_TO_MM`."""
    values = draw_parameters(count, rng, inclusions_a_skin=inclusions_a_skin, ranges=ranges)
    values[:, OFFSET] = rng.uniform(HIGH[OFFSET], BESIDE_TO_MM, count)
    return values


def sample_presses(
    tables: ProbeTables,
    count: int,
    *,
    seed: int,
    draw: Draw = draw_parameters,
    jobs: int = -1,
    on_done: Callable[[int], None] = lambda done: None,
) -> PressSamples:
    """Return `count` random presses; the same seed gives the same ones whatever `jobs` (-1: all cores)."""
    rng = np.random.default_rng(seed)
    parameters = draw(count, rng, inclusions_a_skin=INCLUSIONS_A_SKIN)
    direction_rad = rng.uniform(0, 2 * np.pi, count)
    ends = range(CHUNK * INCLUSIONS_A_SKIN, count, CHUNK * INCLUSIONS_A_SKIN)
    parts = zip(np.split(parameters, ends), np.split(direction_rad, ends), strict=True)
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    pressed = []
    for part in Parallel(n_jobs=jobs, return_as="generator")(delayed(profile_rows)(tables, *p) for p in parts):
        pressed.append(part)
        on_done(len(part))
    return PressSamples(parameters, np.concatenate(pressed), direction_rad)


def profile_rows(
    tables: ProbeTables,
    parameters: Array,
    direction_rad: Array | None = None,
    *,
    ramps: PressRamps | None = None,
    span_ratio: float = 1.0,
    reference_span_ratio: float | None = None,
    world: World = AS_BELIEVED,
) -> Array:
    """Return the profile rows [n, P] of presses without noise, for parameters [n, 9].

    The inclusion lies in directions [n] of the image, along its rows unless they are told. `ramps` are those of an
    inclusion that the tables do not hold, on the axis. `span_ratio`: true force over what the cell says;
    `reference_span_ratio`: the same of the reference press, where it is another. `world` is what probe and presses
    truly are.
    """
    scene = PressedScene(tables, ramps, span_ratio, reference_span_ratio, world)
    directions = np.zeros(len(parameters)) if direction_rad is None else direction_rad
    return np.array([
        scene.press(values, float(direction)).as_row()
        for values, direction in zip(parameters, directions, strict=True)
    ])  # fmt: skip


class PressedRings(NamedTuple):
    """Ring means of the contrast [K, J], with harmonics, at the profile's forces, and the reference response."""

    rings: RingMeans
    reference_response: Array

    def as_row(self, direction_rad: float | None = None) -> Array:
        """Return them as a profile row [P], harmonics along the bright side unless a direction is told."""
        first, second = (
            (first_harmonic(self.rings), second_harmonic(self.rings)[0])
            if direction_rad is None
            else harmonics_along(self.rings, direction_rad)
        )
        parts = self.rings.mean, self.reference_response, first, second
        return np.concatenate([part.ravel() for part in parts])


def harmonics_along(rings: RingMeans, direction_rad: float, *, across: bool = False) -> tuple[Array, Array]:
    """Return first [K, J - 1] and second harmonic [K, J - 2] of ring means along a direction, or across it.

    As a row has them.
    """
    quarter = np.pi / 2 if across else 0.0
    first, second = (
        rings.cosine[:, order - 1] * np.cos(order * direction_rad + quarter)
        + rings.sine[:, order - 1] * np.sin(order * direction_rad + quarter)
        for order in (1, 2)
    )
    return first[:, 1:], second[:, 1:-1]


class PressedScene:
    """Presses inclusions on one tissue and skin after the other; remembers the inclusion-free press of the last."""

    def __init__(
        self,
        tables: ProbeTables,
        ramps: PressRamps | None = None,
        span_ratio: float = 1.0,
        reference_span_ratio: float | None = None,
        world: World = AS_BELIEVED,
        reference_ramps: PressRamps | None = None,
    ) -> None:
        """Take the ramps of what the tables do not hold, and those of the reference press, where they are others."""
        self._tables, self._ramps, self._weights = tables, ramps, ring_weights(SHAPE, SCALE)
        self._reference_ramps = reference_ramps or ramps
        of_reference = span_ratio if reference_span_ratio is None else reference_span_ratio
        said_n = PROFILE_FORCES_N / world.cell_span_ratio
        self._forces_n, self._reference_n, self._world = span_ratio * said_n, of_reference * said_n, world
        self._valid = np.ones(SHAPE, dtype=bool)
        self._skin: Skin | None = None
        self._slab: Slab | None = None

    def press(self, parameters: Array, direction_rad: float) -> PressedRings:
        """Return what the camera sees of a press with parameters [9], the inclusion in a direction of the image."""
        at = dict(zip(PARAMETERS, map(float, parameters), strict=True))
        skin = Skin(albedo=at["albedo"], spread_mm=at["spread_mm"], contact_pressure_kpa=at["contact_pressure_kpa"])
        slab = Slab(at["tissue_modulus_kpa"], at["slab_thickness_mm"])
        inclusion = Inclusion(at["size_mm"], at["depth_mm"], at["youngs_modulus_kpa"])
        if (skin, slab) != (self._skin, self._slab):
            self._skin, self._slab = skin, slab
            self._image = ScatteredImage(self._tables.light, skin, LENS, SHAPE, SCALE, self._world)
            beside = ProbePlacement(*BESIDE_MM)
            self._baseline = self._lights(inclusion, beside, self._reference_n, self._reference_ramps)
            baseline = np.array([self._means(light).mean for light in self._baseline])
            self._reference_response = np.log(baseline[:-1] / baseline[-1])
        # The probe stands on the other side of the inclusion than the inclusion in the image.
        away = -at["offset_mm"] * np.array([np.cos(direction_rad), np.sin(direction_rad)])
        lights = self._lights(inclusion, ProbePlacement(*map(float, away)), self._forces_n, self._ramps)
        rings = [
            self._means(light / baseline - np.float32(1))
            for light, baseline in zip(lights, self._baseline, strict=True)
        ]
        stacked = RingMeans(*(np.array(part) for part in zip(*rings, strict=True)))
        return PressedRings(stacked, self._reference_response)

    def _lights(
        self, inclusion: Inclusion, place: ProbePlacement, forces_n: Array, solved: PressRamps | None
    ) -> list[Image]:
        assert self._slab is not None  # press has set it
        face = WorldFace(self._world, self._slab, lambda slab, ratios: self._face(inclusion, slab, ratios, solved))
        return [self._image.intensity(*face.at(float(force), place), LIT, place=place) for force in forces_n]

    def _face(
        self, inclusion: Inclusion, slab: Slab, depth_ratios: DepthRatios, solved: PressRamps | None
    ) -> PressedFace:
        ramps = self._tables.ramps(inclusion, slab, self._world, depth_ratios, solved=solved)
        return PressedFace(ramps, self._tables.off_axis, inclusion, self._image.x_mm, self._image.y_mm, slab)

    def _means(self, image: Image) -> RingMeans:
        return self._weights.means(image, self._valid)
