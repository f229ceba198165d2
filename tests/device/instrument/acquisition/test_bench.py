"""Light, camera and force together: a frame knows under which light and force it was taken."""

import itertools
import threading
import types

import numpy as np
import pytest

from device.errors import LateFrameError, LightError, StaleFrameError
from device.hardware.interfaces import CameraFrame
from device.instrument.acquisition import bench as bench_module
from device.instrument.acquisition.bench import DARK, LOOK_AT_RESTING_EVERY_S, Bench
from device.instrument.acquisition.frame_check import LATE_FRAMES, FramePace
from device.instrument.acquisition.light_budget import LightBudget
from device.instrument.watch.progress import ProgressBoard

LIT = (0.6, 0.6, 0.6, 0.6)


class FakeHardware:
    """Lights, camera and force in one: acknowledges light at 10.0 s, exposes 4 ms frames every 0.1 s."""

    def __init__(self):
        self.log = []

    def set_ratio(self, ratio):
        self.log.append(ratio)
        return 10.0

    def go_on(self):
        pass

    def check_outputs(self):
        self.log.append("check")

    def capture(self, *, begun_after_s, timeout_s):
        start_s = np.ceil(begun_after_s * 10) / 10
        self.log.append(("frame", round(float(start_s), 3)))
        return CameraFrame(np.zeros((16, 16), np.uint8), float(start_s), 4000.0, 1.0)

    def rest(self):
        self.log.append("rest")

    def take_time(self):
        pass

    def at(self, t_s):
        return t_s / 100

    def range_n(self, t_s, *, window_s, around_line):
        return {(0.15, False): 0.01, (0.15, True): 0.003}[window_s, around_line]

    def peak_n(self, since_s, t_s):
        return (since_s + t_s) / 2


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


def test_range_and_peak_are_those_of_the_recorded_force(bench):
    """The range is that of the window just before; the peak is asked for from frame to frame."""
    assert bench.range_n(10.0, around_line=False) == 0.01
    assert bench.range_n(10.0, around_line=True) == 0.003
    assert bench.peak_n(9.0, 10.0) == 9.5


def test_the_rate_is_that_of_the_force_just_before(bench):
    """The force of this hardware grows by 0.01 N/s; that of a hand that eases falls."""
    assert bench.rate_n_per_s(10.0) == pytest.approx(0.01)
    bench.force.at = lambda t_s: 1.0 - t_s / 5
    assert bench.rate_n_per_s(10.0) == pytest.approx(-0.2)


def test_after_an_error_of_the_light_it_is_set_again_even_to_what_it_was(bench, hardware, monkeypatch):
    """Nobody knows whether the chip had taken the brightness before it failed."""
    bench.light(DARK)
    with monkeypatch.context() as broken:
        broken.setattr(hardware, "set_ratio", lambda ratio: (_ for _ in ()).throw(LightError("No answer.", "Mend it.")))
        with pytest.raises(LightError):
            bench.light(LIT)
    bench.light(DARK)
    assert hardware.log == [DARK, DARK]


def test_after_the_currents_were_checked_the_light_is_set_again_even_to_what_it_was(bench, hardware):
    """The check flashes: frames from before the new setting must not be taken."""
    bench.light(DARK)
    bench.check_lights()
    bench.light(DARK)
    assert hardware.log == [DARK, "check", DARK]


def test_a_camera_that_leaves_out_frames_is_at_fault(hardware, monkeypatch):
    """The bench looks at its watch at 9.0 s, 10.0 s ...; the frames begin half a second after the light is set."""
    watch = itertools.count(9.0)
    monkeypatch.setattr(bench_module.time, "monotonic", lambda: next(watch))
    slow = Bench(hardware, hardware, hardware, pace=FramePace(0.05))
    monkeypatch.setattr(hardware, "capture", lambda *, begun_after_s, timeout_s: late_frame(next(watch) + 0.5))
    for _ in range(LATE_FRAMES - 1):
        slow.take("press")
    with pytest.raises(LateFrameError):
        slow.take("press")


def test_a_frame_that_shows_the_light_before_is_not_taken_for_one_under_the_new_light(bench, hardware, monkeypatch):
    """Lit at 70 counts, then dark: the first dark frame still has 70."""
    levels = iter([70, 70, 4])
    monkeypatch.setattr(
        hardware,
        "capture",
        lambda *, begun_after_s, timeout_s: CameraFrame(
            np.full((16, 16), next(levels), np.uint8), begun_after_s, 4000.0, 1.0
        ),
    )
    bench.light(LIT)
    bench.take("reference")
    bench.light(DARK)
    bench.take("reference")
    with pytest.raises(StaleFrameError):
        bench.take("reference")


def late_frame(start_s):
    return CameraFrame(np.zeros((16, 16), np.uint8), start_s, 4000.0, 1.0)


def test_light_counts_from_when_it_is_asked_for_until_darkness_is_acknowledged(hardware, monkeypatch):
    """Lit at 1 s, another brightness at 2 s, an error at 3 s, dark at 5 s, lit at 6 s, checked at 8 s: 4 s and 2 s."""
    now_s = [0.0]
    bench = Bench(hardware, hardware, hardware, budget=LightBudget(clock=lambda: now_s[0]))
    for now_s[0], ratio in ((0.5, DARK), (1.0, LIT), (2.0, (0.1, 0.0, 0.0, 0.0))):
        bench.light(ratio)
    now_s[0] = 3.0
    with monkeypatch.context() as broken:
        broken.setattr(hardware, "set_ratio", lambda ratio: (_ for _ in ()).throw(LightError("No answer.", "Mend it.")))
        with pytest.raises(LightError):
            bench.light(DARK)
    now_s[0] = 5.0
    bench.light(DARK)
    assert bench.budget.press_s == 4.0
    now_s[0] = 6.0
    bench.light(LIT)
    now_s[0] = 8.0
    bench.check_lights()
    now_s[0] = 9.0
    assert bench.budget.press_s == 6.0


class Watch:
    """Shows what a test sets."""

    def __init__(self):
        self.now_s = 0.0

    def __call__(self):
        return self.now_s


def test_a_beat_confirms_the_light_and_takes_a_frame_and_frames_of_that_light_remain_good(hardware):
    watch = Watch()
    bench = Bench(hardware, hardware, hardware, progress=ProgressBoard(watch))
    bench.light(LIT)
    watch.now_s = 1.0
    bench.progress.beat()
    assert hardware.log == [LIT, ("frame", 10.0), LIT]
    assert bench.take("press").t_s == pytest.approx(10.102)


def test_a_light_that_nobody_knows_is_switched_off_by_a_beat(hardware):
    watch = Watch()
    bench = Bench(hardware, hardware, hardware, progress=ProgressBoard(watch))
    bench.light(LIT)
    bench.check_lights()
    watch.now_s = 1.0
    bench.progress.beat()
    assert hardware.log == [LIT, "check", ("frame", 10.0), DARK]


def test_after_a_light_that_could_not_be_confirmed_it_is_set_again(hardware, monkeypatch):
    watch = Watch()
    bench = Bench(hardware, hardware, hardware, progress=ProgressBoard(watch))
    bench.light(DARK)
    watch.now_s = 1.0
    with monkeypatch.context() as broken:
        broken.setattr(hardware, "set_ratio", lambda ratio: (_ for _ in ()).throw(LightError("No answer.", "Mend it.")))
        with pytest.raises(LightError):
            bench.progress.beat()
    bench.light(DARK)
    assert hardware.log[-1] == DARK
    assert hardware.log.count(DARK) == 2


def test_an_exposure_needs_no_force(bench, hardware):
    """The camera can be tested while the load cell is silent."""
    bench.force.at = None
    bench.light(DARK)
    assert [bench.expose().exposure_start_s for _ in range(2)] == pytest.approx([10.0, 10.1])


def test_what_was_made_dark_for_good_is_never_lit_again(bench, hardware):
    bench.light(LIT)
    bench.darken_for_good()
    bench.light(LIT)
    bench.check_lights()
    assert hardware.log == [LIT, DARK]


def test_a_frame_that_the_darkening_spoilt_is_no_fault_of_the_camera(bench, hardware):
    bench.levels = type("Levels", (), {"saw": lambda self, frame: pytest.fail("it was looked at")})()
    bench.darken_for_good()
    assert bench.take("press").led_ratio == DARK


def test_a_thread_that_lights_while_another_darkens_for_good_is_the_one_that_waits(bench, hardware):
    """The procedure's light and the end's darkness, whichever comes first: the last word is dark."""
    lighting = threading.Thread(target=bench.light, args=(LIT,))
    with bench._lock:
        bench._is_over = True
        lighting.start()
    lighting.join()
    bench.darken_for_good()
    assert hardware.log[-1] == DARK
    assert LIT not in hardware.log


def test_light_is_held_after_each_frame_that_has_come_and_darkness_never(bench, hardware, monkeypatch):
    monkeypatch.setattr(hardware, "go_on", lambda: hardware.log.append("held"))
    bench.light(DARK)
    bench.expose()
    bench.light(LIT)
    bench.expose()
    bench.take("press")
    assert [entry for entry in hardware.log if entry == "held" or entry == LIT] == [LIT, "held", "held"]


def test_light_that_went_off_by_itself_is_set_again_whatever_is_asked_for(bench, hardware, monkeypatch):
    bench.light(LIT)
    with monkeypatch.context() as cut:
        cut.setattr(hardware, "go_on", lambda: (_ for _ in ()).throw(LightError("It went off.", "Press again.")))
        with pytest.raises(LightError):
            bench.take("press")
    bench.light(LIT)
    assert hardware.log.count(LIT) == 2


def test_a_camera_rests_once_until_a_frame_is_asked_for_whose_lateness_is_not_held_against_it(hardware):
    """Each of these frames begins up to a tenth of a second after it was asked for, and none may."""
    bench = Bench(hardware, hardware, hardware, pace=FramePace(-1e9))
    for _ in range(2 * LATE_FRAMES):
        bench.rest()
        bench.rest()
        bench.take("press")
    assert [one for one in hardware.log if one == "rest" or one[0] == "frame"][:3] == [
        "rest", ("frame", 0.0), "rest",
    ]  # fmt: skip
    for _ in range(LATE_FRAMES - 1):
        bench.take("press")
    with pytest.raises(LateFrameError):
        bench.take("press")


def test_a_camera_that_rests_is_looked_at_more_seldom_and_rests_again(hardware, monkeypatch):
    now_s = [1000.0]
    monkeypatch.setattr(bench_module, "time", types.SimpleNamespace(monotonic=lambda: now_s[0]))
    bench = Bench(hardware, hardware, hardware)
    bench.take("press")
    bench.rest()
    hardware.log.clear()
    for _ in range(12):
        now_s[0] += LOOK_AT_RESTING_EVERY_S / 4
        bench._look()
    assert [one if one == "rest" else one[0] for one in hardware.log] == ["frame", "rest"] * 3
