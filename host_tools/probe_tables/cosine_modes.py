"""Fields of the face off the axis as the tables keep them: cosine series in the angle, at radii 0.2 mm apart."""

from __future__ import annotations

import numpy as np

from device.measurement.arrays import Array
from host_tools.forward.face_state import FaceState
from host_tools.probe_tables.force_ramps import ring_means

MODES = 11
"""Cosines kept: the twelfth of the narrowest inclusion is below a thousandth of its peak."""
EVERY = 4
"""Every which of the face's radii is kept: 0.2 mm apart."""


def cosine_modes(field: Array) -> Array:
    """Return the cosine series [K, R] of a field [A, R] on evenly spaced rays, symmetric in the angle."""
    series = np.fft.rfft(field, axis=0).real / len(field)
    series[1:] *= 2
    return np.asarray(series[:MODES])


def face_modes(r_mm: Array, face: FaceState, inclusion_free: FaceState) -> Array:
    """Return the cosine series [2, K, R], on the table's radii, of an inclusion's deformation and pressure."""
    p_kpa = np.array([ring_means(r_mm, ray) for ray in face.p_kpa - inclusion_free.p_kpa])
    return np.stack([cosine_modes(face.w_mm - inclusion_free.w_mm), cosine_modes(p_kpa)])[..., ::EVERY]
