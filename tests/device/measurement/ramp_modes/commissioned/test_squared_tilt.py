"""Second order of a ratio of two lights that lean: told by what is seen of it, against the ratio itself."""

import numpy as np
import pytest

from device.measurement.ramp_modes.commissioned.squared_tilt import LEFT_STD, of_habit, of_leaning
from device.measurement.ramp_modes.noise import LOADS
from device.measurement.ramp_modes.radial_profile import CONTRAST, SECOND, SECOND_ACROSS
from device.measurement.recording.ring_means import RINGS

ANGLE_RAD = np.arange(64) * 2 * np.pi / 64
RADIUS = np.stack([np.cos(ANGLE_RAD), np.sin(ANGLE_RAD)])
P, B = np.array([0.7, -0.3]), np.array([-0.2, 0.9])
PARTS = CONTRAST, SECOND, SECOND_ACROSS


def even_orders(first_harmonic):
    """Mean and second harmonics, along and across, of the ratio with tilts of this size in one ring."""
    ratio = (1 + first_harmonic * P @ RADIUS) / (1 + first_harmonic * B @ RADIUS)
    return np.array([
        ratio.mean() - 1, 2 * np.mean(ratio * np.cos(2 * ANGLE_RAD)), 2 * np.mean(ratio * np.sin(2 * ANGLE_RAD))
    ])  # fmt: skip


def second_order(first_harmonic):
    """The same by what is told of d = P - B, and by the rest, which here is known."""
    squares, leant = np.full((1, LOADS, RINGS), first_harmonic**2), (P - B)[None]
    told, factor = of_leaning(squares, leant)
    of_rest = factor[0, :, :2] @ (B + leant[0] / 2) / LEFT_STD
    return np.array([(told[0] - of_rest)[part][10] for part in PARTS])


def test_told_and_untold_together_are_the_ratio_to_second_order():
    """In ring means and second harmonics the fourth order is next: half the tilt, a sixteenth of the error."""
    errors = [np.linalg.norm(second_order(size) - even_orders(size)) for size in (0.2, 0.1)]
    assert np.linalg.norm(even_orders(0.1)) > 0.003
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.15)


def further_std(factor):
    """Largest standard deviation of higher orders in ring means and second harmonics of the first press."""
    return [np.sqrt(np.sum(factor[0, part, -3 * (RINGS - 1) :] ** 2, axis=1)).max() for part in PARTS]


def test_higher_orders_grow_with_the_cube_of_the_first_harmonic():
    squares = [np.full((1, LOADS, RINGS), first_harmonic**2) for first_harmonic in (0.1, 0.2)]
    levels = [further_std(of_leaning(one, np.ones((1, 2)))[1]) for one in squares]
    assert np.divide(*levels[::-1]) == pytest.approx(8.0)


@pytest.mark.parametrize("leant", [0.0, 1.0, 2.0, 6.0, None])
def test_higher_orders_are_of_the_larger_tilt_that_may_be_behind_what_is_seen(leant):
    """Of tilts drawn with that difference, or with any, against a quarter of their cube, root mean square."""
    p, b = np.random.default_rng(2).standard_normal((2, 200_000, 2))
    squares = np.full((1, LOADS, RINGS), 0.1**2)
    if leant is None:
        _, factor = of_habit(squares)
    else:
        middle, half = (p + b) / 2, np.array([leant, 0.0]) / 2
        p, b = middle + half, middle - half
        _, factor = of_leaning(squares, 2 * half[None])
    sixth = np.mean(np.maximum(np.sum(p**2, axis=1), np.sum(b**2, axis=1)) ** 3)
    assert further_std(factor) == pytest.approx([0.25 * 0.1**3 * sixth**0.5] * 3, rel=0.03)


def test_before_anything_is_seen_a_habit_is_the_mean_over_all_tilts():
    rng = np.random.default_rng(1)
    tilts = rng.standard_normal((20, 1_000, 2, 2))
    squares = np.broadcast_to(np.linspace(0.0, 0.04, RINGS), (1_000, LOADS, RINGS))
    told = np.mean([of_leaning(squares, part[:, 0] - part[:, 1])[0].mean(axis=0) for part in tilts], axis=0)
    shift, factor = of_habit(squares[:1])
    tilts = tilts.reshape(-1, 2, 2)
    assert told == pytest.approx(shift[0], abs=0.03 * shift.max())
    e = tilts[:, 1, 0] ** 2 + tilts[:, 1, 1] ** 2 - np.sum(tilts[:, 0] * tilts[:, 1], axis=1)
    assert np.sqrt(np.sum(factor[0, CONTRAST, :3] ** 2, axis=1)).max() == pytest.approx(0.04 * np.std(e / 2), rel=0.05)
