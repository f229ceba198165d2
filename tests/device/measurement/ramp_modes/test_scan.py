"""Where a scan's fit begins and what a further press is worth, on toys whose bound is known on paper."""

import numpy as np
import pytest
from small_surrogate import COLUMNS, REACH_MM, LinearRows, white_noise

from device.measurement.parameters import COUNT, HIGH, PARAMETERS
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.ramp_modes.radial_profile import CONTRAST, FIRST
from device.measurement.ramp_modes.scan import OFFSETS_TRIED_MM, scan_starts, worth_of_places
from device.measurement.ramp_modes.surrogate import MODULUS, OFFSET, SIZE, direction_waves

STD, SLOPE, ALONG = 1e-3, 0.002, 1.5
PLACES_MM = (0.0, 2.0, 4.0, 6.0)
K = len(PARAMETERS)


def coordinates(offsets_mm, reach_mm=REACH_MM):
    """Return coordinates [8 + N] of an inclusion in the middle of the ranges, at offsets [N]."""
    return np.append(np.zeros(OFFSET), 2 * np.asarray(offsets_mm, float) / reach_mm - 1)


def rows_of(surrogate, offsets_mm, direction_rad=None):
    each = [coordinates([offset_mm], HIGH[OFFSET]) for offset_mm in offsets_mm]
    return surrogate.rows(np.array(each), direction_rad)


class FadingRows:
    """The contrast tells the size, less so the further aside; the first harmonic tells the offset. 0 in the middle.

    Along the image's rows the harmonic is `ALONG` times as large, across them as much smaller.
    """

    to_mm = REACH_MM

    def rows(self, normalised, direction_rad=None):
        return self.rows_and_jacobian(normalised, direction_rad)[0]

    def rows_and_jacobian(self, normalised, direction_rad=None):
        unknown = np.full(len(normalised), np.nan)
        wave = direction_waves(unknown if direction_rad is None else direction_rad)[:, :1]
        per_mm = 0.05 * (1 + (ALONG - 1) * wave)
        offset_mm = (normalised[:, OFFSET] + 1) / 2 * HIGH[OFFSET]
        seen = (1 - offset_mm / REACH_MM)[:, None]
        rows, jacobian = np.zeros((len(normalised), COLUMNS)), np.zeros((len(normalised), COLUMNS, K))
        rows[:, CONTRAST] = SLOPE * normalised[:, [SIZE]] * seen
        rows[:, FIRST] = per_mm * offset_mm[:, None]
        jacobian[:, CONTRAST, SIZE] = SLOPE * seen
        jacobian[:, CONTRAST, OFFSET] = -SLOPE * normalised[:, [SIZE]] / REACH_MM * HIGH[OFFSET] / 2
        jacobian[:, FIRST, OFFSET] = per_mm * HIGH[OFFSET] / 2
        return rows, jacobian


@pytest.mark.parametrize(
    ("offsets_mm", "begun_mm"), [((0.3, 4.5), (0.3, 4.5)), ((3.0, 7.5, 1.5), (3.0, 7.5, 1.5)), ((0.7, 5.4), (0.3, 6.0))]
)
def test_each_press_begins_at_the_offset_of_those_tried_that_explains_it_best(offsets_mm, begun_mm):
    """Without noise that is where it lies, or the nearest one."""
    surrogate = FadingRows()
    (start,) = scan_starts(rows_of(surrogate, offsets_mm), np.zeros((1, COUNT)), surrogate, white_noise(STD), REACH_MM)
    np.testing.assert_allclose(start, coordinates(begun_mm), atol=1e-12)


ROWS_ACROSS = np.array([0.0, np.pi / 2])
"""The first press lies along the image's rows, the second across."""


@pytest.mark.parametrize(
    ("told_rad", "begun_mm"),
    [
        (ROWS_ACROSS, (3.0, 3.0)),
        (ROWS_ACROSS + np.pi, (3.0, 3.0)),
        (None, (4.5, 1.5)),
        (np.full(2, np.nan), (4.5, 1.5)),
        (ROWS_ACROSS[::-1], (7.5, 1.5)),
        (np.array([0.0, np.nan]), (3.0, 1.5)),
    ],
)
def test_each_press_begins_where_it_is_explained_best_in_its_own_direction(told_rad, begun_mm):
    """At 3 mm the harmonics are those of 4.5 and 1.5 mm in any direction; of 9 and 1 mm in each other's."""
    surrogate = FadingRows()
    rows = rows_of(surrogate, (3.0, 3.0), ROWS_ACROSS)
    noise = white_noise(STD)
    (start,) = scan_starts(rows, np.zeros((1, COUNT)), surrogate, noise, REACH_MM, told_rad)
    np.testing.assert_allclose(start, coordinates(begun_mm), atol=1e-12)


def test_there_is_a_start_for_each_first_guess_with_nuisances_in_the_middle():
    guesses = np.random.default_rng(1).uniform(-0.9, 0.9, (3, COUNT))
    surrogate = FadingRows()
    starts = scan_starts(rows_of(surrogate, (0.3, 4.5)), guesses, surrogate, white_noise(STD), REACH_MM)
    assert starts.shape == (3, OFFSET + 2)
    np.testing.assert_array_equal(starts[:, :COUNT], guesses)
    np.testing.assert_array_equal(starts[:, COUNT:OFFSET], 0.0)
    tried = 2 * OFFSETS_TRIED_MM / REACH_MM - 1
    assert np.isin(starts[:, OFFSET:], tried).all()


def parts_of(surrogate, noise, offsets_mm=(0.0,), direction_rad=None):
    """Return what a further press is worth at each of the places [n, 3], after presses without noise."""
    rows = rows_of(surrogate, offsets_mm, direction_rad)
    return worth_of_places(rows, coordinates(offsets_mm), surrogate, noise, REACH_MM, PLACES_MM, direction_rad)


def test_with_errors_that_are_each_presss_own_a_repeated_press_counts_as_much_as_the_first():
    """The precision of the size is p = 44 (slope / std)^2 a press, and 3 of its even prior: p + 3 becomes 2 p + 3."""
    p = (CONTRAST.stop - CONTRAST.start) * (SLOPE / STD) ** 2
    parts = parts_of(FadingRows(), white_noise(STD))
    assert parts.shape == (len(PLACES_MM), COUNT)
    assert parts[0, SIZE] == pytest.approx(np.sqrt((p + 3) / (2 * p + 3)), rel=1e-9)


class TurnedRows(FadingRows):
    """The contrast tells twice as much of the size along the image's rows, and nothing across them."""

    def rows_and_jacobian(self, normalised, direction_rad=None):
        rows, jacobian = super().rows_and_jacobian(normalised)
        unknown = np.full(len(normalised), np.nan)
        times = 1 + direction_waves(unknown if direction_rad is None else direction_rad)[:, :1]
        rows[:, CONTRAST] *= times
        jacobian[:, CONTRAST] *= times[..., None]
        return rows, jacobian


@pytest.mark.parametrize(("direction", "times"), [(0.0, 2.0), (np.pi / 6, 1.5), (np.pi / 2, 0.0), (np.nan, 1.0)])
def test_presses_so_far_count_in_their_own_direction_and_a_further_one_in_any(direction, times):
    """The hand chooses where to press, and not in which direction: the further press is that of the mean of them."""
    p = (CONTRAST.stop - CONTRAST.start) * (SLOPE / STD) ** 2
    size = parts_of(TurnedRows(), white_noise(STD), direction_rad=np.array([direction]))[:, SIZE]
    before = times**2 * p + 3
    assert size[0] == pytest.approx(np.sqrt(before / (before + p)), rel=1e-9)
    assert size[2] == pytest.approx(np.sqrt(before / (before + p / 4)), rel=1e-9)


def test_the_further_aside_the_less_a_press_with_errors_of_its_own_tells():
    """A half of the signal at 4 mm: p (1 + 1 / 4) + 3."""
    p = (CONTRAST.stop - CONTRAST.start) * (SLOPE / STD) ** 2
    size = parts_of(FadingRows(), white_noise(STD))[:, SIZE]
    assert size[2] == pytest.approx(np.sqrt((p + 3) / (1.25 * p + 3)), rel=1e-9)
    assert (np.diff(size) > 0).all()


def test_what_no_press_tells_no_further_one_narrows():
    parts = parts_of(FadingRows(), white_noise(STD))
    np.testing.assert_allclose(np.delete(parts, SIZE, axis=1), 1.0, atol=1e-12)


SHARED = ErrorLevels(
    gain_ratio=0.0, zero_n=0.0, flat_field_ratio=0.002, flat_field_mm=1e3, model_ratio=0.0, reference_ratio=0.0
)
"""A flat field that is one number all over the face, as large as the size's signal."""


def test_a_press_at_the_same_place_shares_its_flat_field_and_a_displaced_one_tells_it_apart():
    """The error common to both stays at one place; where the signal is a half, the difference of both is free of it.

    Then half the signal is left, with the camera's noise of two presses: p (1 - 1 / 2)^2 / 2, as if nothing shared.
    """
    parts = parts_of(FadingRows(), white_noise(STD / 10, SHARED))[:, SIZE]
    assert parts[0] > 0.98
    assert parts[2] < 0.05
    p = (CONTRAST.stop - CONTRAST.start) * (10 * SLOPE / STD) ** 2
    alone = 1 / (p**-1 + (SHARED.flat_field_ratio / SLOPE) ** 2) + 3
    assert parts[2] == pytest.approx(np.sqrt(alone / (p / 8 + 3)), rel=0.05)


@pytest.mark.parametrize("levels", [SHARED, ErrorLevels()])
@pytest.mark.parametrize("offsets_mm", [(0.0,), (0.5, 4.0)])
def test_a_further_press_never_widens_what_is_known(levels, offsets_mm):
    parts = parts_of(FadingRows(), white_noise(STD, levels), offsets_mm)
    assert (parts <= 1 + 1e-9).all()
    assert (parts > 0).all()


def test_presses_that_see_the_same_mixture_of_size_and_modulus_narrow_neither():
    """Here every place sees the same mixture, and no press tells the modulus from the size."""
    slopes = np.zeros((K, COLUMNS))
    slopes[SIZE, CONTRAST], slopes[MODULUS, CONTRAST] = SLOPE, SLOPE
    parts = parts_of(LinearRows(slopes), white_noise(STD / 10))
    assert (parts[:, [SIZE, MODULUS]] > 0.99).all()
