"""Hayes' punch solved without finite elements: one Fredholm integral equation gives the force to ten digits.

A rigid flat punch of radius a on a layer of thickness h bonded to a rigid base: with the layer's surface compliance
1 - M(xi h) over that of a half-space, phi(t) - 2/pi int_0^a phi(s) int_0^oo M(xi h) cos(xi s) cos(xi t) dxi ds = 1 and
kappa = int phi / a. Source: Lebedev & Ufliand, J. Appl. Math. Mech. 22:442 (1958); Hayes et al., J. Biomech. 5:541
(1972).
"""

from __future__ import annotations

import numpy as np

from host_tools.forward.face_state import FloatArray

POINTS, WAVENUMBERS = 40, 400
CUT_OFF = 30.0
"""M falls as exp(-2 xi h): beyond it there is nothing left."""


def kappa(nu: float, radius_to_thickness: float) -> float:
    """Return P (1 - nu^2) / (2 E a w), the force over that on a half-space; nu may be 0.5, a/h at most 10."""
    t, weight = _gauss(POINTS, 1.0)
    omega, d_omega = _gauss(WAVENUMBERS, CUT_OFF)
    cosine = np.cos(np.outer(radius_to_thickness * t, omega))
    kernel = 2 / np.pi * radius_to_thickness * (cosine * _missing_compliance(nu, omega) * d_omega) @ cosine.T
    phi = np.linalg.solve(np.eye(POINTS) - kernel * weight, np.ones(POINTS))
    return float(weight @ phi)


def _missing_compliance(nu: float, omega: FloatArray) -> FloatArray:
    """Return M: 1 minus the bonded layer's surface compliance over the half-space's, at wavenumber omega / h."""
    k, decay = 3 - 4 * nu, np.exp(-2 * omega)
    layer = k * (1 - decay**2) - 4 * omega * decay
    return np.asarray(1 - layer / (k * (1 + decay**2) + (4 * omega**2 + 1 + k * k) * decay))


def _gauss(points: int, end: float) -> tuple[FloatArray, FloatArray]:
    """Return Gauss's abscissas and weights on 0 to `end`."""
    at, weight = np.polynomial.legendre.leggauss(points)
    return (at + 1) * end / 2, weight * end / 2
