"""The modulus inside its box: spreads and shares that are known on paper."""

import numpy as np
import pytest

from host_tools.cramer_rao.accuracy_tables import (
    BOX,
    LN_MODULUS,
    MODULUS,
    NARROW,
    determined_share,
    posterior_spread,
    std_of_modulus,
    visible_line,
)
from host_tools.cramer_rao.bounds import Limit, Limits
from host_tools.cramer_rao.information import CramerRao

MODULI_KPA = (15.0, 40.0, 80.0, 120.0)
LN_BOX = np.log(BOX.high / BOX.low)


def even_line(std):
    return visible_line(MODULI_KPA, np.full(4, std))


def test_a_bound_that_is_one_everywhere_makes_a_line_of_so_many_standard_deviations():
    np.testing.assert_allclose(even_line(0.2), (LN_MODULUS - LN_MODULUS[0]) / 0.2, atol=1e-9)


def test_a_bound_in_proportion_to_the_modulus_makes_the_line_one_over_it():
    """d(line) = d(ln E) / (0.01 E): it runs as 100 / E, straight on beyond the first and last modulus."""
    line = visible_line(MODULI_KPA, 0.01 * np.array(MODULI_KPA))
    np.testing.assert_allclose(line, 100 / BOX.low - 100 / np.exp(LN_MODULUS), rtol=1e-4, atol=1e-9)


def test_in_the_middle_a_posterior_is_as_wide_as_its_bound_and_at_an_end_as_half_a_gaussian():
    """Root of 1 - 2 / pi of it."""
    line = even_line(0.1)
    middle, end = posterior_spread(line, np.array([line[-1] / 2, line[-1]]))
    assert middle == pytest.approx(0.1, rel=1e-3)
    assert end == pytest.approx(0.1 * (1 - 2 / np.pi) ** 0.5, rel=0.03)


def test_what_says_nothing_leaves_the_spread_of_the_box_and_is_never_determined():
    line = even_line(1000.0)
    assert posterior_spread(line, np.array([0.0]))[0] == pytest.approx(LN_BOX / 12**0.5, rel=0.01)
    assert determined_share(line, 120.0) == 0.0


def test_a_place_far_outside_the_box_leaves_its_end_alone():
    line = even_line(0.1)
    assert posterior_spread(line, np.array([line[-1] + 40.0]))[0] < 0.01


def test_an_image_that_only_rules_out_the_softer_part_determines_the_modulus():
    """Nothing is known above 60 kPa: the rest of the box is even, with a spread of ln(160 / 60) / sqrt(12)."""
    line = np.where(np.exp(LN_MODULUS) < 60.0, -100.0, 0.0)
    found = posterior_spread(line, np.array([0.0]))[0]
    assert found == pytest.approx(np.log(160 / 60) / 12**0.5, rel=0.02)
    assert found < NARROW


def test_one_number_may_be_determined_at_the_end_of_the_box_and_not_in_its_middle():
    """A bound of 0.45 is over half of the box's 0.80, and 0.60 of it is under: at 160 kPa the exact error counts."""
    line = even_line(0.45)
    assert determined_share(line, 40.0) < 0.2
    assert determined_share(line, 160.0) > 0.8


def test_the_gaussian_box_is_taken_away_from_the_modulus_alone():
    alone, box = np.array([0.3, 0.2, 0.7]), np.array([0.4, 0.4, 0.8])
    bound = CramerRao(1 / np.hypot(1 / alone, 1 / box), np.eye(3), np.eye(3)[2], 1.0)
    assert std_of_modulus(Limits({3: Limit(bound, bound)}, box)) == pytest.approx(alone[MODULUS])
    known = CramerRao(box, np.eye(3), np.eye(3)[2], 1.0)
    assert std_of_modulus(Limits({3: Limit(known, known)}, box)) == pytest.approx(1000.0)
