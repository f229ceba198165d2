"""Directions that light leaves in: from an LED into the block, from a diffuse surface, from a haze.

An air-coupled LED shines through its flat window, so its light enters within asin(1/n) of the wall's normal; an
embedded one shines straight into the block. Source: Snell; Lambert's law by inversion of its distribution (Pharr,
Jakob & Humphreys, Physically Based Rendering, 3rd ed., section 13.6).
"""

from __future__ import annotations

import math

import numpy as np

from host_tools.optics.compiled import compiled
from host_tools.optics.fresnel import reflectance, refracted_cosine

Direction = tuple[float, float, float]


@compiled
def about(cosine: float, nx: float, ny: float, nz: float) -> Direction:
    """Return a direction at an angle to a unit normal, turned about it at random."""
    sine = math.sqrt(max(0.0, 1.0 - cosine * cosine))
    turn = 2.0 * math.pi * np.random.random()  # noqa: NPY002 - numba's generator, seeded in each batch
    # Orthonormal basis without a branch at the pole: Duff et al., JCGT 6(1), 2017.
    sign = 1.0 if nz >= 0.0 else -1.0
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    u, v = sine * math.cos(turn), sine * math.sin(turn)
    x = u * (1.0 + sign * nx * nx * a) + v * b + cosine * nx
    y = u * sign * b + v * (sign + ny * ny * a) + cosine * ny
    z = -u * sign * nx - v * ny + cosine * nz
    return x, y, z


@compiled
def lambertian_cosine() -> float:
    """Return the cosine of a random direction of a Lambertian surface."""
    return math.sqrt(np.random.random())  # noqa: NPY002


@compiled
def led_cosine(exponent: float, embedded: bool, n_block: float) -> tuple[float, float]:
    """Return (cosine to the wall's normal inside the block, share that entered) of a random ray of an LED."""
    cosine = np.random.random() ** (1.0 / (exponent + 1.0))  # noqa: NPY002
    if embedded:
        return cosine, 1.0
    return refracted_cosine(cosine, 1.0, n_block), 1.0 - reflectance(cosine, 1.0, n_block)


@compiled
def isotropic() -> Direction:
    """Return a direction that is equally likely anywhere on the sphere."""
    return about(2.0 * np.random.random() - 1.0, 0.0, 0.0, 1.0)  # noqa: NPY002


@compiled
def sideways(spread: float) -> tuple[float, float]:
    """Return a random step (mm) inside the skin; its length is gamma distributed, shape 2, with mean `spread`.

    Shape 2 makes the light per area fall as exp(-2 r / spread), finite where it entered.
    """
    length = -0.5 * spread * math.log((1.0 - np.random.random()) * (1.0 - np.random.random()))  # noqa: NPY002
    turn = 2.0 * math.pi * np.random.random()  # noqa: NPY002
    return length * math.cos(turn), length * math.sin(turn)
