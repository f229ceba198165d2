"""Bounds of an inclusion in small strain: what must lower them, what must raise them, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.parameters import RANGES
from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.cramer_rao.bounds import Limit, Limits, limit_of, limits, std_of_box
from host_tools.cramer_rao.information import CramerRao
from host_tools.cramer_rao.observed_press import observed_presses, rings_of
from host_tools.cramer_rao.protocol import SPREADS, PressProtocol
from host_tools.forward.derivatives.sensitive_presses import sensitive_ramp
from host_tools.scenes.scene import Scene

INCLUSION = Inclusion(10, 6, 80)
BOX = std_of_box(INCLUSION)
PROTOCOL = PressProtocol(forces_n=(0.3, 0.6), strain="small", observable="displacement", systematic_ratio=0.002)
CAMERA_ALONE = replace(PROTOCOL, zero_spread_n=0.0, **dict.fromkeys(SPREADS, 0.0))


@pytest.fixture(scope="module")
def ramps():
    return sensitive_ramp(Scene(INCLUSION), PROTOCOL.forces_n, strain="small")


@pytest.fixture(scope="module")
def ramp(ramps):
    return ramps[4]


@pytest.fixture(scope="module")
def whole(ramp):
    return limit_of(ramp, PROTOCOL, BOX)


def test_the_box_is_that_of_the_probe():
    """Even in d from 2 to 15 mm and h from 4 to 12 mm, and in ln E from 10 to 160 kPa."""
    assert pytest.approx([13 / 12**0.5 / 10, 8 / 12**0.5 / 6, np.log(16) / 12**0.5]) == BOX


def test_the_box_lowers_every_bound_and_no_bound_exceeds_it(whole):
    assert (whole.with_box.std < whole.alone.std).all()
    assert (whole.with_box.std < BOX).all()


def test_where_the_camera_is_all_its_share_falls_with_the_root_of_the_frames(ramp):
    few, many = (limit_of(ramp, replace(CAMERA_ALONE, frames=n, reference_frames=n), BOX).alone.std for n in (10, 90))
    assert few / many == pytest.approx(np.full(3, 3.0), rel=1e-6)


def test_frames_hardly_help_against_a_smooth_error(ramp, whole):
    many = limit_of(ramp, replace(PROTOCOL, frames=10**6, reference_frames=10**6), BOX)
    assert (many.alone.std < whole.alone.std).all()
    assert (many.alone.std > whole.alone.std / 10).all()


def test_an_unknown_gain_raises_the_bound_of_the_modulus(ramp):
    known, unknown = (
        limit_of(ramp, replace(CAMERA_ALONE, gain_spread_ratio=spread), BOX).alone.std for spread in (0.0, 10.0)
    )
    assert unknown[2] > 1.02 * known[2]


@pytest.mark.parametrize("name", ["tissue_modulus_spread_ratio", "thickness_spread_ratio", "systematic_ratio"])
def test_what_is_not_known_raises_every_bound(ramp, name):
    known = limit_of(ramp, CAMERA_ALONE, BOX).alone.std
    unknown = limit_of(ramp, replace(CAMERA_ALONE, **{name: 0.1}), BOX).alone.std
    assert (unknown > known).all()


def test_both_orders_of_the_elements_give_the_same_bounds(ramps):
    found = Limits({order: limit_of(ramp, PROTOCOL, BOX) for order, ramp in ramps.items()}, BOX)
    low, high = (limit.alone.std for limit in found.by_order.values())
    assert low == pytest.approx(high, rel=0.05)
    assert found.not_converged == ()


def test_three_scalars_know_less_than_the_image_they_are_made_of(ramp):
    image, scalars = (
        limit_of(ramp, replace(PROTOCOL, observable=observable), BOX).alone for observable in ("image", "scalars")
    )
    assert (scalars.std > 1.5 * image.std).all()


def test_the_reference_alone_says_nothing_of_the_inclusion(ramp):
    for press in observed_presses(ramp, "displacement"):
        assert set(press.reference_derivatives).isdisjoint(("size_mm", "depth_mm", "youngs_modulus_kpa"))
        assert len(press.contrast) == len(rings_of(ramp).r_mm)
        # in small strain the contrast is the same at every force
        assert press.derivatives["force_n"] == pytest.approx(0, abs=1e-6)


def bound(*std):
    return CramerRao(np.array(std), np.eye(3), np.eye(3)[2], std[-1])


def test_the_larger_order_is_quoted_and_a_difference_is_named():
    low, high = Limit(bound(0.1, 0.1, 1.0), bound(0.1, 0.1, 0.7)), Limit(bound(0.11, 0.09, 1.3), bound(0.1, 0.09, 0.75))
    found = Limits({3: low, 4: high}, BOX)
    assert found.std == pytest.approx([0.11, 0.1, 1.3])
    assert found.not_converged == ("youngs_modulus_kpa",)
    assert found.quoted is high
    assert found.identifiable == (True, True, False)


def test_what_is_identifiable_is_under_half_of_the_box():
    at = Limit(bound(*BOX), bound(*(BOX * [0.49, 0.51, 0.49])))
    assert Limits({3: at}, BOX).identifiable == (True, False, True)


def test_the_spreads_of_a_protocol_are_those_of_the_probes_ranges():
    protocol = PressProtocol()
    for name, spread in {
        "tissue_modulus_kpa": protocol.tissue_modulus_spread_ratio,
        "slab_thickness_mm": protocol.thickness_spread_ratio,
        "contact_pressure_kpa": protocol.contact_law_spread_ratio,
        "albedo": protocol.albedo_spread_ratio,
        "spread_mm": protocol.scattering_spread_ratio,
    }.items():
        entry = RANGES[name]
        relative = (
            np.log(entry.high / entry.low)
            if entry.by_ratio
            else 2 * (entry.high - entry.low) / (entry.high + entry.low)
        )
        assert spread == pytest.approx(relative / 12**0.5, rel=0.02), name


def test_a_scene_without_an_inclusion_has_no_bounds():
    with pytest.raises(InvalidQuantity, match="inclusion"):
        limits(Scene(None), PROTOCOL)
