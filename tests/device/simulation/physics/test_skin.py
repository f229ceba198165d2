"""Skin in optical contact: the law of pressure, sweat, and what no skin can be."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from device.measurement.quantities import InvalidQuantity
from device.simulation.physics.skin import Skin


def test_at_its_contact_pressure_skin_has_all_but_one_eth_of_its_contact():
    phi = Skin(contact_pressure_kpa=3.0, largest_contact_ratio=0.8).contact_ratio(np.array([0.0, 3.0, 1e4]))
    np.testing.assert_allclose(phi, [0.0, 0.8 * (1 - math.exp(-1)), 0.8], rtol=1e-6)


def test_gel_couples_everything_at_any_pressure_but_nothing_in_the_air():
    gel = Skin(wet_ratio=1.0)
    np.testing.assert_allclose(gel.contact_ratio(np.array([0.0, 0.5, 5.0])), [0.0, 1.0, 1.0])
    np.testing.assert_array_equal(gel.contact_ratio(np.zeros(3)), 0.0)


def test_sweat_takes_its_share_of_what_is_dry():
    pressure = np.array([0.5, 5.0])
    dry, damp = Skin().contact_ratio(pressure), Skin(wet_ratio=0.3).contact_ratio(pressure)
    np.testing.assert_allclose(damp, dry + 0.3 * (1 - dry), rtol=1e-6)


@given(st.floats(0.0, 1e4), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_contact_is_always_a_ratio(pressure, largest, wet):
    phi = Skin(largest_contact_ratio=largest, wet_ratio=wet).contact_ratio(np.array([pressure, 1.0]))
    assert 0.0 <= phi.min() <= phi.max() <= 1.0 + 1e-6
    assert phi.dtype == np.float32


@pytest.mark.parametrize("pressure", [-0.1, math.nan])
def test_a_pressure_that_pulls_is_refused(pressure):
    with pytest.raises(InvalidQuantity, match="p_kpa"):
        Skin().contact_ratio(np.array([1.0, pressure]))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("refractive_index", 0.9),
        ("albedo", 1.1),
        ("albedo", -0.1),
        ("spread_mm", -1.0),
        ("contact_pressure_kpa", 0.0),
        ("largest_contact_ratio", 1.5),
        ("wet_ratio", math.nan),
    ],
)
def test_what_no_skin_can_be_is_refused_by_name(name, value):
    with pytest.raises(InvalidQuantity, match=name):
        Skin(**{name: value})
