"""What happens to a ray at the sensing face: reflected, let out into air or skin, and given back by the skin.

A place is wet (block on skin) with the probability of its contact ratio, otherwise dry (block, thin air, skin). Skin
keeps no memory: light comes back a little aside, through a wet or a dry place by the contact there. At every entry the
part that the camera sees is added (next-event estimation), so no ray needs to find the small camera.
Source: Veach, Robust Monte Carlo Methods, 1997, section 8.2; radiance over index squared is conserved (Hecht).
"""

from __future__ import annotations

import math

import numpy as np

from device.measurement.arrays import Array
from host_tools.optics.block_events import add, camera_transmission
from host_tools.optics.compiled import compiled
from host_tools.optics.emission import about, lambertian_cosine, sideways
from host_tools.optics.fresnel import reflectance, refracted_cosine
from host_tools.optics.height_field import HeightField, bilinear, slope
from host_tools.optics.ray import (
    BEYOND_FACE,
    CUT,
    HITS,
    JUST_INSIDE_MM,
    RADIANCE,
    REEMITTED,
    RETURNED,
    RETURNED_DRY,
    RETURNED_WET,
    SKIN,
    STRAIGHT,
    STRAY,
    STRAY_DRY,
    STRAY_WET,
    THROUGH_FACE,
    Medium,
    Ray,
    moved,
    weighing,
)

MOST_RETURNS = 1000


@compiled
def at_face(ray: Ray, m: Medium, field: HeightField, contact: Array, tallies: Array, ledger: Array) -> Ray:
    """Return the ray after the face: reflected, come back from the skin, or ended."""
    nx, ny, nz = _normal(field, ray.x, ray.y)
    cosine = ray.dx * nx + ray.dy * ny + ray.dz * nz
    if cosine <= 0.0:  # a kink between facets: the ray is already on its way in
        return moved(ray, ray.x, ray.y, ray.z - JUST_INSIDE_MM)
    cosine = min(cosine, 1.0)
    ledger[HITS] += ray.weight
    into_skin, into_air = 1.0 - reflectance(cosine, m.n_block, m.n_skin), 1.0 - reflectance(cosine, m.n_block, 1.0)
    _tally(ray, into_skin, into_air, m, tallies)
    wet = bilinear(contact, field, ray.x, ray.y)
    into_skin, into_air = wet * into_skin, (1.0 - wet) * into_air
    entering = into_skin + into_air if m.skin_behind else into_skin
    if entering > 0.0:
        aside_x, aside_y = sideways(m.spread)
        show(ray.x + aside_x, ray.y + aside_y, ray.weight * entering * m.albedo, m, field, contact, tallies)
    fate = np.random.random()  # noqa: NPY002
    if fate < entering:
        return in_skin(ray, m, field, contact, tallies, ledger)
    if fate < into_skin + into_air:
        ledger[THROUGH_FACE] += ray.weight
        return weighing(ray, 0.0)
    dx, dy, dz = ray.dx - 2 * cosine * nx, ray.dy - 2 * cosine * ny, ray.dz - 2 * cosine * nz
    return Ray(ray.x, ray.y, ray.z - JUST_INSIDE_MM, dx, dy, dz, ray.weight, ray.past)


@compiled
def _normal(field: HeightField, x: float, y: float) -> tuple[float, float, float]:
    """Return the unit normal of the face, out of the block."""
    sx, sy = slope(field, x, y)
    norm = 1.0 / math.sqrt(1.0 + sx * sx + sy * sy)
    return sx * norm, sy * norm, norm


@compiled
def _tally(ray: Ray, into_skin: float, into_air: float, m: Medium, tallies: Array) -> None:
    """Add the light that has been scattered before to what a wet and what a dry face would take in."""
    if ray.past == STRAIGHT:
        return
    wet, dry = (STRAY_WET, STRAY_DRY) if ray.past == STRAY else (RETURNED_WET, RETURNED_DRY)
    add(tallies[wet], ray.x, ray.y, ray.weight * into_skin, m)
    add(tallies[dry], ray.x, ray.y, ray.weight * into_air, m)


@compiled
def _wet_share(x: float, y: float, m: Medium, field: HeightField, contact: Array) -> float:
    """Return the share of the skin's light that comes back through contact; all of it where air has no skin behind."""
    return bilinear(contact, field, x, y) if m.skin_behind else 1.0


@compiled
def show(x: float, y: float, flux: float, m: Medium, field: HeightField, contact: Array, tallies: Array) -> None:
    """Add to the camera's radiance the flux that the skin gives back at a point, seen from straight below.

    Lambertian in the skin's own medium: radiance flux / pi per inclined area, over the squared index, times what face
    and glass let through.
    """
    _, _, nz = _normal(field, x, y)
    wet = _wet_share(x, y, m, field, contact)
    through_wet = (1.0 - reflectance(nz, m.n_block, m.n_skin)) / (m.n_skin * m.n_skin)
    through_dry = 1.0 - reflectance(nz, m.n_block, 1.0)
    seen = (wet * through_wet + (1.0 - wet) * through_dry) * nz / math.pi * camera_transmission(m)
    if m.haze > 0.0:
        seen *= math.exp(-m.haze * (m.thickness - bilinear(field.w, field, x, y)))
    add(tallies[RADIANCE], x, y, flux * seen, m)


@compiled
def in_skin(ray: Ray, m: Medium, field: HeightField, contact: Array, tallies: Array, ledger: Array) -> Ray:
    """Return the ray that the skin gives back into the block, after as many turns as the face sends it back."""
    x, y, weight = ray.x, ray.y, ray.weight
    for turn in range(MOST_RETURNS):
        ledger[SKIN] += weight * (1.0 - m.albedo)
        weight *= m.albedo
        aside_x, aside_y = sideways(m.spread)
        x, y = x + aside_x, y + aside_y
        if abs(x) >= m.half or abs(y) >= m.half:
            ledger[BEYOND_FACE] += weight
            return weighing(ray, 0.0)
        if turn > 0:
            show(x, y, weight, m, field, contact, tallies)
        ledger[REEMITTED] += weight
        wet = np.random.random() < _wet_share(x, y, m, field, contact)  # noqa: NPY002
        index = m.n_skin if wet else 1.0
        cosine = lambertian_cosine()
        if np.random.random() >= reflectance(cosine, index, m.n_block):  # noqa: NPY002
            nx, ny, nz = _normal(field, x, y)
            dx, dy, dz = about(refracted_cosine(cosine, index, m.n_block), -nx, -ny, -nz)
            z = m.thickness - bilinear(field.w, field, x, y) - JUST_INSIDE_MM
            return Ray(x, y, z, dx, dy, dz, weight, RETURNED)
    ledger[CUT] += weight
    return weighing(ray, 0.0)
