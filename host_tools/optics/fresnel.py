"""Light at smooth interfaces: refraction (Snell), unpolarised reflectance (Fresnel), a glass plate between two media.

Angles enter as cosines of incidence, 0..1; total internal reflection is reflectance 1, never an error.
Source: Hecht, Optics, 5th ed., sections 4.6.1-4.7.
"""

from __future__ import annotations

import math

from host_tools.optics.compiled import compiled


@compiled
def refracted_cosine(cosine: float, n_from: float, n_to: float) -> float:
    """Return the cosine of refraction, or -1 where all light is reflected (Snell: n_from sin = n_to sin')."""
    ratio = n_from / n_to
    squared = 1.0 - ratio * ratio * (1.0 - cosine * cosine)
    return math.sqrt(squared) if squared > 0.0 else -1.0


@compiled
def reflectance(cosine: float, n_from: float, n_to: float) -> float:
    """Return the reflected share of unpolarised light, the mean of both polarisations (Hecht, eq. 4.34-4.45)."""
    refracted = refracted_cosine(cosine, n_from, n_to)
    if refracted < 0.0:
        return 1.0
    perpendicular = (n_from * cosine - n_to * refracted) / (n_from * cosine + n_to * refracted)
    parallel = (n_to * cosine - n_from * refracted) / (n_to * cosine + n_from * refracted)
    return 0.5 * (perpendicular * perpendicular + parallel * parallel)


@compiled
def plate_transmission(cosine: float, n_from: float, n_plate: float, n_to: float) -> float:
    """Return the share that passes a plate, all reflections inside it added without phase: t1 t2 / (1 - r1 r2)."""
    inside = refracted_cosine(cosine, n_from, n_plate)
    if inside < 0.0:
        return 0.0
    first = reflectance(cosine, n_from, n_plate)
    second = reflectance(inside, n_plate, n_to)
    return (1.0 - first) * (1.0 - second) / (1.0 - first * second) if second < 1.0 else 0.0
