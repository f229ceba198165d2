"""Presses in and around the trained ranges, and polynomials over them."""

import numpy as np
import pytest

from device.measurement.parameters import ABOVE_BASE_MM, HIGH, LOW, PARAMETERS, RANGES, normalise
from device.measurement.ramp_modes.legendre import LegendreSum
from device.measurement.ramp_modes.surrogate import (
    DEPTH,
    INCLUSION_COLUMNS,
    MODULUS,
    RESPONSE_COLUMNS,
    SIZE,
    WAVES,
    PressSurrogate,
    polynomial_coordinates,
)
from host_tools.press_models.train_range import (
    DEPTHS,
    SIZES,
    THICKNESS,
    WideSurrogate,
    draw_wide_parameters,
    is_outside,
    wide_coordinates,
)
from host_tools.probe_tables.out_of_range_table import deepest_mm

COUNT = 4000


@pytest.fixture(scope="module")
def drawn() -> np.ndarray:
    return draw_wide_parameters(COUNT, np.random.default_rng(1), inclusions_a_skin=2)


def test_sizes_and_depths_reach_beyond_the_trained_ranges_on_every_side(drawn):
    for column, (low, high), name in ((SIZE, SIZES, "size_mm"), (DEPTH, DEPTHS, "depth_mm")):
        assert low < RANGES[name].low < RANGES[name].high < high
        assert drawn[:, column].min() == pytest.approx(low, abs=0.05)
        assert drawn[:, column].max() == pytest.approx(high, abs=0.3)


def test_everything_else_stays_in_its_range(drawn):
    others = np.arange(len(PARAMETERS)) > DEPTH
    assert others[MODULUS]
    assert (drawn[:, others] >= LOW[others]).all()
    assert (drawn[:, others] <= HIGH[others]).all()


def test_no_inclusion_touches_the_base_or_lies_deeper_than_the_table(drawn):
    size_mm, depth_mm = drawn[:, SIZE], drawn[:, DEPTH]
    assert (size_mm + depth_mm <= drawn[:, THICKNESS] - ABOVE_BASE_MM).all()
    assert all(depth <= deepest_mm(size) for size, depth in zip(size_mm, depth_mm, strict=True))


def test_inclusions_share_tissue_and_skin_and_not_their_place(drawn):
    skin = slice(THICKNESS, PARAMETERS.index("spread_mm") + 1)
    np.testing.assert_array_equal(drawn[::2, skin], drawn[1::2, skin])
    assert (drawn[::2, :2] != drawn[1::2, :2]).all()


def test_about_half_of_the_presses_lie_outside(drawn):
    outside = is_outside(normalise(drawn))
    assert 0.4 < outside.mean() < 0.65
    expected = (drawn[:, SIZE] < 2) | (drawn[:, SIZE] > 15) | (drawn[:, DEPTH] < 4) | (drawn[:, DEPTH] > 12)
    np.testing.assert_array_equal(outside, expected)


def test_coordinates_are_one_at_the_wide_ends_and_elsewhere_the_probes_own(drawn):
    ends = drawn[:2].copy()
    ends[:, :2] = np.transpose([SIZES, DEPTHS])
    np.testing.assert_allclose(wide_coordinates(ends)[:, :2], [[-1, -1], [1, 1]])
    own = polynomial_coordinates(normalise(drawn), drawn)
    np.testing.assert_array_equal(wide_coordinates(drawn)[:, 2:], own[:, 2:])


def test_rows_are_put_together_as_the_probes_own_surrogate_does(drawn):
    """Polynomials that do not depend on size and depth are the same in either coordinates."""
    rng = np.random.default_rng(3)
    degrees = rng.integers(0, 3, (6, len(PARAMETERS))).astype(np.uint8)
    degrees[:, :2] = 0
    columns_of = INCLUSION_COLUMNS, len(WAVES) * INCLUSION_COLUMNS, RESPONSE_COLUMNS
    fields = [LegendreSum(degrees, rng.normal(size=(6, columns))) for columns in columns_of]
    inside, direction_rad = drawn[~is_outside(normalise(drawn))][:20], rng.uniform(0, 2 * np.pi, 20)
    found = WideSurrogate(*fields).rows(inside, direction_rad)
    expected = PressSurrogate(*fields).rows(normalise(inside), direction_rad)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
    assert (found != WideSurrogate(*fields).rows(inside, direction_rad + 1.0)).any(axis=1).all()
