"""The settings of the press: its band, and how contact, target and overload follow each other."""

import pytest

from device.measurement.quantities import InvalidQuantity
from device.settings.press_section import PressSection


def test_the_band_lies_around_the_target_by_its_ratio():
    assert PressSection(target_n=0.8, band_ratio=0.1).band_n == pytest.approx((0.72, 0.88))


@pytest.mark.parametrize("target_n", [0.1, 20.0])
def test_both_ends_of_the_targets_bound_are_taken(target_n):
    assert PressSection(target_n=target_n, contact_n=0.01, overload_n=50.0).target_n == target_n


@pytest.mark.parametrize("target_n", [0.09, 20.1])
def test_a_target_beyond_its_bound_is_refused(target_n):
    with pytest.raises(InvalidQuantity, match=r"^press\.target_n is"):
        PressSection(target_n=target_n, contact_n=0.01, overload_n=50.0)


def test_the_overload_lies_above_the_hold_and_the_contact_below_half_of_it():
    with pytest.raises(InvalidQuantity, match=r"^press\.overload_n is 0\.95, but must be at least 0\.96 "):
        PressSection(target_n=0.8, overload_n=0.95)
    with pytest.raises(InvalidQuantity, match=r"^press\.contact_n is 0\.055, but must be .* at most 0\.05 "):
        PressSection(target_n=0.1, contact_n=0.055)
