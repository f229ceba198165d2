"""Random presses of the virtual probe without camera noise: unknowns and nuisances to rows of the press profile.

What the surrogate learns from. Light comes from the probe's own tables and optics, on pixels as coarse as the profile
bins them; forces are exactly the profile's, so nothing is fitted. One inclusion-free press serves several inclusions.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from joblib import Parallel, delayed

from device.measurement.arrays import Array
from device.measurement.parameters import NUISANCES, PARAMETERS, denormalise
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N, harmonic, second_harmonic
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.ring_means import RingMeans, ring_weights
from device.measurement.recording.tactile_image import Image
from device.simulation.hand import BESIDE_MM
from device.simulation.physics.image_formation import ScatteredImage
from device.simulation.physics.lens import Lens
from device.simulation.physics.pressed_face import PressedFace, ProbePlacement
from device.simulation.physics.skin import Skin
from device.simulation.physics.slab import Slab
from device.simulation.physics.surface_table import PressRamps
from device.simulation.virtual_probe import ProbeTables

SHAPE, SCALE = (164, 192), PixelScale(0.125, 0.10938)
"""The probe's frame in pixels of the profile's binning: it cuts the outermost ring at top and bottom."""
LENS = Lens(blur_px=0.2)
LIT = (0.6, 0.6, 0.6, 0.6)
INCLUSIONS_A_SKIN = 3
"""Inclusions that are pressed on one tissue and skin: their inclusion-free press is made once."""
CHUNK = 24
NEAREST_MM = 1.0
"""An inclusion ends at least this far above the slab's base."""


class Draw(Protocol):
    """How parameters [count, 9] are drawn, consecutive ones on one tissue and skin."""

    def __call__(self, count: int, rng: np.random.Generator, *, inclusions_a_skin: int = 1) -> Array:
        """Return them."""


@dataclass(frozen=True, eq=False)
class PressSamples:
    """Parameters [n, 9] in the order of `PARAMETERS`, rows [n, P] in that of `radial_profile.ROW_NAMES`.

    `second_harmonics` [n, Q]: of the contrast, along the offset, of all forces and all rings but the two at the ends.
    """

    parameters: Array
    rows: Array
    second_harmonics: Array

    def split(self, count: int) -> tuple[PressSamples, PressSamples]:
        """Return the first `count` presses and the others."""
        return self._part(slice(0, count)), self._part(slice(count, None))

    def _part(self, of: slice) -> PressSamples:
        return PressSamples(self.parameters[of], self.rows[of], self.second_harmonics[of])


def draw_parameters(count: int, rng: np.random.Generator, *, inclusions_a_skin: int = 1) -> Array:
    """Return parameters [count, 9], even over their ranges; the offset is even over its disk.

    Consecutive `inclusions_a_skin` rows share tissue and skin. Inclusions that would touch the slab's base are drawn
    again.
    """
    unknowns = len(PARAMETERS) - len(NUISANCES)
    normalised = rng.uniform(-1, 1, (count, len(PARAMETERS)))
    normalised[:, unknowns:] = np.repeat(normalised[::inclusions_a_skin, unknowns:], inclusions_a_skin, axis=0)[:count]
    normalised[:, -1] = 2 * np.sqrt(rng.uniform(0, 1, count)) - 1
    values = denormalise(normalised)
    while (buried := values[:, 0] + values[:, 1] > values[:, PARAMETERS.index("slab_thickness_mm")] - NEAREST_MM).any():
        normalised[buried, :2] = rng.uniform(-1, 1, (buried.sum(), 2))
        values = denormalise(normalised)
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
    parameters = draw(count, np.random.default_rng(seed), inclusions_a_skin=INCLUSIONS_A_SKIN)
    parts = np.split(parameters, range(CHUNK * INCLUSIONS_A_SKIN, count, CHUNK * INCLUSIONS_A_SKIN))
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    pressed = []
    for part in Parallel(n_jobs=jobs, return_as="generator")(delayed(exact_presses)(tables, p) for p in parts):
        pressed.append(part)
        on_done(len(part[0]))
    rows, second_harmonics = zip(*pressed, strict=True)
    return PressSamples(parameters, np.concatenate(rows), np.concatenate(second_harmonics))


def profile_rows(
    tables: ProbeTables, parameters: Array, *, ramps: PressRamps | None = None, span_ratio: float = 1.0
) -> Array:
    """Return the profile rows [n, P] of presses without noise, for parameters [n, 9].

    `ramps` are those of an inclusion that the tables do not hold, on the axis. `span_ratio`: true force over what the
    cell says.
    """
    return exact_presses(tables, parameters, ramps=ramps, span_ratio=span_ratio)[0]


def exact_presses(
    tables: ProbeTables, parameters: Array, *, ramps: PressRamps | None = None, span_ratio: float = 1.0
) -> tuple[Array, Array]:
    """Return profile rows [n, P] and second harmonics [n, Q] along the offset; as `profile_rows`."""
    scene = _Scene(tables, ramps, span_ratio)
    pressed = [scene.press(dict(zip(PARAMETERS, map(float, values), strict=True))) for values in parameters]
    rows, second_harmonics = zip(*pressed, strict=True)
    return np.array(rows), np.array(second_harmonics)


class _Scene:
    """Presses inclusions on one tissue and skin after the other; remembers the inclusion-free press of the last."""

    def __init__(self, tables: ProbeTables, ramps: PressRamps | None, span_ratio: float) -> None:
        self._tables, self._ramps, self._weights = tables, ramps, ring_weights(SHAPE, SCALE)
        self._forces_n = span_ratio * PROFILE_FORCES_N
        self._valid = np.ones(SHAPE, dtype=bool)
        self._skin: Skin | None = None
        self._slab: Slab | None = None

    def press(self, at: dict[str, float]) -> tuple[Array, Array]:
        skin = Skin(albedo=at["albedo"], spread_mm=at["spread_mm"], contact_pressure_kpa=at["contact_pressure_kpa"])
        slab = Slab(at["tissue_modulus_kpa"], at["slab_thickness_mm"])
        inclusion = Inclusion(at["size_mm"], at["depth_mm"], at["youngs_modulus_kpa"])
        if (skin, slab) != (self._skin, self._slab):
            self._skin, self._slab = skin, slab
            self._image = ScatteredImage(self._tables.light, skin, LENS, SHAPE, SCALE)
            self._baseline = self._lights(inclusion, ProbePlacement(*BESIDE_MM))
            baseline = np.array([self._means(light).mean for light in self._baseline])
            self._reference_response = np.log(baseline[:-1] / baseline[-1])
        lights = self._lights(inclusion, ProbePlacement(x_mm=at["offset_mm"]))
        rings = [
            self._means(light / baseline - np.float32(1))
            for light, baseline in zip(lights, self._baseline, strict=True)
        ]
        stacked = RingMeans(*(np.array(part) for part in zip(*rings, strict=True)))
        row = np.concatenate([stacked.mean.ravel(), self._reference_response.ravel(), harmonic(stacked, 1)])
        return row, second_harmonic(stacked)[0].ravel()

    def _lights(self, inclusion: Inclusion, place: ProbePlacement) -> list[Image]:
        assert self._slab is not None  # press has set it
        ramps = self._ramps or self._tables.centred.ramps(inclusion, self._slab)
        face = PressedFace(ramps, self._tables.off_axis, inclusion, self._image.x_mm, self._image.y_mm, self._slab)
        return [self._image.intensity(*face.at(float(force), place), LIT) for force in self._forces_n]

    def _means(self, image: Image) -> RingMeans:
        return self._weights.means(image, self._valid)
