"""Bounds of an inclusion beside the axis, by the model and noise of the installed mode standard."""

import pytest
from daemon_process import ROOT

from device.files.bundle_file import read_ramp_model
from device.measurement.parameters import EVEN_STD
from host_tools.cramer_rao.press_bound import spread_of_modulus


@pytest.fixture(scope="module")
def answers():
    return read_ramp_model(ROOT / "models" / "standard").answers


def test_a_bound_with_the_box_is_under_what_the_box_leaves(answers):
    assert 0 < spread_of_modulus(answers, (10.0, 6.0, 40.0), 0.0) < EVEN_STD


def test_a_small_deep_inclusion_says_hardly_anything_of_its_modulus(answers):
    assert spread_of_modulus(answers, (3.0, 12.0, 120.0), 0.0) == pytest.approx(EVEN_STD, rel=0.03)


def test_the_bright_side_of_an_inclusion_beside_the_axis_may_tell_more_of_its_modulus_than_its_place_costs(answers):
    on_axis, beside = (spread_of_modulus(answers, (10.0, 6.0, 40.0), offset_mm) for offset_mm in (0.0, 1.5))
    assert beside < 0.97 * on_axis
