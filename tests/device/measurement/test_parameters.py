"""Coordinates of the parameters run from -1 to 1 over each range, evenly in value or in ratio."""

import numpy as np
import pytest

from device.measurement.parameters import (
    ABOVE_BASE_MM,
    ELASTIC_MISMATCHES,
    HIGH,
    LOW,
    NEAR_NOMINAL,
    NOMINAL,
    NUISANCES,
    PARAMETERS,
    RANGES,
    box_of,
    denormalise,
    denormalise_unknowns,
    elastic_mismatch,
    is_possible,
    normalise,
    normalise_unknowns,
    slope_of_normalised,
)
from device.measurement.quantities import UNKNOWNS


@pytest.fixture
def normalised() -> np.ndarray:
    return np.random.default_rng(1).uniform(-1, 1, (50, len(PARAMETERS)))


def test_the_unknowns_come_first_and_the_rest_are_nuisances():
    assert (*UNKNOWNS, *NUISANCES) == PARAMETERS
    assert len(set(PARAMETERS)) == 9


def test_coordinates_and_parameters_are_inverse_of_each_other(normalised):
    np.testing.assert_allclose(normalise(denormalise(normalised)), normalised, atol=1e-13)


def test_coordinates_are_minus_one_and_one_at_the_ends_of_the_ranges():
    np.testing.assert_allclose(normalise(np.array([LOW, HIGH])), [-np.ones(9), np.ones(9)], atol=1e-14)


@pytest.mark.parametrize("name", PARAMETERS)
def test_the_middle_is_the_geometric_mean_where_ratios_count_and_else_the_arithmetic(name):
    low, high, by_ratio = RANGES[name]
    middle = denormalise(np.zeros(len(PARAMETERS)))[PARAMETERS.index(name)]
    assert middle == pytest.approx(np.sqrt(low * high) if by_ratio else (low + high) / 2, rel=1e-13)


def test_neither_direction_changes_what_it_is_given(normalised):
    before, values = normalised.copy(), denormalise(normalised)
    given = values.copy()
    normalise(values)
    np.testing.assert_array_equal(normalised, before)
    np.testing.assert_array_equal(values, given)


def test_the_slope_is_the_parameters_by_the_coordinates(normalised):
    step = 1e-5
    differences = (denormalise(normalised + step) - denormalise(normalised - step)) / (2 * step)
    np.testing.assert_allclose(slope_of_normalised(denormalise(normalised)), differences, rtol=1e-8)


def test_what_is_nominal_lies_inside_its_range():
    assert set(NOMINAL) == set(NUISANCES)
    assert all(RANGES[name].low <= value <= RANGES[name].high for name, value in NOMINAL.items())


def test_the_unknowns_alone_have_the_same_coordinates_as_among_all():
    """Ends of the ranges and their middle, 40 kPa being the middle of 10 and 160 by ratio."""
    normalised, values = np.array([[-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.array([[2.0, 12.0, 40.0], [8.5, 8.0, 160.0]])
    np.testing.assert_allclose(denormalise_unknowns(normalised), values)
    np.testing.assert_allclose(normalise_unknowns(values), normalised, atol=1e-12)
    np.testing.assert_allclose(normalise_unknowns(values[0]), normalised[0], atol=1e-12)


def test_the_box_of_all_ranges_is_the_whole_one():
    middle, half = box_of(RANGES)
    np.testing.assert_array_equal(middle, 0.0)
    np.testing.assert_array_equal(half, 1.0)


def test_the_ends_of_a_smaller_box_are_those_of_its_ranges():
    middle, half = box_of(NEAR_NOMINAL)
    for coordinates, end in ((middle - half, "low"), (middle + half, "high")):
        np.testing.assert_allclose(denormalise(coordinates), [getattr(one, end) for one in NEAR_NOMINAL.values()])


def test_mismatch_is_that_of_a_sphere_in_its_tissue():
    """0 for an inclusion as soft as its tissue, 2/7 for one twice as stiff, 1 for a rigid one."""
    np.testing.assert_allclose(elastic_mismatch(np.array([5.0, 10.0, 1e9]), np.full(3, 5.0)), [0, 2 / 7, 1], atol=1e-7)


def at(**changed: float) -> np.ndarray:
    nominal = {"size_mm": 8.0, "depth_mm": 6.0, "youngs_modulus_kpa": 60.0} | NOMINAL
    return np.array([(nominal | changed)[name] for name in PARAMETERS])


def test_an_inclusion_ends_above_the_base():
    room_mm = 8.0 + 6.0 + ABOVE_BASE_MM
    thick = np.array([at(slab_thickness_mm=room_mm), at(slab_thickness_mm=room_mm - 1e-6)])
    np.testing.assert_array_equal(is_possible(thick), [True, False])


@pytest.mark.parametrize("end", [0, 1])
def test_an_inclusion_is_stiffer_than_its_tissue_by_what_shows(end):
    mismatch, inwards = ELASTIC_MISMATCHES[end], 1 - 2 * end
    moduli_kpa = [5.0 * (1 + 1.5 * m) / (1 - m) for m in (mismatch + 1e-6 * inwards, mismatch - 1e-6 * inwards)]
    found = is_possible(np.array([at(youngs_modulus_kpa=modulus_kpa) for modulus_kpa in moduli_kpa]))
    np.testing.assert_array_equal(found, [True, False])
