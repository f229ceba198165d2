"""What the compiled ray loop passes around: one ray, the numbers of block and skin, and where energy is booked.

Named tuples of floats because numba compiles them to registers. Every unit of energy a ray loses is booked under one
of the first entries of the ledger, so that they sum to the light emitted.
"""

from __future__ import annotations

from typing import NamedTuple

from device.simulation.physics.skin import Skin
from host_tools.optics.compiled import compiled
from host_tools.scenes.light_block import LightBlock

BOOKS = ("window", "walls", "skin", "beyond_face", "through_face", "bottom", "roulette", "cut")
WINDOW, WALLS, SKIN, BEYOND_FACE, THROUGH_FACE, BOTTOM, ROULETTE, CUT = range(len(BOOKS))
COUNTERS = ("reemitted", "specular_into_aperture", "hits")
REEMITTED, SPECULAR, HITS = range(len(BOOKS), len(BOOKS) + len(COUNTERS))

TALLIES = ("radiance", "stray_wet", "stray_dry", "returned_wet", "returned_dry")
RADIANCE, STRAY_WET, STRAY_DRY, RETURNED_WET, RETURNED_DRY = range(len(TALLIES))

STRAIGHT, STRAY, RETURNED = 0, 1, 2
"""Past of a ray: only reflected so far; scattered by wall or haze; been in the skin."""
JUST_INSIDE_MM = 1e-7
"""How far a ray restarts from a surface, so that rounding does not put it outside."""


class Ray(NamedTuple):
    """Place (mm), unit direction, weight (1 = as emitted; 0 = ended) and past of one ray."""

    x: float
    y: float
    z: float
    dx: float
    dy: float
    dz: float
    weight: float
    past: int


@compiled
def moved(ray: Ray, x: float, y: float, z: float) -> Ray:
    """Return the ray at another place (mm)."""
    return Ray(x, y, z, ray.dx, ray.dy, ray.dz, ray.weight, ray.past)


@compiled
def weighing(ray: Ray, weight: float) -> Ray:
    """Return the ray with another weight; 0 ends it."""
    return Ray(ray.x, ray.y, ray.z, ray.dx, ray.dy, ray.dz, weight, ray.past)


class Medium(NamedTuple):
    """The numbers of a `LightBlock` and a `Skin`, and the tally's cell."""

    half: float
    thickness: float
    n_block: float
    led_height: float
    led_radius: float
    embedded: bool
    lens_exponent: float
    wall: float
    haze: float
    n_glass: float
    glass: float
    aperture: float
    camera: float
    n_skin: float
    albedo: float
    spread: float
    skin_behind: bool
    cell: float


def medium(block: LightBlock, skin: Skin, skin_behind: bool, cell_mm: float) -> Medium:
    """Return block, skin and cell size (mm) as one tuple for the compiled loop."""
    return Medium(
        half=float(block.half_width_mm),
        thickness=float(block.thickness_mm),
        n_block=float(block.refractive_index),
        led_height=float(block.led_height_mm),
        led_radius=float(block.led_radius_mm),
        embedded=block.led_coupling == "embedded",
        lens_exponent=float(block.led_lens_exponent),
        wall=float(block.wall_reflectance),
        haze=float(block.haze_per_mm),
        n_glass=float(block.glass_refractive_index),
        glass=float(block.glass_thickness_mm),
        aperture=float(block.aperture_radius_mm),
        camera=float(block.camera_distance_mm),
        n_skin=float(skin.refractive_index),
        albedo=float(skin.albedo),
        spread=float(skin.spread_mm),
        skin_behind=skin_behind,
        cell=cell_mm,
    )
