"""The scenes the light is studied in, by name: what touches the block, and how its face is bent.

Dimples are Gaussian, since their slope is known: depth / width * exp(-1/2) at most. The skin's contact is that of a
round face of radius 11 mm. A scene is traced once and shared by all chapters. Source: this project.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from math import atan, degrees, exp

import numpy as np

from device.measurement.arrays import Array
from device.simulation.physics.skin import Skin
from host_tools.optics.traced import Traced, TracedFace
from host_tools.optics.tracer import trace
from host_tools.scenes.light_block import LightBlock

FACE_RADIUS_MM = 11.0
CENTRE_RADIUS_MM = 1.5
WIDTH_MM, STEEP_WIDTH_MM = 3.0, 2.5
"""Standard deviations of the dimples, and of a steep one no press makes."""
DEPTHS_MM = (0.3, 0.8, 1.5)
STEEP_MM = 2.5
PRESS_KPA, INCLUSION_KPA = 1.3, 2.0
"""Mean pressure of a press with 0.5 N, and what a strong inclusion adds at its top."""
PRESSES = (0.5, 1.0, 2.0, 4.0)
"""Even pressures, in multiples of `PRESS_KPA`."""

GRID_MM = np.linspace(-12.0, 12.0, 161)
_X_MM, _Y_MM = np.meshgrid(GRID_MM, GRID_MM)
TOUCHED = np.hypot(_X_MM, _Y_MM) < FACE_RADIUS_MM


@dataclass(frozen=True)
class LitScene:
    """A face on a block, and the skin on the face."""

    face: TracedFace
    block: LightBlock = field(default_factory=LightBlock)
    skin: Skin = field(default_factory=Skin)


def bump(width_mm: float, at_mm: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Return a Gaussian of height 1 on the scenes' grid."""
    r2 = (_X_MM - at_mm[0]) ** 2 + (_Y_MM - at_mm[1]) ** 2
    return np.asarray(np.exp(-r2 / (2 * width_mm**2)))


def slope_deg(depth_mm: float, width_mm: float = WIDTH_MM) -> float:
    """Return the steepest slope of a Gaussian dimple."""
    return degrees(atan(depth_mm / width_mm * exp(-0.5)))


def face(
    depth_mm: float = 0.0, contact: Array | float = 0.0, *, width_mm: float = WIDTH_MM, dark: bool = False
) -> TracedFace:
    """Return a face with a central dimple; contact ratio only where the probe touches; `dark`: no skin over air."""
    touching = np.where(TOUCHED, contact, 0.0)
    return TracedFace(GRID_MM, GRID_MM, depth_mm * bump(width_mm), touching, skin_behind=not dark)


def pressed_contact(inclusion_kpa: float = 0.0) -> Array:
    """Return the contact ratio of a press with 0.5 N whose pressure an inclusion raises at the centre."""
    return Skin().contact_ratio(PRESS_KPA + inclusion_kpa * bump(WIDTH_MM)).astype(np.float64)


def _mechanisms() -> dict[str, LitScene]:
    faces = {
        "flat, untouched": face(),
        "flat, dark": face(dark=True),
        "flat, contact 0.3": face(contact=0.3),
        "flat, contact 1": face(contact=1.0),
        "flat, contact by pressure": face(contact=pressed_contact(INCLUSION_KPA)),
        "steep dimple, dark": face(STEEP_MM, width_mm=STEEP_WIDTH_MM, dark=True),
        "steep dimple, skin across air": face(STEEP_MM, width_mm=STEEP_WIDTH_MM),
    }
    for depth in DEPTHS_MM:
        faces[f"dimple {depth:g}, dark"] = face(depth, dark=True)
        faces[f"dimple {depth:g}, skin across air"] = face(depth)
        faces[f"dimple {depth:g}, contact 1"] = face(depth, 1.0)
        faces[f"dimple {depth:g}, contact by pressure"] = face(depth, pressed_contact(INCLUSION_KPA))
    faces |= {f"flat, even press x {presses:g}": face(contact=_even_contact(presses)) for presses in PRESSES}
    return {name: LitScene(one) for name, one in faces.items()}


def _even_contact(presses: float) -> float:
    return float(Skin().contact_ratio(np.array(PRESS_KPA * presses)))


MECHANISMS = _mechanisms()


@lru_cache(maxsize=128)
def traced(name: str, rays: int, seed: int = 1) -> Traced:
    """Return one of the `MECHANISMS` traced; the same rays and seed are traced once."""
    scene = MECHANISMS[name]
    return trace(scene.block, scene.face, scene.skin, rays=rays, seed=seed)


def centre(found: Traced) -> float:
    """Return the mean radiance of the middle of the face, 1/(sr mm2) per unit of LED light."""
    return _mean(found, CENTRE_RADIUS_MM)


def whole_face(found: Traced) -> float:
    """Return the mean radiance of the round face, 1/(sr mm2) per unit of LED light."""
    return _mean(found, FACE_RADIUS_MM)


def _mean(found: Traced, radius_mm: float) -> float:
    return float(found.radiance[radii_mm(found) < radius_mm].mean())


def radii_mm(found: Traced) -> Array:
    """Return the distance [ny, nx] of the image's cells from the axis."""
    return np.hypot(found.x_mm[None, :], found.y_mm[:, None])


def brightest(found: Traced) -> tuple[float, float]:
    """Return the largest radiance of the round face, and its distance (mm) from the axis."""
    r_mm = radii_mm(found)
    inside = np.where(r_mm < FACE_RADIUS_MM, found.radiance, 0.0)
    return float(inside.max()), float(r_mm.flat[inside.argmax()])
