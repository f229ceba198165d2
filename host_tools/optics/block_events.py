"""What happens to a ray at an LED, a side wall, the glass plate below, and in a hazy block.

The glass counts: light trapped at its lower surface comes back up to 5 mm further on, which moves the light field.
Source: Snell and Fresnel (Hecht, Optics, section 4.6); Lambertian walls.
"""

from __future__ import annotations

import math

import numpy as np

from device.measurement.arrays import Array
from host_tools.optics.compiled import compiled
from host_tools.optics.emission import about, isotropic, lambertian_cosine, led_cosine
from host_tools.optics.fresnel import plate_transmission, reflectance, refracted_cosine
from host_tools.optics.ray import (
    BOTTOM,
    JUST_INSIDE_MM,
    RADIANCE,
    SPECULAR,
    STRAIGHT,
    STRAY,
    WALLS,
    WINDOW,
    Medium,
    Ray,
    moved,
    weighing,
)


@compiled
def emit(m: Medium, led: int, ledger: Array) -> Ray:
    """Return a ray that has just entered the block from LED 0..3 (+x, +y, -x, -y); books what the window reflects."""
    cosine, entered = led_cosine(m.lens_exponent, m.embedded, m.n_block)
    ledger[WINDOW] += 1.0 - entered
    r = m.led_radius * math.sqrt(np.random.random())  # noqa: NPY002
    turn = 2.0 * math.pi * np.random.random()  # noqa: NPY002
    along, z = r * math.cos(turn), m.led_height + r * math.sin(turn)
    side = 1.0 if led < 2 else -1.0
    wall = side * (m.half - JUST_INSIDE_MM)
    x, y = (wall, along) if led % 2 == 0 else (along, wall)
    dx, dy, dz = about(cosine, -side, 0.0, 0.0) if led % 2 == 0 else about(cosine, 0.0, -side, 0.0)
    return Ray(x, y, z, dx, dy, dz, entered, STRAIGHT)


@compiled
def distance_to_wall(ray: Ray, half: float) -> float:
    """Return how far (mm) a ray from inside travels to a side wall."""
    in_x = (math.copysign(half, ray.dx) - ray.x) / ray.dx if ray.dx != 0.0 else 1e30
    in_y = (math.copysign(half, ray.dy) - ray.y) / ray.dy if ray.dy != 0.0 else 1e30
    return max(min(in_x, in_y), 0.0)


@compiled
def at_wall(ray: Ray, m: Medium, ledger: Array) -> Ray:
    """Return the ray scattered back by the wall it has reached; books the light the wall absorbs."""
    ledger[WALLS] += ray.weight * (1.0 - m.wall)
    inside = m.half - JUST_INSIDE_MM
    if abs(ray.x) > abs(ray.y):
        nx, ny = -math.copysign(1.0, ray.x), 0.0
    else:
        nx, ny = 0.0, -math.copysign(1.0, ray.y)
    dx, dy, dz = about(lambertian_cosine(), nx, ny, 0.0)
    x, y = min(max(ray.x, -inside), inside), min(max(ray.y, -inside), inside)
    return Ray(x, y, ray.z, dx, dy, dz, ray.weight * m.wall, max(ray.past, STRAY))


@compiled
def at_bottom(ray: Ray, m: Medium, ledger: Array) -> Ray:
    """Return the ray reflected by the plate, moved by its way through the glass; ended where it leaves.

    Books light that leaves through the bottom, what of it reaches the camera's aperture without having been
    scattered, and light that reaches the black edge of the glass.
    """
    cosine = -ray.dz
    back = Ray(ray.x, ray.y, JUST_INSIDE_MM, ray.dx, ray.dy, cosine, ray.weight, ray.past)
    first = reflectance(cosine, m.n_block, m.n_glass)
    if np.random.random() < first:  # noqa: NPY002
        return back
    in_glass = refracted_cosine(cosine, m.n_block, m.n_glass)
    second = reflectance(in_glass, m.n_glass, 1.0)
    shift = m.glass * (m.n_block / m.n_glass) / in_glass
    x, y = ray.x, ray.y
    while True:
        x, y = x + shift * ray.dx, y + shift * ray.dy
        if np.random.random() >= second:  # noqa: NPY002
            ledger[BOTTOM] += ray.weight
            if ray.past == STRAIGHT and _meets_aperture(x, y, ray, m):
                ledger[SPECULAR] += ray.weight
            return weighing(back, 0.0)
        x, y = x + shift * ray.dx, y + shift * ray.dy
        if abs(x) >= m.half or abs(y) >= m.half:
            ledger[WALLS] += ray.weight
            return weighing(back, 0.0)
        if np.random.random() >= first:  # noqa: NPY002
            return moved(back, x, y, JUST_INSIDE_MM)


@compiled
def _meets_aperture(x: float, y: float, ray: Ray, m: Medium) -> bool:
    """Return whether a ray that leaves the glass at (x, y) passes the camera's round aperture."""
    in_air = refracted_cosine(-ray.dz, m.n_block, 1.0)
    if in_air <= 0.0:
        return False
    far = (m.camera - m.glass) * m.n_block / in_air
    u, v = x + far * ray.dx, y + far * ray.dy
    return u * u + v * v <= m.aperture * m.aperture


@compiled
def camera_transmission(m: Medium) -> float:
    """Return the share of vertical light that passes the glass plate."""
    return plate_transmission(1.0, m.n_block, m.n_glass, 1.0)


@compiled
def add(tally: Array, x: float, y: float, value: float, m: Medium) -> None:
    """Add a value per area of cell at a point (mm) of a tally [ny, nx]; outside the face it is dropped."""
    i, j = math.floor((x + m.half) / m.cell), math.floor((y + m.half) / m.cell)
    if 0 <= i < tally.shape[1] and 0 <= j < tally.shape[0]:
        tally[j, i] += value / (m.cell * m.cell)


@compiled
def in_haze(ray: Ray, m: Medium, tallies: Array) -> Ray:
    """Return the ray scattered into any direction; adds what the camera sees of it directly."""
    seen = camera_transmission(m) * math.exp(-m.haze * ray.z) / (4.0 * math.pi * m.n_block**2)
    add(tallies[RADIANCE], ray.x, ray.y, ray.weight * seen, m)
    dx, dy, dz = isotropic()
    return Ray(ray.x, ray.y, ray.z, dx, dy, dz, ray.weight, max(ray.past, STRAY))
