"""A bench on which a hand presses in simulated time: no waiting, tiny frames, the daemon's own capture above it.

Camera, LED chip and load cell are one object with one clock that moves from frame to frame. A face of 64 x 44 pixels
shows light that grows with the force, and the inclusion as a Gaussian where the hand has put the probe.
"""

from __future__ import annotations

import types
from dataclasses import dataclass

import numpy as np
import pytest
from stand_in_adviser import advice

from device.config import CameraSection, Config
from device.errors import DeviceError
from device.hardware.interfaces import CameraFrame
from device.instrument.acquisition import bench as bench_module
from device.instrument.acquisition.bench import DARK, Bench
from device.instrument.acquisition.force_recorder import force_range_n
from device.instrument.acquisition.light_budget import LightBudget
from device.instrument.press import capture as capture_module
from device.instrument.press import scan as scan_module
from device.instrument.press.capture import Capture, PressEnded
from device.instrument.press.scan import Scan
from device.instrument.status import PressJob, StatusBoard
from device.measurement.mode import FRAMES, Mode
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import Frame
from device.simulation.hand import HandSettings, VirtualHand

SHAPE, SCALE = (44, 64), PixelScale(0.35, 0.36)
CAMERA = CameraSection(mm_per_px_x=SCALE.mm_per_px_x, mm_per_px_y=SCALE.mm_per_px_y)
X_MM, Y_MM = SCALE.coordinates_mm(SHAPE)
BLACK_COUNTS, COUNTS_AT_1_N, EXPONENT = 8.0, 170.0, 0.7
INCLUSION_CONTRAST, INCLUSION_MM = 0.2, 3.0
NOISES = np.random.default_rng(1).normal(BLACK_COUNTS + 0.5, 1.0, (8, *SHAPE)).astype(np.float32)
CELL_HZ, CELL_NOISE_N = 80.0, 4e-4
CELL_NOISES_N = np.random.default_rng(2).normal(0.0, CELL_NOISE_N, 512)
FRAME_S, EXPOSURE_S, READ_OUT_S = 1 / CAMERA.frame_rate_hz, 0.004, 0.002


class SimulatedTimeProbe:
    """Lights, camera and force recorder under one hand, all on `now_s`."""

    def __init__(self, settings: HandSettings) -> None:
        self.hand, self.now_s = VirtualHand(settings), 100.0
        self.exposed_n: dict[float, float] = {}
        self._ratio, self._samples = (0.0,) * 4, {}
        self._faces = {}

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds

    def set_ratio(self, ratio):
        self._ratio = ratio
        self.now_s += 0.001
        return self.now_s

    def go_on(self) -> None:
        pass

    def check_outputs(self) -> None:
        self.now_s += 0.01

    def capture(self, *, begun_after_s, timeout_s):
        start_s = np.ceil(max(begun_after_s, self.now_s) / FRAME_S) * FRAME_S
        self.now_s = float(start_s) + EXPOSURE_S + READ_OUT_S
        return CameraFrame(self._counts(float(start_s) + EXPOSURE_S / 2), float(start_s), 1e6 * EXPOSURE_S, 1.0)

    def _counts(self, t_s):
        self.exposed_n[t_s] = self.hand.force_n(t_s)
        light = COUNTS_AT_1_N * sum(self._ratio) / 2.4 * self.exposed_n[t_s] ** EXPONENT
        counts = NOISES[round(t_s / FRAME_S) % len(NOISES)]
        if light:
            counts = counts + np.float32(light) * self._face(self.hand.place(t_s))
        return counts.astype(np.uint8)  # between 0 and 255 at any force that is no overload

    def _face(self, place):
        """Return the face's brightness; the inclusion lies where the probe has been moved away from."""
        at = place.x_mm, place.y_mm
        if at not in self._faces:
            r2 = (X_MM + at[0]) ** 2 + (Y_MM + at[1]) ** 2
            self._faces[at] = (1 + INCLUSION_CONTRAST * np.exp(-r2 / (2 * INCLUSION_MM**2))).astype(np.float32)
        return self._faces[at]

    def _sample(self, number):
        if number not in self._samples:
            force_n = self.hand.force_n(number / CELL_HZ) + CELL_NOISES_N[number % len(CELL_NOISES_N)]
            self._samples[number] = float(force_n)
        return self._samples[number]

    def move_zero(self, read_n):
        assert abs(read_n) < 0.001  # its cell has the noise of one, and does not creep

    @property
    def latest_n(self):
        return self._sample(int(self.now_s * CELL_HZ))

    def sampled_n(self, since_s, t_s):
        """Return the cell's samples between two times."""
        return [force_n for number, force_n in self._samples.items() if since_s <= number / CELL_HZ <= t_s]

    def at(self, t_s):
        number, part = divmod(t_s * CELL_HZ, 1.0)
        return (1 - part) * self._sample(int(number)) + part * self._sample(int(number) + 1)

    def range_n(self, t_s, *, window_s, around_line):
        numbers = range(int(np.ceil((t_s - window_s) * CELL_HZ)), int(t_s * CELL_HZ) + 1)
        times_s = np.array(numbers) / CELL_HZ
        return force_range_n(times_s, np.array([self._sample(one) for one in numbers]), around_line=around_line)

    def peak_n(self, since_s, t_s):
        numbers = range(int(since_s * CELL_HZ) + 1, int(t_s * CELL_HZ) + 1)
        return max([self.at(t_s), *map(self._sample, numbers)])


@dataclass(frozen=True)
class Pressed:
    """What became of a press: its frames, or why there are none; and how long the light was on."""

    is_accepted: bool
    reason: str
    light_on_s: float
    seconds: float
    frames: list[Frame]
    probe: SimulatedTimeProbe


class SimulatedTimePress:
    """Presses of hands, one after the other, each on a probe of its own."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, config: Config) -> None:
        self.config, self._monkeypatch = config, monkeypatch

    def press(self, settings: HandSettings, mode: Mode) -> Pressed:
        """Return what becomes of the two presses of a measurement by such a hand."""
        return self.press_again(settings, mode, None)[0]

    def press_again(self, settings: HandSettings, mode: Mode, before: Capture | None) -> tuple[Pressed, Capture]:
        """Return the same on a probe that remembers the presses before, and what the next one is to remember."""
        probe = SimulatedTimeProbe(settings)
        clock = types.SimpleNamespace(monotonic=lambda: probe.now_s, sleep=probe.sleep)
        for module in (bench_module, capture_module, scan_module):
            self._monkeypatch.setattr(module, "time", clock)
        budget = LightBudget(self.config.light.max_on_s, clock=lambda: probe.now_s)
        bench, board = Bench(probe, probe, probe, budget=budget), StatusBoard()
        board.on_guidance(lambda guidance: probe.hand.follow(guidance.code, probe.now_s))
        capture, began_s = Capture(bench, self.config, board), probe.now_s
        capture._untouched_s = before._untouched_s if before else 0.0
        frames, reason = [], ""
        try:
            frames = _measure(capture, budget, probe, mode)
        except (PressEnded, DeviceError) as end:
            reason = str(end)
        return Pressed(not reason, reason, budget.press_s, probe.now_s - began_s, frames, probe), capture


def _measure(capture: Capture, budget: LightBudget, probe: SimulatedTimeProbe, mode: Mode) -> list[Frame]:
    """Go through a measurement as `Procedure` does, a scan with all its presses; return the frames of all presses."""
    capture.unloaded()
    probe.hand.begin()
    budget.begin_press()
    reference = capture.loaded("reference", mode)
    capture.side_levels(reference)
    capture.release()
    probe.hand.follow("lift", probe.now_s)
    capture.lifted()
    if FRAMES[mode].is_scan:
        press = _scan(capture, mode)
    else:
        press = capture.loaded("press", mode)
        capture.release()
    capture.bench.light(DARK)
    capture.done()
    return [*reference, *press]


def _scan(capture: Capture, mode: Mode) -> list[Frame]:
    def darken() -> None:
        capture.bench.light(DARK)

    job, advise = PressJob("p-1", mode), lambda frames: advice(1.0)
    return Scan(job, capture, capture.board, advise=advise, darken=darken, note=lambda ramps: None).lead().frames
