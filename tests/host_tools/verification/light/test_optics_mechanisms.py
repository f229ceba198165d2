"""What the simulated light does: trapped, invisible in a dimple, seen in contact, and telling by pressure."""

from __future__ import annotations

import numpy as np
import pytest

from host_tools.verification.light import press as press
from host_tools.verification.light.contact import brightening, gain_of_doubling
from host_tools.verification.light.dimple import dark_name, gap_name
from host_tools.verification.light.scenes import MECHANISMS, brightest, centre, face, slope_deg, traced
from host_tools.verification.light.statistics import noise_by_rays, noise_found
from host_tools.verification.light.trapping import contrast, with_black_walls

RAYS = 100_000


def test_slopes_are_those_of_a_gaussian() -> None:
    """w = A exp(-r2 / 2 s2) is steepest at r = s: A / s exp(-1/2)."""
    assert slope_deg(0.8) == pytest.approx(9.19, abs=0.01)
    w_mm = face(0.8).w_mm
    steepest = np.hypot(*np.gradient(w_mm, 24 / (len(w_mm) - 1))).max()
    assert np.degrees(np.arctan(steepest)) == pytest.approx(slope_deg(0.8), abs=0.05)


def test_skin_touches_the_round_face_only() -> None:
    contact = MECHANISMS["flat, contact 1"].face.contact_ratio
    assert contact.sum() / contact.size == pytest.approx(np.pi * 11**2 / 24**2, rel=0.02)


def test_above_the_square_root_of_two_not_one_ray_leaves_an_untouched_face() -> None:
    assert with_black_walls(1.42, RAYS).ledger["through_face"] == 0.0
    assert with_black_walls(1.41, RAYS).ledger["bottom"] < 1e-3


def test_contact_is_a_hundred_times_as_bright_as_a_gap_of_air() -> None:
    assert contrast(RAYS) > 100


def test_no_dimple_of_a_press_sends_light_into_the_lens() -> None:
    assert traced(dark_name(1.5), RAYS).specular_into_aperture == 0.0
    assert traced(dark_name(1.5), RAYS).bottom_loss > 0.03


def test_across_air_a_dimple_shines_beside_its_centre() -> None:
    found = traced(gap_name(1.5), RAYS)
    most, at_mm = brightest(found)
    assert at_mm > 3
    assert most > 10 * centre(found)


def test_in_complete_contact_a_dimple_is_darker_than_the_flat_face() -> None:
    assert brightening("dimple 1.5, contact 1", "flat, contact 1", RAYS) < 0.9


def test_twice_the_pressure_gives_less_than_twice_the_light() -> None:
    assert 1.1 < gain_of_doubling(RAYS) < 1.5


def test_the_image_of_an_inclusion_is_that_of_its_pressure() -> None:
    inclusion, bent, pressed, wet = (press.signal(name, RAYS) for name in press.CASES)
    assert inclusion == pytest.approx(pressed, abs=0.05)
    assert inclusion > 0.1
    assert abs(bent) < 0.05
    assert abs(wet) < 0.05


def test_the_noise_is_as_large_as_stated_and_halves_with_four_times_the_rays() -> None:
    noise = list(noise_by_rays(RAYS).values())
    assert noise[1] / noise[3] == pytest.approx(4.0, rel=0.15)
    assert noise_found(RAYS) == pytest.approx((1.0, 1.0), abs=0.1)
