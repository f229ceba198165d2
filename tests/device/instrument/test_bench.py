"""Light, camera and force together: a frame knows under which light and force it was taken."""

import numpy as np
import pytest

from device.hardware.interfaces import CameraFrame
from device.instrument.bench import DARK, Bench

LIT = (0.6, 0.6, 0.6, 0.6)


class FakeHardware:
    """Lights, camera and force in one: acknowledges light at 10.0 s, exposes 4 ms frames every 0.1 s."""

    def __init__(self):
        self.log, self.range = [], 0.01

    def set_ratio(self, ratio):
        self.log.append(ratio)
        return 10.0

    def capture(self, *, begun_after_s, timeout_s):
        start_s = np.ceil(begun_after_s * 10) / 10
        self.log.append(("frame", round(float(start_s), 3)))
        return CameraFrame(np.zeros((16, 16), np.uint8), float(start_s), 4000.0, 1.0)

    def at(self, t_s):
        return t_s / 100

    def range_n(self, t_s, *, window_s):
        return self.range


@pytest.fixture
def hardware():
    return FakeHardware()


@pytest.fixture
def bench(hardware):
    return Bench(hardware, hardware, hardware)


def test_a_frame_has_the_light_and_the_force_of_the_middle_of_its_exposure(bench):
    bench.light(LIT)
    frame = bench.take("press")
    assert frame.led_ratio == LIT
    assert frame.role == "press"
    assert frame.t_s == pytest.approx(10.002)
    assert frame.force_n == pytest.approx(0.10002)


def test_no_frame_is_taken_that_began_before_the_light_was_set(bench, hardware):
    bench.light(LIT)
    bench.take("press")
    assert hardware.log == [LIT, ("frame", 10.0)]


def test_no_frame_is_taken_twice(bench, hardware):
    bench.light(LIT)
    times = [bench.take("press").t_s for _ in range(3)]
    assert times == pytest.approx([10.002, 10.102, 10.202])


def test_light_that_is_on_already_is_not_set_again(bench, hardware):
    for ratio in (DARK, DARK, LIT, LIT, DARK):
        bench.light(ratio)
    assert hardware.log == [DARK, LIT, DARK]


@pytest.mark.parametrize(("range_n", "is_steady"), [(0.02, True), (0.0201, False), (float("inf"), False)])
def test_a_force_that_varied_more_than_allowed_is_not_steady(bench, hardware, range_n, is_steady):
    hardware.range = range_n
    assert bench.is_steady(10.0, 0.02) is is_steady
