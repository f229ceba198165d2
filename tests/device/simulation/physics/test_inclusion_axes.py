"""The axes of a table of inclusions: exact for polynomials in size, depth and mismatch, refused outside."""

import numpy as np
import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.physics.chebyshev import points_with_ends
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, Slab

AXES = InclusionAxes(points_with_ends(1.0, 15.0, 4), points_with_ends(4.0, 12.0, 3), points_with_ends(0.1, 0.96, 3))


def polynomial(size_mm, depth_mm, mismatch):
    return (1 - size_mm**3 / 1000) * (depth_mm**2 - depth_mm) * (2 + mismatch - mismatch**2)


FIELDS = np.multiply.outer([1.0, 3.0], polynomial(*np.meshgrid(*AXES, indexing="ij")))


@pytest.mark.parametrize("slab", [NOMINAL, Slab(4.0), Slab(6.25, 36.0)])
@pytest.mark.parametrize("truth", [(9.3, 7.7, 55.0), (15.0, 4.0, 200.0), (1.0, 12.0, 8.0)])
def test_a_polynomial_in_size_depth_and_elastic_mismatch_is_exact(slab, truth):
    size_mm, depth_mm, modulus_kpa = truth
    mismatch = slab.elastic_mismatch(modulus_kpa)
    expected = size_mm**3 * mismatch * polynomial(size_mm, depth_mm, mismatch)
    found = AXES.inclusion_per_n(FIELDS, Inclusion(*truth), slab)
    np.testing.assert_allclose(found, [expected, 3 * expected], rtol=1e-12)


def test_an_inclusion_smaller_than_the_smallest_shrinks_with_its_volume_to_none():
    half, smallest, none = (AXES.inclusion_per_n(FIELDS, Inclusion(d, 6.0, 80.0), NOMINAL) for d in (0.5, 1.0, 0.0))
    np.testing.assert_allclose(half, smallest / 8, rtol=1e-12)
    assert not none.any()


@pytest.mark.parametrize("place", [(9.3, 7.7), (15.0, 4.0), (1.0, 12.0)])
def test_how_a_field_grows_with_size_and_depth_is_its_slope(place):
    """The size itself times the slope by it, and the slope by the depth; ends of the axes included."""
    inclusion, mismatch = Inclusion(*place, 55.0), NOMINAL.elastic_mismatch(55.0)

    def field(size_mm, depth_mm):
        return size_mm**3 * mismatch * polynomial(size_mm, depth_mm, mismatch)

    size_mm, depth_mm = place
    by_size = size_mm * (field(size_mm + 1e-5, depth_mm) - field(size_mm - 1e-5, depth_mm)) / 2e-5
    by_depth = (field(size_mm, depth_mm + 1e-5) - field(size_mm, depth_mm - 1e-5)) / 2e-5
    for found, expected in zip(AXES.growth_per_n(FIELDS, inclusion, NOMINAL), (by_size, by_depth), strict=True):
        np.testing.assert_allclose(found, [expected, 3 * expected], rtol=1e-5)


def test_an_inclusion_smaller_than_the_smallest_grows_as_the_smallest_by_its_volume():
    """So that what other tissue changes does not jump at the smallest size."""
    half, smallest = (AXES.growth_per_n(FIELDS, Inclusion(size, 6.0, 80.0), NOMINAL) for size in (0.5, 1.0))
    np.testing.assert_allclose(half, np.array(smallest) / 8)


@pytest.mark.parametrize(
    ("inclusion", "quantity"),
    [
        ((15.1, 6.0, 80.0), "size_mm"),
        ((10.0, 3.9, 80.0), "depth_mm"),
        ((0.0, 12.1, 80.0), "depth_mm"),
        ((10.0, 6.0, 6.3), "youngs_modulus_kpa"),
        ((10.0, 6.0, 306.0), "youngs_modulus_kpa"),
    ],
)
def test_an_inclusion_outside_the_axes_is_refused_by_what_is_outside(inclusion, quantity):
    with pytest.raises(InvalidQuantity, match=f"^{quantity} is .*inside the table's range"):
        AXES.inclusion_per_n(FIELDS, Inclusion(*inclusion), NOMINAL)


def test_the_moduli_that_are_held_follow_the_tissue():
    """A mismatch of 0.1 is 8 kPa in tissue of 6.26 kPa, but 7.7 kPa in tissue of 6 kPa."""
    inclusion = Inclusion(10.0, 6.0, 7.8)
    assert AXES.inclusion_per_n(FIELDS, inclusion, Slab(6.0)).all()
    with pytest.raises(InvalidQuantity, match="youngs_modulus_kpa is 7.8"):
        AXES.inclusion_per_n(FIELDS, inclusion, Slab(6.25))
