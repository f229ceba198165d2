"""What other tissue changes: nothing in the nominal slab, and shapes of the field in shares that are polynomials."""

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.physics.chebyshev import points_inside, points_with_ends
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import SlabChanges, field_shapes, resampling

KPA, MM = np.array([2.0, 5.0, 30.0]), np.array([15.0, 30.0, 60.0])
DEGREES = np.array([[0, 0, 1, 0, 0, 1], [1, 0, 0, 1, 0, 0], [0, 2, 1, 1, 1, 0]], dtype=np.uint8)
FORCE_N = points_inside(0.0, 0.8, 5)
OF_SHAPES = np.array([1.0, -2.0, 0.5, 4.0, -1.0])
OF_TERMS = np.array([0.5, -0.25, 0.125])
SHAPES = np.arange(1.0, 51.0).reshape(5, 2, 1, 5) * (1 + FORCE_N[:, None])
"""`field_shapes` [5, 2, F, R]."""


def slab_effect(modulus_kpa, thickness_mm):
    """Quadratic in the logarithm of the modulus and in one over the thickness, products too; none in the nominal."""
    stiffness, thinness = np.log(modulus_kpa / 5.0), 1 / thickness_mm - 1 / 30.0
    return (0.3 * stiffness - 0.05 * stiffness**2) * (1 + 8 * thinness) + 20 * thinness + 100 * thinness**2


def changes_on_paper():
    """Deformations change by the shares of the shapes, pressures by twice as much."""
    without = np.multiply.outer(slab_effect(KPA[:, None], MM), np.arange(20.0).reshape(2, 2, 5))
    shares = np.multiply.outer(OF_TERMS, np.multiply.outer(OF_SHAPES, [1.0, 2.0]))
    return SlabChanges(KPA, MM, without.astype(np.float32), DEGREES, shares.astype(np.float32), np.array(0.66))


def terms(inclusion, slab):
    """The three terms [3, F]: by the force, by the size and by the depth, on coordinates from -1 to 1."""
    x, y = (inclusion.size_mm - 8) / 7, (inclusion.depth_mm - 8) / 4
    e = 2 * np.log(slab.youngs_modulus_kpa / 2) / np.log(15) - 1
    t = 2 * (slab.thickness_mm**-2 - 60**-2) / (15**-2 - 60**-2) - 1
    return np.array([e * (FORCE_N / 0.35 - 1), x * t + 0 * FORCE_N, (3 * y**2 - 1) / 2 * e * t + 0 * FORCE_N])


@pytest.mark.parametrize("slab", [Slab(3.1, 22.0), Slab(30.0, 60.0), Slab(2.0, 15.0), Slab(17.0, 33.3)])
def test_without_an_inclusion_a_slab_changes_what_it_does_on_paper(slab):
    expected = slab_effect(slab.youngs_modulus_kpa, slab.thickness_mm) * np.arange(20.0).reshape(2, 2, 5)
    np.testing.assert_allclose(changes_on_paper().baseline_per_n(slab), expected, atol=1e-5)


def test_the_nominal_slab_changes_nothing():
    changes = changes_on_paper()
    np.testing.assert_allclose(changes.baseline_per_n(NOMINAL), 0.0, atol=1e-12)
    np.testing.assert_array_equal(changes.inclusion_per_n(SHAPES, FORCE_N, Inclusion(9.0, 5.0, 60.0), NOMINAL), 0.0)


@pytest.mark.parametrize("slab", [Slab(3.1, 22.0), Slab(30.0, 60.0), Slab(17.0, 33.3)])
def test_an_inclusions_field_changes_by_shares_of_its_shapes_that_are_polynomials(slab):
    inclusion = Inclusion(4.0, 10.0, 60.0)
    z = 2 * slab.elastic_mismatch(60.0) - 1
    of_terms = OF_TERMS * [1.0, 1.0, z]
    of_place = of_terms @ (terms(inclusion, slab) - terms(inclusion, NOMINAL))
    expected = np.array([1.0, 2.0])[:, None, None] * of_place[:, None] * np.tensordot(OF_SHAPES, SHAPES, 1)
    found = changes_on_paper().inclusion_per_n(SHAPES, FORCE_N, inclusion, slab)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


def test_below_the_smallest_size_an_inclusion_changes_as_the_smallest():
    small, smallest = (
        changes_on_paper().inclusion_per_n(SHAPES, FORCE_N, Inclusion(size, 5.0, 90.0), Slab(12.0, 20.0))
        for size in (0.3, 1.0)
    )
    np.testing.assert_array_equal(small, smallest)


def test_what_a_polynomial_is_at_some_forces_tells_it_at_others():
    at, other = points_inside(0.0, 0.66, 5), np.array([0.0, 0.3, 0.78])
    np.testing.assert_allclose(resampling(at, other) @ (1 + at**4), 1 + other**4)


def test_shapes_are_a_field_and_how_it_grows_with_size_depth_force_and_radius():
    """A table that holds size^3 (size + depth^2) F^2 over the force, times its mismatch."""
    axes = InclusionAxes(points_with_ends(1.0, 15.0, 3), points_with_ends(4.0, 12.0, 3), np.array([0.1, 0.96]))
    force_n = points_inside(0.0, 0.8, 4)
    of_place = (axes.size_mm[:, None] + axes.depth_mm**2)[None, :, :, None, None, None] * np.ones((2, 1, 1, 2, 1, 3))
    size, depth, mismatch = 7.0, 9.0, 0.5
    inclusion = Inclusion(size, depth, NOMINAL.modulus_kpa(mismatch))
    shapes = field_shapes(axes, of_place * force_n[:, None] ** 2, force_n, inclusion)
    strength = size**3 * mismatch * force_n**2
    expected = (size + depth**2) * strength, (3 * (size + depth**2) + size) * strength, 2 * depth * strength
    for shape, on_paper in zip(shapes, (*expected, 2 * expected[0]), strict=False):
        np.testing.assert_allclose(shape, np.broadcast_to(on_paper[:, None], shape.shape), rtol=1e-6)
    np.testing.assert_allclose(shapes[4], shapes[0] * [0.0, 0.25, 1.0])
