"""Faces under the loads of a protocol to what a sensor sees of them: contrast on rings, and how it changes.

The contrast is light over that of the press without the inclusion, minus 1. What the elements make of a moved mesh is
alike in both presses and drops out of it; of the press without the inclusion, nothing is kept that size or depth would
change.

An image model takes a face's deformation and pressure to light on rings: traced light, or an ideal sensor's. Traced
light is that of the virtual probe before its lens; lenses and fixed patterns drop out of a contrast. Pressures are
taken as means over 1 mm first: inside an element they ring, their forces do not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np

from device.files.shipped import SIMULATED_PROBE
from device.measurement.arrays import Array
from device.measurement.quantities import UNKNOWNS
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.skin import Skin
from host_tools.cramer_rao.protocol import Observable
from host_tools.cramer_rao.rings import Rings, mean_between
from host_tools.forward.derivatives.mesh_velocity import OFFSET
from host_tools.forward.derivatives.sensitive_presses import InclusionSensitivity
from host_tools.forward.derivatives.sensitivity import FORCE, FaceSensitivity
from host_tools.forward.face_state import Rays

WINDOW_RATIO = 0.9
"""The central window over the face."""
SMOOTH_MM = 1.0
FADE_MM = 0.5
"""Length over which the deformation fades beyond the rim."""
STEP_RATIO = 0.05
"""Of the mean pressure, in differences: small for the law of contact, large for single precision."""
SKIN_STEP = 0.02
"""Of the logarithm of a quantity of the skin."""
SKIN = ("contact_pressure_kpa", "albedo", "spread_mm")
"""What differs from skin to skin (`device/measurement/parameters.py`): law of contact, and light in it."""
HARMONICS = 4
"""The mean and cos(angle) to cos(3 angle); the inclusion lies at angle 0."""
ALL_LEDS = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True, eq=False)
class ObservedPress:
    """One press as a sensor sees it, on K rings: M harmonics of the contrast, one after the other, and the light.

    `contrast` [M K] and its derivatives by the logarithm of each quantity; `by_force_error` by that of the press's
    force alone, its reference left as it is. `light` and `reference` [K]: ring means, with the inclusion and without
    it; `reference_derivatives` [K]: of the logarithm of the reference, by what it depends on.
    """

    force_n: float
    contrast: Array
    derivatives: Mapping[str, Array]
    by_force_error: Array
    light: Array
    reference: Array
    reference_derivatives: Mapping[str, Array]

    @property
    def harmonics(self) -> int:
        """How many harmonics of the angle are seen; 1 in axisymmetry."""
        return len(self.contrast) // len(self.light)

    @property
    def ratio(self) -> Array:
        """Light over reference [M K]: the contrast, and 1 more in the mean."""
        ratio = self.contrast.copy()
        ratio[: len(self.light)] += 1
        return ratio


def rings_of(presses: Sequence[InclusionSensitivity]) -> Rings:
    """Return the rings that faces are seen on: those of the central window."""
    return Rings.within(WINDOW_RATIO * float(presses[0].rays.r_mm[0, -1]))


def observed_presses(presses: Sequence[InclusionSensitivity], observable: Observable) -> list[ObservedPress]:
    """Return what a sensor sees of every press; the scalars are those of the image."""
    rings = rings_of(presses)
    return [_observed(press, _image_model(press.rays, rings, observable), len(rings.r_mm)) for press in presses]


def _image_model(rays: Rays, rings: Rings, observable: Observable) -> ImageModel:
    if observable in ("image", "scalars"):
        return LightImageModel(rays, rings)
    return IdealImageModel(rays, rings, observable)


def _observed(press: InclusionSensitivity, image: ImageModel, rings: int) -> ObservedPress:
    """Return the contrast (light - reference) / mean reference; the reference has harmonics by its mesh only."""
    light, changes = _seen(press.pressed, image)
    reference, reference_changes = _seen(press.baseline, image)
    repeated = len(light) // rings

    def of_mean(values: Array) -> Array:
        return np.tile(values[:rings], repeated)

    mean, unchanged = of_mean(reference), np.zeros_like(light)
    contrast = (light - reference) / mean
    derivatives = {}
    for name, change in changes.items():
        further = reference_changes.get(name, unchanged)
        derivatives[name] = (change - further - contrast * of_mean(further)) / mean
    of_mesh_alone = (*UNKNOWNS, OFFSET)
    growing = {name: (c / mean)[:rings] for name, c in reference_changes.items() if name not in of_mesh_alone}
    return ObservedPress(
        press.force_n, contrast, derivatives, changes[FORCE] / mean, light[:rings], reference[:rings], growing
    )


def _seen(found: FaceSensitivity, image: ImageModel) -> tuple[Array, dict[str, Array]]:
    """Return the light of a face and its derivatives by name."""
    face = Profiles(found.face.w_mm, found.face.p_kpa)
    changes = {name: image.change(face, Profiles(rate.w_mm, rate.p_kpa)) for name, rate in found.rates.items()}
    return image.light(face), changes | image.changes_by_skin(face)


class Profiles(NamedTuple):
    """Deformation (mm) and contact pressure (kPa) of a face, or their changes, along its rays [A, R]."""

    w_mm: Array
    p_kpa: Array


class ImageModel(Protocol):
    """What a sensor sees on K rings, in a unit of its own: M harmonics of the angle, one after the other [M K]."""

    def light(self, face: Profiles) -> Array:
        """Return the light."""

    def change(self, face: Profiles, change: Profiles) -> Array:
        """Return the derivative of the light along a change of the face."""

    def changes_by_skin(self, face: Profiles) -> dict[str, Array]:
        """Return the derivatives of the light by the logarithm of each quantity of `SKIN`."""


class IdealImageModel:
    """Light in proportion to the pressure or the displacement itself."""

    def __init__(self, rays: Rays, rings: Rings, quantity: str) -> None:
        self._rings, self._r_mm, self._shows_pressure = rings, rays.r_mm[0], quantity == "pressure"
        self._cosines = _cosines(rays.angle_rad, harmonics(rays)) / len(rays.angle_rad)

    def light(self, face: Profiles) -> Array:
        """See `ImageModel`."""
        field = smooth(self._r_mm, face.p_kpa) if self._shows_pressure else face.w_mm
        return self._rings.of_profile(self._r_mm, self._cosines @ field).ravel()

    def change(self, face: Profiles, change: Profiles) -> Array:
        """See `ImageModel`: it is linear."""
        return self.light(change)

    def changes_by_skin(self, face: Profiles) -> dict[str, Array]:
        """See `ImageModel`: no skin comes in."""
        return {name: np.zeros(len(self._cosines) * len(self._rings.r_mm)) for name in SKIN}


class LightImageModel:
    """Light that the touched skin gives back, as the virtual probe's camera has it before the lens."""

    def __init__(self, rays: Rays, rings: Rings) -> None:
        self._rings, self._optics, self._skin = rings, _optics(), Skin()
        self._r_mm = rays.r_mm[0]
        x_mm, y_mm = (axis.astype(float) for axis in np.meshgrid(self._optics.x_mm, self._optics.y_mm))
        self._from_axis_mm, angle_rad = np.hypot(x_mm, y_mm), np.arctan2(y_mm, x_mm)
        self._cosines = _cosines(angle_rad, harmonics(rays))
        self._from_rays = _BetweenRays(rays, self._from_axis_mm, angle_rad)
        beyond_mm = np.maximum(self._from_axis_mm - self._r_mm[-1], 0.0)
        self._fade, self._inside = np.exp(-beyond_mm / FADE_MM), beyond_mm == 0

    def light(self, face: Profiles) -> Array:
        """See `ImageModel`; 1/(sr mm2) per unit of LED light."""
        return self._seen(face, self._skin)

    def change(self, face: Profiles, change: Profiles) -> Array:
        """See `ImageModel`: by central differences, of the pressure alone.

        Deformation changes the light by a hundredth of what pressure does (docs/optics.md), which cannot be told from
        the noise of the traced table along its depths: counted, it makes bounds up to two times smaller, and those of
        both orders differ.
        """
        window = self._r_mm <= self._rings.edges_mm[-1]
        largest = float(np.abs(change.p_kpa[:, window]).max() / face.p_kpa[:, window].mean())
        if largest == 0.0:
            return np.zeros(len(self._cosines) * len(self._rings.r_mm))
        step = STEP_RATIO / largest
        more, less = (Profiles(face.w_mm, face.p_kpa + s * change.p_kpa) for s in (step, -step))
        return (self.light(more) - self.light(less)) / (2 * step)

    def changes_by_skin(self, face: Profiles) -> dict[str, Array]:
        """See `ImageModel`: by central differences."""
        changes = {}
        for name in SKIN:
            nominal, factors = getattr(self._skin, name), np.exp([SKIN_STEP, -SKIN_STEP]).tolist()
            skins = [replace(self._skin, **{name: nominal * factor}) for factor in factors]
            more, less = (self._seen(face, skin) for skin in skins)
            changes[name] = (more - less) / (2 * SKIN_STEP)
        return changes

    def _seen(self, face: Profiles, skin: Skin) -> Array:
        w_mm = self._from_rays(face.w_mm) * self._fade
        p_kpa = self._from_rays(np.maximum(smooth(self._r_mm, face.p_kpa), 0.0)) * self._inside
        radiance = self._optics.radiance(w_mm.astype(np.float32), p_kpa.astype(np.float32), ALL_LEDS, skin)
        return np.concatenate([self._rings.of_map(self._from_axis_mm, radiance * cosine) for cosine in self._cosines])


class _BetweenRays:
    """Linear interpolation, between rays at even angles and their samples, to the points of a grid."""

    def __init__(self, rays: Rays, from_axis_mm: Array, angle_rad: Array) -> None:
        count, r_mm = rays.r_mm.shape[0], rays.r_mm[0]
        turn = (angle_rad / (2 * np.pi)) % 1 * count
        outward = np.clip(from_axis_mm / (r_mm[1] - r_mm[0]), 0, len(r_mm) - 1)
        self._ray = turn.astype(int) % count
        self._next_ray = (self._ray + 1) % count
        self._low = np.minimum(outward.astype(int), len(r_mm) - 2)
        self._turn, self._outward = turn - turn.astype(int), outward - self._low

    def __call__(self, field: Array) -> Array:
        """Return a field [A, R] at the points; beyond the rim it is that of the rim."""
        along = [
            field[ray, self._low] * (1 - self._outward) + field[ray, self._low + 1] * self._outward
            for ray in (self._ray, self._next_ray)
        ]
        return np.asarray(along[0] * (1 - self._turn) + along[1] * self._turn)


def harmonics(rays: Rays) -> int:
    """Return how many harmonics of the angle are looked at: only the mean of a face that is the same all round."""
    return 1 if len(rays.angle_rad) == 1 else HARMONICS


def _cosines(angle_rad: Array, count: int) -> Array:
    """Return 1, 2 cos(angle), 2 cos(2 angle) ...: their means with a field are its harmonics."""
    return np.stack([np.cos(m * angle_rad) * (2 if m else 1) for m in range(count)])


def smooth(r_mm: Array, p_kpa: Array) -> Array:
    """Return mean pressures [..., R] over the ring `SMOOTH_MM` wide around each radius, cut at axis and rim."""
    inner_mm, outer_mm = np.maximum(r_mm - SMOOTH_MM / 2, 0.0), np.minimum(r_mm + SMOOTH_MM / 2, r_mm[-1])
    return mean_between(r_mm, p_kpa, inner_mm, outer_mm)


@lru_cache(maxsize=1)
def _optics() -> LookupOptics:
    return LookupOptics.load(SIMULATED_PROBE)
