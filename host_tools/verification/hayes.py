"""Hayes' punch: the force of the forward model's flat face, made rigid, on a bonded layer, against the exact one.

The exact one takes no finite elements: one Fredholm integral equation gives the force to ten digits. For a rigid flat
punch of radius a on a layer of thickness h bonded to a rigid base, with the layer's surface compliance 1 - M(xi h) over
that of a half-space, phi(t) - 2/pi int_0^a phi(s) int_0^oo M(xi h) cos(xi s) cos(xi t) dxi ds = 1 and
kappa = int phi / a.
Source: Lebedev & Ufliand, J. Appl. Math. Mech. 22:442 (1958); Hayes et al., J. Biomech. 5:541 (1972).
"""

from __future__ import annotations

from itertools import product

import numpy as np

from device.measurement.arrays import Array
from host_tools.forward.solve import solve
from host_tools.pages.benchmark import Benchmark, Chapter, Table, relative
from host_tools.scenes.scene import Press, Scene, Tissue, Waveguide

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


def _missing_compliance(nu: float, omega: Array) -> Array:
    """Return M: 1 minus the bonded layer's surface compliance over the half-space's, at wavenumber omega / h."""
    k, decay = 3 - 4 * nu, np.exp(-2 * omega)
    layer = k * (1 - decay**2) - 4 * omega * decay
    return np.asarray(1 - layer / (k * (1 + decay**2) + (4 * omega**2 + 1 + k * k) * decay))


def _gauss(points: int, end: float) -> tuple[Array, Array]:
    """Return Gauss's abscissas and weights on 0 to `end`."""
    at, weight = np.polynomial.legendre.leggauss(points)
    return (at + 1) * end / 2, weight * end / 2


RIGID = Waveguide(layer_thicknesses_mm=(10.0,), layer_moduli_kpa=(1e6,), poisson_ratio=0.3)
E_KPA, INDENTATION_MM = 5.0, 0.1
WIDTH_IN_THICKNESSES, WIDEST_MM = 10.0, 300.0
"""The layer ends so far beyond the punch: after five thicknesses a thin, nearly incompressible one loses 4e-4."""
POISSON_RATIOS = (0.3, 0.4, 0.45, 0.49, 0.499, 0.49999)
RATIOS = (0.2, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0)
PUBLISHED = {
    0.3: (1.207, 1.472, 1.784, 2.124, 2.480, 3.400, 4.336),
    0.45: (1.252, 1.599, 2.031, 2.532, 3.085, 4.638, 6.380),
    0.5: (1.281, 1.683, 2.211, 2.855, 3.609, 5.970, 9.069),
}
"""Table of the 1972 paper: the row of 0.5 as two public programs quote it, the others from memory."""


def measured_kappa(nu: float, radius_to_thickness: float) -> float:
    """Return kappa by the forward model at the level of all data sets."""
    a = RIGID.radius_mm
    h = a / radius_to_thickness
    tissue = Tissue(E_KPA, h, half_width_mm=a + min(WIDTH_IN_THICKNESSES * h, WIDEST_MM), poisson_ratio=nu)
    force_n = solve(Scene(None, Press(indentation_mm=INDENTATION_MM), RIGID, tissue)).force_n
    return force_n * 1e3 * (1 - nu**2) / (2 * E_KPA * a * INDENTATION_MM)


def benchmark(nu: float, radius_to_thickness: float) -> Benchmark:
    """Return one cell of the table."""
    exact = kappa(nu, radius_to_thickness)
    case = f"nu = {nu:g}, a/h = {radius_to_thickness:g}"
    return relative(case, "kappa", measured_kappa(nu, radius_to_thickness), exact, 1e-3)


def _published() -> Table:
    rows = []
    for nu, values in PUBLISHED.items():
        pairs = ((value, kappa(nu, ratio)) for ratio, value in zip(RATIOS, values, strict=True))
        rows.append((f"{nu:g}", *(f"{value:.3f} / {exact:.4f}" for value, exact in pairs)))
    caption = "Published by Hayes et al. (1972) / the integral equation"
    return Table(caption, ("nu", *(f"a/h = {ratio:g}" for ratio in RATIOS)), tuple(rows))


def chapter(short: bool) -> Chapter:
    """Return the chapter: every other cell of the table when short."""
    cells = list(product(POISSON_RATIOS, RATIOS))
    return Chapter(
        "Flat punch on a bonded layer (Hayes)",
        "P = 2 E a w kappa / (1 - nu^2) with a rigid probe, through the whole chain from scene to force.",
        "Hayes, Keer, Herrmann & Mockros, J. Biomech. 5:541 (1972); Lebedev & Ufliand, J. Appl. Math. Mech. 22:442 "
        "(1958).",
        tuple(benchmark(*cell) for cell in (cells[::5] if short else cells)),
        (_published(),),
    )
