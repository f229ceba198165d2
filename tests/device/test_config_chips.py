"""Period of the PCA9685 and the exposures that fit it, against the datasheet's numbers."""

from __future__ import annotations

import pytest

from device.config_chips import PwmClock


@pytest.mark.parametrize(("pwm_hz", "prescale"), [(200.0, 0x1E), (1526.0, 0x03), (24.0, 0xFD), (50.0, 121)])
def test_the_prescaler_is_the_datasheets(pwm_hz, prescale):
    """Section 7.3.5: 200 Hz is 1Eh, at 25 MHz; 1526 Hz the fastest. 25e6 / (4096 * 24) - 1 = 253.3."""
    assert PwmClock.nearest(pwm_hz).prescale == prescale


def test_the_period_is_that_of_4096_steps():
    """4 * 4096 / 25 MHz = 655.36 us; on a crystal of 26 MHz 630.15 us."""
    assert PwmClock(3).period_us == pytest.approx(655.36)
    assert PwmClock(3, 26e6).period_us == pytest.approx(630.1538, abs=1e-4)


@pytest.mark.parametrize(
    ("exposure_us", "is_whole"),
    [(655, True), (656, False), (3932, True), (4000, False), (16384, True), (16385, False), (0, False)],
)
def test_an_exposure_is_whole_periods_to_the_microsecond(exposure_us, is_whole):
    """1, 6 and 25 periods are 655.36, 3932.16 and 16384 us."""
    assert PwmClock(3).is_whole(exposure_us) is is_whole


@pytest.mark.parametrize(
    ("exposure_us", "longest_us", "nearest_us"),
    [(4000, 33_333, 3932), (10, 33_333, 655), (33_300, 33_333, 32_768), (4000, 600, 0)],
)
def test_the_nearest_whole_exposure_is_at_least_a_period_and_fits_into_the_frame(exposure_us, longest_us, nearest_us):
    """51 periods would be 33 423 us, longer than the frame: 50 are taken."""
    assert PwmClock(3).nearest_whole_us(exposure_us, longest_us) == nearest_us


@pytest.mark.parametrize("pwm_hz", [24.0, 60.0, 200.0, 700.0, 1526.0])
def test_the_nearest_whole_exposure_is_whole(pwm_hz):
    clock = PwmClock.nearest(pwm_hz)
    assert all(clock.is_whole(clock.nearest_whole_us(us, 1e6)) for us in range(10, 100_000, 997))
