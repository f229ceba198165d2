"""Times the work on a frame, a press and a scene, each as a ratio to a fixed piece of NumPy work of the same minute.

Machines are noisy and differ: only the ratios are comparable. The yardstick is that of `host_tools tradeoff`.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

from device.files.bundle_file import read_paper_model

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # more threads make small products slower on a busy machine

import numpy as np
from camera_works import Handover, sustained_hz

from device.files.certificate_file import read_calibration
from device.measurement.paper_mode.estimate import estimate_paper
from device.measurement.paper_mode.features import extract_features
from device.measurement.quantities import Inclusion
from device.measurement.recording.tactile_image import reference, tactile_image
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import ProbeTables, VirtualProbe
from host_tools.calibration.phantom import CAMERA, LIT, phantom_recording
from host_tools.forward.solve import solve
from host_tools.scenes.scene import Scene
from host_tools.tradeoff.yardstick import exp_and_sum

MODELS = Path(__file__).resolve().parents[1] / "models"
REPEATS = 15


def median_seconds(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Return the median time of one call after a warm-up."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def _next_frame(light: str, tables: ProbeTables) -> Callable[[], object]:
    """Return what renders one frame after the other, each under a force of its own."""
    shape = CAMERA.height_px, CAMERA.width_px
    probe = VirtualProbe(Scenario(light=light), tables, shape, CAMERA.scale)
    forces_n = iter(np.linspace(0.3, 0.6, 10 * REPEATS))

    def render() -> object:
        return probe.frame_counts(
            force_n=float(next(forces_n)),
            place=ProbePlacement(),
            led_ratio=LIT,
            exposure_us=CAMERA.exposure_us,
            gain=CAMERA.gain,
            frame_number=1,
        )

    return render


def main() -> None:
    """Print a table of ratios and the peak memory."""
    bundle, tables = read_paper_model(MODELS / "paper"), ProbeTables.load(MODELS / "simulated_probe")
    calibration = read_calibration(MODELS / "simulated_probe" / "calibration.json")
    recording = phantom_recording(Inclusion(12.0, 6.0, 60.0), tables, seed=1)
    base, press = reference(recording.frames), recording.with_role("press")[0]
    image = tactile_image(press, base, recording.camera.scale)
    row = np.array([[0.05, 1.7, 57.0]])
    handover = Handover()
    works: dict[str, Callable[[], object]] = {
        "yardstick: exp and sum of one image": exp_and_sum,
        "camera: hand over a frame, one process": handover.here,
        "camera: hand over a frame, two processes": handover.through_its_process,
        "frame: correction": lambda: tactile_image(press, base, recording.camera.scale),
        "frame: features": lambda: extract_features(image, calibration.settings),
        "frame: 100 networks (ONNX)": lambda: bundle.estimate(row),
        "press: ten frames to an estimate": lambda: estimate_paper(recording, bundle, calibration),
        "simulated frame: physical light, camera": _next_frame("physical", tables),
        "simulated frame: linear light, camera": _next_frame("linear", tables),
        "scene: finite elements with baseline": lambda: solve(Scene(Inclusion(10.0, 6.0, 80.0))),
    }
    seconds = {name: median_seconds(work) for name, work in works.items()}
    yardstick = next(iter(seconds.values()))
    for name, value in seconds.items():
        print(f"{name:40} {value / yardstick:10.2f} x   ({1e3 * value:8.2f} ms here)")
    handover.close()
    print(f"virtual camera through its own process: {sustained_hz(60.0):.1f} frames/s of 60")
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB")


if __name__ == "__main__":
    main()
