"""Faces under the loads of a protocol to what is seen of them: contrast on rings, and how it changes.

The contrast is light over that of the press without the lump, minus 1. What the elements make of a moved mesh is alike
in both presses and drops out of it; of the press without the lump, nothing is kept that size or depth would change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from device.measurement.quantities import UNKNOWNS
from host_tools.forward.face_state import Rays
from host_tools.forward.mesh_velocity import OFFSET
from host_tools.forward.sensitive_ramp import LumpSensitivity
from host_tools.forward.sensitivity import FORCE, FaceSensitivity
from host_tools.inverse.pictures import IdealPicture, LightPicture, Picture, Profiles
from host_tools.inverse.protocol import Observable
from host_tools.inverse.rings import Array, Rings

WINDOW_RATIO = 0.9
"""The central window over the face."""


@dataclass(frozen=True, eq=False)
class Sight:
    """One press as a sensor sees it, on K rings: M harmonics of the contrast, one after the other, and the light.

    `contrast` [M K] and its derivatives by the logarithm of each quantity; `by_force_error` by that of the press's
    force alone, its reference left as it is. `light` and `reference` [K]: ring means, with the lump and without it;
    `reference_derivatives` [K]: of the logarithm of the reference, by what it depends on.
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


def rings_of(presses: Sequence[LumpSensitivity]) -> Rings:
    """Return the rings that faces are seen on: those of the central window."""
    return Rings.within(WINDOW_RATIO * float(presses[0].rays.r_mm[0, -1]))


def sights(presses: Sequence[LumpSensitivity], observable: Observable) -> list[Sight]:
    """Return what a sensor sees of every press; the scalars are those of the image."""
    rings = rings_of(presses)
    return [_sight(press, _picture(press.rays, rings, observable), len(rings.r_mm)) for press in presses]


def _picture(rays: Rays, rings: Rings, observable: Observable) -> Picture:
    if observable in ("image", "scalars"):
        return LightPicture(rays, rings)
    return IdealPicture(rays, rings, observable)


def _sight(press: LumpSensitivity, picture: Picture, rings: int) -> Sight:
    """Return the contrast (light - reference) / mean reference; the reference has harmonics by its mesh only."""
    light, changes = _seen(press.pressed, picture)
    reference, reference_changes = _seen(press.bare, picture)
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
    return Sight(press.force_n, contrast, derivatives, changes[FORCE] / mean, light[:rings], reference[:rings], growing)


def _seen(found: FaceSensitivity, picture: Picture) -> tuple[Array, dict[str, Array]]:
    """Return the light of a face and its derivatives by name."""
    face = Profiles(found.face.w_mm, found.face.p_kpa)
    changes = {name: picture.change(face, Profiles(rate.w_mm, rate.p_kpa)) for name, rate in found.rates.items()}
    return picture.light(face), changes | picture.changes_by_skin(face)
