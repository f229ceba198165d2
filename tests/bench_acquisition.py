"""Runs the acquisition of a press at 60 frames a second: frames delivered of those due, and how well force is known.

The daemon's own camera process, force recorder, bench and press machine, on an emulated camera whose picture is ready
made and on the bytes of an emulated amplifier at 80 samples a second; full frames, in real time.
Usage: python tests/bench_acquisition.py [SECONDS [FRAMES_A_SECOND]]
"""

from __future__ import annotations

import os
import sys
import time
import types
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from device.assembly.camera import emulated_camera
from device.assembly.cell import commissioned, emulated_amplifier, open_cell, tared
from device.config import CameraSection, Config, simulated_config
from device.instrument.acquisition.bench import Bench
from device.instrument.acquisition.force_recorder import ForceRecorder
from device.instrument.acquisition.frame_check import TearWatch
from device.instrument.press.capture import Capture
from device.instrument.press.machine import PressRules, PressUnderWay
from device.instrument.status import StatusBoard
from device.measurement.recording.tactile_image import Frame
from device.simulation.chips.camera_server import CameraServer
from device.simulation.chips.virtual_camera import VirtualPicamera2
from device.simulation.faults import NO_FAULTS
from device.simulation.hand import HandSettings, VirtualHand
from device.simulation.scenario import CellSettings

SECONDS, FRAMES_A_SECOND = 10.0, 60.0
HAND = HandSettings(tremor_n=0.003)
LIT = (0.6, 0.6, 0.6, 0.6)


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
    """What came of some seconds: the frames, the time (s) of the work on each, and the truth of the force (N)."""

    seconds: float
    frames: list[Frame]
    work_s: list[float]
    true_n: list[float]


def main() -> None:
    """Print the frames delivered and due, the work on a frame, and the error of its force."""
    seconds, rate_hz = (float(given) for given in (*sys.argv[1:], *(SECONDS, FRAMES_A_SECOND)[len(sys.argv) - 1 :]))
    camera = CameraSection(frame_rate_hz=rate_hz)
    config = commissioned(replace(simulated_config(), camera=camera))
    with ExitStack() as opened:
        hand = VirtualHand(HAND)
        bench = _open(opened, config, hand)
        run = _run(Capture(bench, config, StatusBoard()), hand, seconds)
    _print(run, rate_hz)


def _open(opened: ExitStack, config: Config, hand: VirtualHand) -> Bench:
    cell = CellSettings()
    scene = types.SimpleNamespace(cell=cell, seed=1)
    counts = lambda t_s: cell.zero_counts + cell.counts_per_n * hand.force_n(t_s)  # noqa: E731
    line = emulated_amplifier(config, types.SimpleNamespace(cell_counts=counts, scenario=scene), NO_FAULTS)
    opened.callback(line.close)
    force: ForceRecorder = tared(config, open_cell(config, line.device_path))
    opened.callback(force.close)
    shape = config.camera.height_px, config.camera.width_px
    picture = np.random.default_rng(1).integers(60, 100, shape, dtype=np.uint8)
    server = CameraServer(
        lambda: VirtualPicamera2(
            lambda exposure: picture, width_px=shape[1], height_px=shape[0], led_ratio_at=lambda t_s: LIT
        )
    )
    opened.callback(server.close)
    camera = emulated_camera(config.camera, server.address)
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
        begun_s = time.perf_counter()
        machine = machine.see(capture._observation(frame, is_ramp=False), rules)
        tears.agree(before, frame)
        run.work_s.append(time.perf_counter() - begun_s)
        run.frames.append(replace(frame, counts=frame.counts[:1]))
        run.true_n.append(hand.force_n(frame.t_s))
        before = frame
    return run


def _print(run: Run, rate_hz: float) -> None:
    times = np.array([frame.t_s for frame in run.frames])
    due = round((times[-1] - times[0]) * rate_hz) + 1
    error_mn = 1e3 * np.subtract([frame.force_n for frame in run.frames], run.true_n)
    work_ms = 1e3 * np.array(run.work_s)
    print(f"frames delivered / due: {len(times)} / {due} = {len(times) / due:.1%} at {rate_hz:g} frames a second")
    print(f"longest gap: {np.diff(times).max() * rate_hz:.1f} frame times")
    print(f"work on a frame: median {np.median(work_ms):.2f} ms, 99 % {np.quantile(work_ms, 0.99):.2f} ms")
    print(f"force at the exposure: mean error {error_mn.mean():+.2f} mN, rms {error_mn.std():.2f} mN, "
          f"largest {np.abs(error_mn).max():.2f} mN")  # fmt: skip


if __name__ == "__main__":
    main()
