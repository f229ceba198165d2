"""Runs the acquisition of a press at 60 frames a second: frames delivered of those due, and how well force is known.

The daemon's own camera process with its driver, force recorder, bench and press machine, and the bytes of an emulated
amplifier at 80 samples a second; full frames, in real time. The picture is ready made and lies in the camera's process,
where picamera2 has it: rows of the sensor, of which each frame gets a copy. Once for the sensor mode of the defaults,
once for the one that docs/camera.md describes. Frames are counted by the wall's clock, for they do not wait.
"""

from __future__ import annotations

import time
import tracemalloc
import types
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from bench_table import Figure, median_seconds
from numpy.typing import NDArray

from device.assembly.cell import commissioned, emulated_amplifier, open_cell, tared
from device.config import CameraSection, Config, simulated_config
from device.config_chips import RAW_BITS, RawMode
from device.hardware.camera import RawMonoCamera
from device.hardware.camera_process import CameraProcess
from device.hardware.restart_limit import RestartLimit
from device.instrument.acquisition.bench import Bench
from device.instrument.acquisition.force_recorder import ForceRecorder
from device.instrument.acquisition.frame_check import TearWatch
from device.instrument.press.capture import Capture
from device.instrument.press.machine import PressRules, PressUnderWay
from device.instrument.status import StatusBoard
from device.measurement.recording.tactile_image import Frame
from device.simulation.chips.virtual_camera import ExposureRequest, VirtualPicamera2
from device.simulation.faults import NO_FAULTS
from device.simulation.hand import HandSettings, VirtualHand
from device.simulation.scenario import CellSettings
from host_tools.tradeoff.yardstick import YARDSTICK_CALLS, exp_and_sum

CHAPTER = "acquisition, 60 frames a second"
SECONDS, FRAMES_A_SECOND = 10.0, 60.0
MODES = {
    "R8 768 x 492": CameraSection(),
    "R10 1280 x 800, cropped": CameraSection(
        raw_format="R10", sensor_width_px=1280, sensor_height_px=800, crop_width_px=1070
    ),
}
HAND = HandSettings(tremor_n=0.003)
WORK_BOUND = 3.0
"""Three quarters of a millisecond where the yardstick takes a quarter; 1.7 were measured."""
LIT = (0.6, 0.6, 0.6, 0.6)


class StillCamera(VirtualPicamera2):
    """A camera whose every frame is a copy of the same rows, as picamera2 copies a buffer."""

    def __init__(self, mode: RawMode) -> None:
        width_px, height_px = mode.sensor_px
        super().__init__(
            lambda exposure: np.empty(0),
            width_px=width_px,
            height_px=height_px,
            led_ratio_at=lambda t_s: LIT,
            raw_formats=(mode.raw_format,),
        )
        bits = RAW_BITS[mode.raw_format]
        counts = np.random.default_rng(1).integers(60, 100, (height_px, width_px)) << (bits - 8)
        self._rows = counts.astype(f"<u{mode.bytes_per_px}").view(np.uint8)

    def render_rows(self, exposure: ExposureRequest) -> NDArray[np.uint8]:
        return self._rows.copy()


def still_camera(mode: RawMode, camera: CameraSection) -> RawMonoCamera:
    """Open the camera, in its process."""
    return RawMonoCamera(
        StillCamera(mode),
        mode=mode,
        exposure_us=camera.exposure_us,
        gain=camera.gain,
        frame_rate_hz=camera.frame_rate_hz,
    )


class DarkLights:
    """LEDs that are not there: they acknowledge at once."""

    def set_ratio(self, ratio: object) -> float:
        return time.monotonic()

    def go_on(self) -> None:
        pass

    def check_outputs(self) -> None:
        pass


@dataclass(frozen=True)
class Run:
    """What came of some seconds: the frames, what the processor took (s) for each, and the truth of the force (N).

    `work_s`: to observe and decide, and to check whether it is torn.
    """

    seconds: float
    frames: list[Frame]
    work_s: list[tuple[float, float]]
    true_n: list[float]


def figures() -> Iterator[Figure]:
    """Yield for each mode of the sensor the frames that came, the work on a frame, and the error of its force."""
    for words, camera in MODES.items():
        config = commissioned(replace(simulated_config(), camera=replace(camera, frame_rate_hz=FRAMES_A_SECOND)))
        with ExitStack() as opened:
            hand = VirtualHand(HAND)
            capture = Capture(_open(opened, config, hand), config, StatusBoard())
            run = _run(capture, hand, SECONDS)
            allocated_kb = _allocated_kb(capture)
        yield from (replace(figure, name=f"{words}: {figure.name}") for figure in _of_run(run))
        name = f"{words}: live at once for a frame, in arrays of 32 kB"
        yield Figure(CHAPTER, name, allocated_kb, "kB", bound=250.0)


def _open(opened: ExitStack, config: Config, hand: VirtualHand) -> Bench:
    cell = CellSettings()
    scene = types.SimpleNamespace(cell=cell, seed=1)
    counts = lambda t_s: cell.zero_counts + cell.counts_per_n * hand.force_n(t_s)  # noqa: E731
    line = emulated_amplifier(config, types.SimpleNamespace(cell_counts=counts, scenario=scene), NO_FAULTS)
    opened.callback(line.close)
    force: ForceRecorder = tared(config, open_cell(config, line.device_path))
    opened.callback(force.close)
    mode = config.camera.raw_mode
    opener = partial(still_camera, mode, config.camera)
    camera = CameraProcess(opener, shape=mode.frame_px[::-1], limit=RestartLimit(0, 60.0))
    opened.callback(camera.close)
    return Bench(DarkLights(), camera, force)


def _run(capture: Capture, hand: VirtualHand, seconds: float) -> Run:
    """Take frames of a hand that holds, and do with each what a press does."""
    hand.begin()
    hand.follow("press_lesion", time.monotonic())
    time.sleep(2.0)
    bench, tears = capture.bench, TearWatch(10.0)
    rules = PressRules.of(capture.press, capture.press.band_n, is_ramp=False)
    bench.light(LIT)
    before = bench.take("press")
    machine = PressUnderWay().begin("press", before.t_s)
    run = Run(seconds, [], [], [])
    until_s = before.t_s + seconds
    while before.t_s < until_s:
        frame = bench.take("press")
        begun_s = time.thread_time()
        machine = machine.see(capture._observation(frame, is_ramp=False), rules)
        seen_s = time.thread_time()
        tears.agree(before, frame)
        run.work_s.append((seen_s - begun_s, time.thread_time() - seen_s))
        run.frames.append(replace(frame, counts=frame.counts[:1].copy()))
        run.true_n.append(hand.force_n(frame.t_s))
        before = frame
    return run


def _allocated_kb(capture: Capture) -> float:
    """Return what the work on a frame allocates at most, in kB, beside the frame itself."""
    tears, before, most = TearWatch(10.0), capture.bench.take("press"), 0
    for _ in range(5):
        frame = capture.bench.take("press")
        tracemalloc.start()
        capture._observation(frame, is_ramp=False)
        tears.agree(before, frame)
        most = max(most, tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        before = frame
    return most / 1e3


def _of_run(run: Run) -> Iterator[Figure]:
    times = np.array([frame.t_s for frame in run.frames])
    due = round((times[-1] - times[0]) * FRAMES_A_SECOND) + 1
    error_mn = 1e3 * np.subtract([frame.force_n for frame in run.frames], run.true_n)
    observed_ms, checked_ms = 1e3 * np.array(run.work_s).T
    work_ms = observed_ms + checked_ms
    here = f"{len(times)} of {due}"
    yield Figure(CHAPTER, "share of frames that came", len(times) / due, "", bound=0.99, at_least=True, here=here)
    yield Figure(CHAPTER, "longest gap", float(np.diff(times).max()) * FRAMES_A_SECOND, "frame times")
    yardstick_ms = 1e3 * median_seconds(exp_and_sum, YARDSTICK_CALLS)
    for name, of_frames_ms, share, bound in (
        ("median", work_ms, 0.5, WORK_BOUND),
        ("99 %", work_ms, 0.99, None),
        ("median of what is observed and decided", observed_ms, 0.5, None),
        ("median of the tear check", checked_ms, 0.5, None),
    ):
        took_ms = float(np.quantile(of_frames_ms, share))
        here = f"{took_ms:.3g} ms here"
        yield Figure(CHAPTER, f"work on a frame, {name}", took_ms / yardstick_ms, bound=bound, here=here)
    yield Figure(CHAPTER, "force at the exposure, largest error", float(np.abs(error_mn).max()), "mN")
