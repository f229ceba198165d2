"""A press on a phantom that is cancelled or breaks ends dark and writes nothing; time is simulated."""

import threading
import types
from contextlib import ExitStack, closing

import pytest
from simulated_time_bench import CAMERA, SimulatedTimeProbe

from device.config import Config
from device.errors import LightError
from device.instrument.acquisition import bench as bench_module
from device.instrument.acquisition.bench import DARK, Bench
from device.instrument.acquisition.light_budget import LightBudget
from device.instrument.press import capture as capture_module
from device.instrument.press.capture import PressEnded
from device.instrument.press.phantom_press import PhantomPress, PhantomTruth
from device.instrument.press.states import Guidance
from device.instrument.watch.clock_watch import ClockWatch
from device.measurement.quantities import Inclusion
from device.records.store import Store
from device.simulation.hand import HandSettings

PHANTOM = PhantomTruth(Inclusion(10.0, 6.0, 80.0))


class Rig:
    """A press by a hand that follows the guidance; `lights` are all that were set, and once it `breaks` none is lit."""

    def __init__(self, folder, monkeypatch):
        self.probe, self.lights, self.breaks = SimulatedTimeProbe(HandSettings()), [], False
        clock = types.SimpleNamespace(monotonic=lambda: self.probe.now_s, sleep=self.probe.sleep)
        for module in (bench_module, capture_module):
            monkeypatch.setattr(module, "time", clock)
        self.store, self.folder, opened = Store(folder / "var"), folder / "recording", ExitStack()
        opened.callback(self.store.close)
        bench = Bench(self, self.probe, self.probe, budget=LightBudget(clock=clock.monotonic))
        self.press = PhantomPress(
            Config(camera=CAMERA), bench, self.store, clock=ClockWatch(2.0), opened=opened, simulated=True
        )
        self.cancelled = threading.Event()
        self.press.on_request(lambda mode: self.probe.hand.begin())
        self.press.board.on_guidance(lambda guidance: self.probe.hand.follow(guidance.code, self.probe.now_s))

    def set_ratio(self, ratio):
        if self.breaks and any(ratio):
            raise LightError("The LED chip does not answer.", "Check its cable.")
        self.lights.append(ratio)
        return self.probe.set_ratio(ratio)

    def go_on(self):
        pass

    def check_outputs(self):
        self.probe.check_outputs()

    def at(self, guidance, act):
        self.press.board.on_guidance(lambda now: act() if now is guidance else None)

    def record(self):
        self.press.record(PHANTOM, "paper", self.folder, self.cancelled)


@pytest.fixture
def rig(tmp_path, monkeypatch):
    rig = Rig(tmp_path, monkeypatch)
    yield rig
    rig.store.close()


@pytest.mark.parametrize("moment", [Guidance.PRESS_BESIDE, Guidance.LIFT, Guidance.PRESS_LESION])
def test_a_press_that_is_cancelled_ends_dark_and_writes_nothing(rig, moment):
    rig.at(moment, rig.cancelled.set)
    with pytest.raises(PressEnded, match="Cancelled by the operator") as end:
        rig.record()
    assert end.value.state == "cancelled"
    assert any(any(ratio) for ratio in rig.lights)
    assert rig.lights[-1] == DARK
    assert rig.press.board.now.guidance is Guidance.REJECTED
    assert not rig.folder.exists()


def test_a_press_that_is_cancelled_before_it_begins_never_shines(rig):
    rig.cancelled.set()
    with pytest.raises(PressEnded, match="Cancelled by the operator"):
        rig.record()
    assert not any(any(ratio) for ratio in rig.lights)


def test_a_probe_that_nobody_puts_down_is_waited_for_until_ctrl_c(rig):
    """It is held at half a newton from the start: no unloaded frame can be taken."""
    rig.probe.hand.begin()
    rig.probe.hand.follow("press_beside", rig.probe.now_s - 10.0)
    capture_module.time.sleep = lambda seconds: rig.cancelled.set()
    with pytest.raises(PressEnded, match="Cancelled by the operator"):
        rig.record()
    assert not any(any(ratio) for ratio in rig.lights)


def test_a_fault_is_what_the_press_ends_by_and_the_light_of_it_is_counted(rig):
    def break_off():
        rig.breaks = True

    rig.at(Guidance.PRESS_LESION, break_off)
    with pytest.raises(LightError):
        rig.record()
    assert rig.lights[-1] == DARK
    assert rig.press.board.now.guidance is Guidance.FAULT
    assert not rig.folder.exists()
    rig.press.close()
    with closing(Store(rig.store.folder)) as store:
        assert store.light_on_s > 1.0
