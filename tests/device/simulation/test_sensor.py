"""The camera's noise against the EMVA 1288 model: mean, standard deviation, saturation, seed."""

import math

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.simulation.sensor import Sensor

SHAPE = (200, 300)
SENSOR = Sensor()
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
    sensor = Sensor(read_noise_e=40.0, black_level_counts=100.0)
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
    ],
)
def test_an_impossible_camera_is_refused_by_name(name, value):
    with pytest.raises(InvalidQuantity, match=rf"^sensor\.{name} is"):
        Sensor(**{name: value})
