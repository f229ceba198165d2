"""The camera's noise against the EMVA 1288 model: mean, standard deviation, saturation, seed."""

import math
from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.tactile_image import saturated_ratio
from device.simulation.physics.sensor import Sensor

SHAPE = (200, 300)
SENSOR = Sensor(gain_spread_ratio=0.0, offset_spread_e=0.0, dark_e_per_s=0.0, hot_pixel_ratio=0.0)
"""Without fixed pattern: its own tests are at the end."""
COUNTS_PER_E = 255 / SENSOR.full_well_e


def exposed(intensity, *, sensor=SENSOR, exposure_us=4000.0, gain=1.0, seed=(1, 1)):
    image = np.full(SHAPE, intensity, np.float32)
    return sensor.expose(image, exposure_us=exposure_us, gain=gain, seed=seed)


def test_the_same_seed_is_the_same_frame_and_another_frame_number_is_another():
    np.testing.assert_array_equal(exposed(0.3, seed=(5, 9)), exposed(0.3, seed=(5, 9)))
    assert (exposed(0.3, seed=(5, 9)) != exposed(0.3, seed=(5, 10))).mean() > 0.5
    assert (exposed(0.3, seed=(5, 9)) != exposed(0.3, seed=(6, 9))).mean() > 0.5


@pytest.mark.parametrize(("intensity", "gain"), [(0.1, 1.0), (0.3, 1.0), (0.05, 6.0)])
def test_the_mean_is_the_light_in_electrons_times_the_gain_above_black(intensity, gain):
    """5 e-/us for 4000 us at intensity 1 are 20 000 e-."""
    expected = intensity * 20_000 * gain * COUNTS_PER_E + 4
    assert exposed(intensity, gain=gain).mean() == pytest.approx(expected, abs=0.05)


@pytest.mark.parametrize(("intensity", "gain"), [(0.1, 1.0), (0.4, 1.0), (0.01, 16.0), (0.03, 8.0)])
def test_the_noise_is_that_of_photons_and_readout(intensity, gain):
    """Variance e + read^2 in electrons; rounding to counts adds 1/12."""
    electrons = intensity * 20_000
    noise_counts = math.sqrt((electrons + SENSOR.read_noise_e**2) * (gain * COUNTS_PER_E) ** 2 + 1 / 12)
    assert exposed(intensity, gain=gain).std() == pytest.approx(noise_counts, rel=0.02)


def test_read_noise_remains_when_there_is_no_light():
    """40 e- at gain 16 are 16 counts; a black level of 100 keeps them above zero."""
    sensor = replace(SENSOR, read_noise_e=40.0, black_level_counts=100.0)
    assert exposed(0.0, sensor=sensor, gain=16.0).std() == pytest.approx(40 * 16 * COUNTS_PER_E, rel=0.02)


def test_a_dark_frame_is_the_black_level():
    assert (exposed(0.0) == 4).all()
    assert (exposed(-0.5) == 4).all()


@pytest.mark.parametrize("seen", [{"intensity": 1.0}, {"intensity": 0.3, "gain": 4.0}])
def test_too_much_light_or_gain_saturates_at_full_scale(seen):
    assert (exposed(**seen) == 255).all()


def test_a_full_well_holds_no_more_electrons():
    """Full well at half of the scale, by a gain of one half: 127.5 + 4 counts, without noise."""
    counts = exposed(5.0, gain=0.5)
    assert np.unique(counts).tolist() == [132]


def test_ten_bits_resolve_a_quarter_of_a_count():
    """The same light: four times the counts, up to 1023, black level scaled with them; at the top of 16 bits."""
    fine = replace(SENSOR, bits=10)
    assert exposed(0.3, sensor=fine).dtype == np.uint16
    assert not (exposed(0.3, sensor=fine) % 64).any()
    assert exposed(0.3, sensor=fine).mean() / 64 == pytest.approx((exposed(0.3).mean()) * 1023 / 255, abs=0.2)
    assert (exposed(1.0, sensor=fine) == 1023 * 64).all()
    assert saturated_ratio(exposed(1.0, sensor=fine)) == 1.0


def test_ambient_light_is_there_with_the_leds_off():
    lit = replace(SENSOR, ambient_intensity=0.1)
    assert exposed(0.0, sensor=lit).mean() == pytest.approx(exposed(0.1).mean(), abs=0.02)


def test_the_mean_of_many_frames_forgets_the_noise():
    """Frames share a pool of noise, each at a place of its own: 64 of them average as independent ones do."""
    mean = np.mean([exposed(0.3, seed=(5, n)) for n in range(1, 65)], axis=0, dtype=float)
    assert mean.std() == pytest.approx(exposed(0.3).std() / 8, rel=0.05)


def test_pixels_differ_in_gain_and_always_the_same_way():
    """PRNU of 5 %: two mean frames of different seeds have the same pattern, another sensor has another."""
    sensor = replace(SENSOR, gain_spread_ratio=0.05)
    first, second = (
        np.mean([exposed(0.3, sensor=sensor, seed=(s, n)) for n in range(1, 33)], axis=0, dtype=float) - 4
        for s in (1, 2)
    )
    assert first.std() / first.mean() == pytest.approx(0.05, rel=0.05)
    assert np.corrcoef(first.ravel(), second.ravel())[0, 1] > 0.95
    other = exposed(0.3, sensor=replace(sensor, pattern_seed=8))
    assert abs(np.corrcoef(first.ravel(), other.ravel())[0, 1]) < 0.05


def test_hot_pixels_shine_in_the_dark_and_in_proportion_to_time():
    sensor = replace(SENSOR, hot_pixel_ratio=1e-3, hot_pixel_e_per_s=1e5)
    short, long = (exposed(0.0, sensor=sensor, exposure_us=us).astype(float) - 4 for us in (20_000.0, 40_000.0))
    hot = long > 20
    assert 10 < hot.sum() < 120  # of 60 000 pixels one in a thousand, most of them warm
    assert np.median(long[hot] / np.maximum(short[hot], 1)) == pytest.approx(2.0, rel=0.1)
    again = exposed(0.0, sensor=sensor, exposure_us=40_000.0, seed=(9, 9)).astype(float) - 4
    assert (again[long > 40] > 20).all()


def test_twice_the_exposure_is_twice_the_light():
    once, twice = (exposed(0.1, exposure_us=us).mean() - 4 for us in (2000.0, 4000.0))
    assert twice == pytest.approx(2 * once, rel=0.01)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("sensitivity_e_per_us", 0.0),
        ("full_well_e", 0.0),
        ("full_well_e", math.inf),
        ("read_noise_e", -1.0),
        ("black_level_counts", 100.1),
        ("bits", 14),
        ("gain_spread_ratio", 0.3),
        ("hot_pixel_ratio", -1e-6),
        ("ambient_intensity", math.nan),
    ],
)
def test_an_impossible_camera_is_refused_by_name(name, value):
    with pytest.raises(InvalidQuantity, match=rf"^sensor\.{name} is"):
        Sensor(**{name: value})
