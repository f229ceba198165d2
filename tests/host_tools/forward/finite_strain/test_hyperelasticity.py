"""The neo-Hookean law on a cylinder under homogeneous stretch, whose Cauchy stress is known on paper.

With b = F F^T: sigma_i - sigma_j = mu J^-5/3 (l_i^2 - l_j^2) and tr(sigma) / 3 = K (J - 1).
"""

from math import isnan, pi

import numpy as np
import pytest
from netgen.geom2d import SplineGeometry
from ngsolve import CF, H1, BilinearForm, GridFunction, InnerProduct, Integrate, Mesh, Variation, dx, grad, x, y
from scipy.optimize import brentq

from host_tools.forward.finite_strain.hyperelasticity import DeformationGradient, NeoHookean, deformation_gradient
from host_tools.forward.finite_strain.newton import EnergyNewton, NewtonStatus
from host_tools.forward.finite_strain.sliding import relabelled

MU, K, RADIUS, HEIGHT = 1.7, 40.0, 2.0, 3.0
LAW = NeoHookean(MU, K)
RING = 2 * pi * x


@pytest.fixture(scope="module")
def cylinder():
    geometry = SplineGeometry()
    geometry.AddRectangle((0, 0), (RADIUS, HEIGHT), bcs=("bottom", "side", "top", "axis"))
    return Mesh(geometry.GenerateMesh(maxh=1.5))


def _stretched(mesh, held_r, held_z, stretch_r=1.0, stretch_z=1.0):
    """Minimise the energy with the named sides moved; return displacement and energy."""
    space = H1(mesh, order=2, dirichlet=held_r) * H1(mesh, order=2, dirichlet=held_z)
    energy = BilinearForm(space, symmetric=True)
    density = LAW.energy_density_kpa(deformation_gradient(*space.TrialFunction()))
    energy += Variation(density * RING * dx(bonus_intorder=2))
    u = GridFunction(space)
    newton = EnergyNewton(energy, u, space.FreeDofs())
    u.components[0].Set((stretch_r - 1) * x)
    u.components[1].Set((stretch_z - 1) * y)
    assert newton.descend().status is NewtonStatus.CONVERGED
    return u, energy


def _pull(u, energy, component, boundary):
    """Return the reaction of a boundary along one component, per unit of a displacement of 1 there."""
    residual, push = u.vec.CreateVector(), GridFunction(u.space)
    energy.Apply(u.vec, residual)
    push.components[component].Set(1.0, definedon=u.space.mesh.Boundaries(boundary))
    return InnerProduct(residual, push.vec)


@pytest.mark.parametrize("stretch", [0.6, 0.9, 1.3])
def test_uniaxial_stress_is_the_closed_form(cylinder, stretch):
    def side_stress(lateral):
        J = stretch * lateral**2
        return K * (J - 1) - MU * J ** (-5 / 3) * (stretch**2 - lateral**2) / 3

    lateral = brentq(side_stress, 0.5, 2.0, xtol=1e-14)
    J = stretch * lateral**2
    u, energy = _stretched(cylinder, "axis", "top|bottom", stretch_z=stretch)
    assert u.components[0](cylinder(RADIUS, 1.0)) == pytest.approx((lateral - 1) * RADIUS, rel=1e-9)
    axial_stress = MU * J ** (-5 / 3) * (stretch**2 - lateral**2)
    area = pi * (RADIUS * lateral) ** 2
    assert _pull(u, energy, 1, "top") == pytest.approx(axial_stress * area, rel=1e-9)


@pytest.mark.parametrize("stretch", [0.8, 1.2])
def test_equibiaxial_stress_is_the_closed_form(cylinder, stretch):
    def axial_stress(axial):
        J = stretch**2 * axial
        return K * (J - 1) + 2 * MU * J ** (-5 / 3) * (axial**2 - stretch**2) / 3

    axial = brentq(axial_stress, 0.3, 3.0, xtol=1e-14)
    J = stretch**2 * axial
    u, energy = _stretched(cylinder, "axis|side", "bottom", stretch_r=stretch)
    assert u.components[1](cylinder(1.0, HEIGHT)) == pytest.approx((axial - 1) * HEIGHT, rel=1e-9)
    side_stress = MU * J ** (-5 / 3) * (stretch**2 - axial**2)
    area = 2 * pi * RADIUS * stretch * HEIGHT * axial
    assert _pull(u, energy, 0, "side") == pytest.approx(side_stress * area, rel=1e-9)


def test_a_folded_state_has_no_energy(cylinder):
    inside_out = DeformationGradient(CF((-1, 0, 0, 1), dims=(2, 2)), 1.0)
    assert isnan(LAW.energy_density_kpa(inside_out)(cylinder(1, 1)))


def test_labels_carry_no_energy(cylinder):
    """A body stretched uniformly stores W per volume, whatever the labels of the mesh points inside it."""
    stretch_r, stretch_z = 1.1, 0.8
    m = GridFunction(H1(cylinder, order=3))
    m.Set(0.2 * x * (RADIUS - x) * (1 + 0.3 * y))  # keeps axis and side, moves the labels of top and bottom too
    u = GridFunction(H1(cylinder, order=3) ** 2)
    u.components[0].Set(stretch_r * (x + m) - x)
    u.components[1].Set((stretch_z - 1) * y)
    F, volume_ratio = relabelled(deformation_gradient(*u.components), m, grad(m))
    energy = Integrate(LAW.energy_density_kpa(F) * volume_ratio * RING, cylinder, order=12)
    J, trace = stretch_r**2 * stretch_z, 2 * stretch_r**2 + stretch_z**2
    W = MU / 2 * (J ** (-2 / 3) * trace - 3) + K / 2 * (J - 1) ** 2
    assert energy == pytest.approx(W * pi * RADIUS**2 * HEIGHT, rel=1e-12)
    assert np.ptp([m(cylinder(r, 3.0)) for r in (0.1, 1.0, 1.9)]) > 0.1
