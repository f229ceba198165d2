"""The light that LEDs cast straight onto the face, by an integral over their discs: the tracer's answer on paper.

A flat face wet all over with skin of the block's own index takes in whatever meets it, black walls return nothing,
and an almost black skin returns too little to matter twice; two terms are left, straight up and once by the bottom.
Source: radiance over squared index is conserved (Nicodemus, Appl. Opt. 2:767, 1963); Hecht, Optics, section 4.6.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Literal

import numpy as np

from device.measurement.arrays import Array
from device.simulation.physics.skin import Skin
from host_tools.optics.fresnel import plate_transmission, reflectance
from host_tools.optics.traced import Traced
from host_tools.optics.tracer import trace
from host_tools.pages.benchmark import Benchmark, Chapter, relative
from host_tools.scenes.light_block import SIDES, LightBlock
from host_tools.verification.light.scenes import FACE_RADIUS_MM, face

BLOCK = LightBlock(wall_reflectance=0.0, glass_refractive_index=1.41, glass_thickness_mm=0.0)
SKIN = Skin(refractive_index=1.41, albedo=1e-3, spread_mm=0.0)
PLACES: dict[str, tuple[float, float, float]] = {
    "centre of the face, 2.5 mm around": (0.0, 0.0, 2.5),
    "(6, 0) mm, 2.5 mm around": (6.0, 0.0, 2.5),
    "(-5, 5) mm, 2.5 mm around": (-5.0, 5.0, 2.5),
    "whole face": (0.0, 0.0, FACE_RADIUS_MM),
}
BOUND, WHOLE_BOUND = 0.02, 0.005
"""Four times the noise of 2 million rays, and far narrower than a missing index, cosine or pi."""
_reflectance = np.vectorize(reflectance)


def irradiance(block: LightBlock, x_mm: Array, y_mm: Array) -> Array:
    """Return the light on a flat face (1/mm2, per unit of LED light) at points; the glass must be the block's own."""
    T, h = block.thickness_mm, block.led_height_mm
    total = np.zeros(np.broadcast(x_mm, y_mm).shape)
    for along_mm, up_mm in _disc(block.led_radius_mm):
        for side in SIDES:
            for rise_mm, mirrored in ((T - h - up_mm, False), (T + h + up_mm, True)):
                total += irradiance_by_point(block, side, along_mm, rise_mm, x_mm, y_mm, mirrored=mirrored)
    return total / (len(SIDES) * len(_disc(block.led_radius_mm)))


def _disc(radius_mm: float, rings: int = 4, spokes: int = 12) -> list[tuple[float, float]]:
    """Return points of equal area on a disc."""
    radii = radius_mm * np.sqrt((np.arange(rings) + 0.5) / rings)
    turns = 2 * pi * np.arange(spokes) / spokes
    return [(float(r * np.cos(t)), float(r * np.sin(t))) for r in radii for t in turns]


def irradiance_by_point(
    block: LightBlock,
    side: tuple[float, float],
    along_mm: float,
    rise_mm: float,
    x_mm: Array,
    y_mm: Array,
    *,
    mirrored: bool,
) -> Array:
    """Return the irradiance by one point of an LED of unit flux, `rise_mm` below the face; mirrored: by the bottom.

    A point of unit flux radiates cos / pi per solid angle; through a window into index n, n^2 times as much.
    """
    a, (nx, ny) = block.half_width_mm, side
    inwards_mm = a - (x_mm * nx + y_mm * ny)
    sideways_mm = x_mm * ny + y_mm * nx - along_mm
    d = np.sqrt(inwards_mm**2 + sideways_mm**2 + rise_mm**2)
    cos_led, cos_face = inwards_mm / d, rise_mm / d
    intensity = cos_led / pi if block.led_coupling == "embedded" else _through_window(block.refractive_index, cos_led)
    arriving = intensity * cos_face / d**2
    return np.asarray(arriving * _reflectance(cos_face, block.refractive_index, 1.0) if mirrored else arriving)


def _through_window(n: float, cosine: Array) -> Array:
    """Return the intensity in a block behind an air gap: nothing beyond the critical angle of the window."""
    return np.asarray(n**2 * cosine / pi * (1 - _reflectance(cosine, n, 1.0)))


def expected_radiance(block: LightBlock, skin: Skin, x_mm: Array, y_mm: Array) -> Array:
    """Return what the camera sees of a Lambertian skin of the block's index, 1/(sr mm2) per unit of LED light."""
    n = block.refractive_index
    seen = skin.albedo / (pi * n**2) * plate_transmission(1.0, n, block.glass_refractive_index, 1.0)
    return np.asarray(seen * irradiance(block, x_mm, y_mm))


def measured(coupling: Literal["air", "embedded"], rays: int) -> tuple[Traced, Array]:
    """Return the traced image and the one on paper."""
    block = replace(BLOCK, led_coupling=coupling)
    found = trace(block, face(contact=1.0), SKIN, rays=rays)
    return found, expected_radiance(block, SKIN, found.x_mm[None, :], found.y_mm[:, None])


def benchmarks(rays: int) -> tuple[Benchmark, ...]:
    """Return the mean radiance of places on the face, traced against on paper, for both ways to mount an LED."""
    results = []
    for coupling in ("air", "embedded"):
        found, exact = measured(coupling, rays)
        for place, (x, y, radius) in PLACES.items():
            near = np.hypot(found.x_mm[None, :] - x, found.y_mm[:, None] - y) < radius
            bound = WHOLE_BOUND if radius == FACE_RADIUS_MM else BOUND
            values = float(found.radiance[near].mean()), float(exact[near].mean())
            results.append(relative(f"LEDs {_MOUNTED[coupling]}, {place}", "radiance (1/(sr mm2))", *values, bound))
    return tuple(results)


_MOUNTED = {"air": "behind a window", "embedded": "cast into the block"}


def chapter(rays: int) -> Chapter:
    """Return the chapter."""
    return Chapter(
        "The LEDs' light, on paper",
        "With black walls and an almost black skin of the block's own index only two ways lead from LED to skin: "
        "straight, and once reflected by the bottom.",
        "Lambert's cosine law; conservation of radiance over squared index, Nicodemus, Appl. Opt. 2:767 (1963).",
        benchmarks(rays),
    )
