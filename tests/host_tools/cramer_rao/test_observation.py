"""What is seen of two presses: the camera's noise on paper, smooth errors, gain, zero, and the reference response."""

from dataclasses import replace

import numpy as np
import pytest

from host_tools.cramer_rao.observation import GAIN, ZERO, observe, variance_counts, with_reference_response
from host_tools.cramer_rao.observed_press import ObservedPress
from host_tools.cramer_rao.protocol import PressProtocol
from host_tools.cramer_rao.rings import Rings

RINGS = Rings.within(0.9)
COUNT = len(RINGS.r_mm)
CALM = PressProtocol(forces_n=(0.3, 0.6), systematic_ratio=0.0)


def press(force_n, reference, contrast):
    light = reference * (1 + contrast)
    by_force = 0.6 * (1 + contrast)
    growing = {"force_n": np.full(COUNT, 0.6), "tissue_modulus_kpa": np.full(COUNT, -0.1 * force_n)}
    derivatives = {"force_n": 0.2 * contrast, "tissue_modulus_kpa": -contrast, "size_mm": 2 * contrast}
    return ObservedPress(force_n, contrast, derivatives, by_force, light, reference, growing)


SEEN = (
    press(0.3, np.array([2.0, 1.8, 1.5]), np.array([0.1, 0.08, 0.05])),
    press(0.6, np.array([4.0, 3.5, 3.0]), np.array([0.2, 0.15, 0.1])),
)


def test_the_variance_of_a_full_pixel_is_that_of_its_electrons():
    """10 000 electrons at full scale, 4 of read noise, and a count's rounding."""
    per_count = 10_000 / 255
    assert variance_counts(np.array([255.0, 0.0])) == pytest.approx(
        [10_016 / per_count**2 + 1 / 12, 16 / per_count**2 + 1 / 12]
    )


def test_four_times_the_frames_have_a_quarter_of_the_variance():
    few, many = (observe(SEEN, RINGS, replace(CALM, frames=n, reference_frames=n)) for n in (10, 40))
    assert many.covariance == pytest.approx(few.covariance / 4)
    assert few.covariance == pytest.approx(np.diag(few.covariance.diagonal()))


def test_no_frame_takes_away_a_smooth_error():
    rough = replace(CALM, systematic_ratio=0.002, frames=10**6, reference_frames=10**6)
    covariance = observe(SEEN, RINGS, rough).covariance
    first, second = (1 + SEEN[i].contrast[0] for i in (0, 1))
    near_axis = RINGS.coupling(2.0)[0, 0], RINGS.coupling(3.0)[0, 0]
    assert covariance[0, 0] == pytest.approx(4e-6 * (near_axis[0] * first**2 + near_axis[1]), rel=1e-3)
    assert covariance[0, COUNT] == pytest.approx(4e-6 * near_axis[0] * first * second)  # the common part alone


def test_a_gain_adds_itself_to_one_and_the_contrast():
    expected = 1 + np.concatenate([one.contrast for one in SEEN])
    assert observe(SEEN, RINGS, CALM).derivatives[GAIN] == pytest.approx(expected)


def test_a_zero_of_the_cell_counts_double_at_half_the_force():
    by_zero = observe(SEEN, RINGS, CALM).derivatives[ZERO] / np.concatenate([one.by_force_error for one in SEEN])
    assert by_zero == pytest.approx(np.repeat([1 / 0.3, 1 / 0.6], COUNT))


def rows(log_lights):
    """Return contrasts and reference response of the logarithms of lights and references, as an image gives them."""
    light, reference = np.split(log_lights, 2)
    return np.concatenate([np.exp(light - reference) - 1, reference[:COUNT] - reference[COUNT:]])


def test_reference_response_shares_the_noise_of_the_reference_with_the_contrast():
    """The covariance of the rows is that of the light, through their derivatives by it."""
    logs = np.log(np.concatenate([one.light for one in SEEN] + [one.reference for one in SEEN]))
    level = np.exp(logs) * 100 / np.average(SEEN[1].reference, weights=RINGS.pixels)
    variance = variance_counts(level) / level**2 / 5 / np.tile(RINGS.pixels, 4)
    steps = 1e-6 * np.eye(len(logs))
    slope = np.stack([rows(logs + s) - rows(logs - s) for s in steps], axis=1) / 2e-6
    found = with_reference_response(observe(SEEN, RINGS, CALM), SEEN, RINGS, CALM)
    assert found.values == pytest.approx(rows(logs))
    expected = slope @ np.diag(variance) @ slope.T
    assert found.covariance == pytest.approx(expected, rel=1e-6, abs=1e-9 * expected.max())


def test_reference_response_tells_of_the_tissue_and_nothing_of_the_inclusion():
    found = with_reference_response(observe(SEEN, RINGS, CALM), SEEN, RINGS, CALM).derivatives
    assert found["tissue_modulus_kpa"][-COUNT:] == pytest.approx(np.full(COUNT, 0.03))
    assert not found["size_mm"][-COUNT:].any()
    assert not found[GAIN][-COUNT:].any()


def test_one_load_does_not_grow():
    alone = replace(CALM, forces_n=(0.6,))
    observed = observe(SEEN[1:], RINGS, alone)
    assert with_reference_response(observed, SEEN[1:], RINGS, alone).values == pytest.approx(observed.values)
