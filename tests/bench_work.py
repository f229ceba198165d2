"""The work on a frame, a press and a scene: what the processor does between the last frame and the answer, and before.

Presses are recorded ones of the simulated probe, in the frames that each mode takes.
"""

from __future__ import annotations

import itertools
import resource
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from bench_table import WALL, Figure, timed
from camera_works import Handover, sustained_hz

from device.files.bundle_file import read_paper_model, read_quick_model, read_ramp_model
from device.files.certificate_file import read_calibration
from device.measurement.calibration import Calibration
from device.measurement.mode import Mode
from device.measurement.paper_mode.estimate import estimate_paper
from device.measurement.paper_mode.features import extract_features
from device.measurement.quantities import Inclusion
from device.measurement.quick_mode.model import estimate_quick
from device.measurement.ramp_modes.estimate import estimate_ramp
from device.measurement.ramp_modes.model import RampModel
from device.measurement.recording.tactile_image import reference, tactile_image
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import ProbeTables, VirtualProbe
from host_tools.calibration.phantom import CAMERA, LIT, phantom_recording
from host_tools.commissioning.joint_fit import Design
from host_tools.forward.solve import solve
from host_tools.press_models.press_derivatives import load_derivatives
from host_tools.press_models.recorded_presses import recorded_press
from host_tools.scenes.scene import Scene
from host_tools.scores.scored_presses import tolerant

CHAPTER = "work on a frame, a press and a scene"
PRESS = np.array([12.0, 6.0, 60.0, 5.0, 30.0, 2.0, 0.5, 1.0, 1.0])
"""Size, depth, modulus and everything else of the press, in the order of `PARAMETERS`."""
SECOND_MM = 5.0
"""Mode precise is a scan of two ramps here, the fewest that it answers: the second lies so far beside."""
BOUNDS: dict[Mode, float] = {"quick": 24.0, "standard": 380.0, "precise": 600.0}
OF_OWN_PROBE: dict[str, tuple[Mode, tuple[float, ...], float]] = {
    "press, mode standard, of a commissioned probe": ("standard", (), 600.0),
    "scan of five, of a commissioned probe": ("precise", (3.0, 5.0, 6.0, 7.0), 3700.0),
}
"""Mode, offsets of further presses (mm) and bound: what is unlike the design is marginalised, too."""
Works = dict[str, tuple[Callable[[], object], float | None]]
MODELS = Path(__file__).resolve().parents[1] / "models"


def figures() -> Iterator[Figure]:
    """Yield the times of the work, how fast the camera's own process hands over frames, and the memory of it all."""
    tables, handover = ProbeTables.load(MODELS / "simulated_probe"), Handover()
    calibration = read_calibration(MODELS / "simulated_probe" / "calibration.json")
    yield timed(CHAPTER, "camera: hand over a frame, one process", handover.here)
    yield timed(CHAPTER, "camera: hand over a frame, two processes", handover.through_its_process, clock=WALL)
    works = {
        **_paper_works(tables, calibration),
        **_press_works(tables, calibration),
        "simulated frame: physical light, camera": (_next_frame("physical", tables), None),
        "simulated frame: linear light, camera": (_next_frame("linear", tables), None),
        "scene: finite elements with baseline": (lambda: solve(Scene(Inclusion(10.0, 6.0, 80.0))), None),
    }
    for name, (work, bound) in works.items():
        yield timed(CHAPTER, name, work, bound)
    handover.close()
    yield Figure(CHAPTER, "frames a second through the camera's own process, of 60", sustained_hz(60.0), "1/s")
    yield Figure(CHAPTER, "peak memory", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, "MiB")


def _paper_works(tables: ProbeTables, calibration: Calibration) -> Works:
    bundle = read_paper_model(MODELS / "paper")
    recording = phantom_recording(Inclusion(12.0, 6.0, 60.0), tables, seed=1)
    base, press = reference(recording.frames), recording.with_role("press")[0]
    image = tactile_image(press, base, recording.camera.scale)
    row = np.array([[0.05, 1.7, 57.0]])
    return {
        "frame: correction": (lambda: tactile_image(press, base, recording.camera.scale), None),
        "frame: features": (lambda: extract_features(image, calibration.paper_lines.settings), None),
        "frame: 100 networks (ONNX)": (lambda: bundle.estimate(row), None),
        "press, mode paper: frames to an estimate": (lambda: estimate_paper(recording, bundle, calibration), None),
    }


def _press_works(tables: ProbeTables, calibration: Calibration) -> Works:
    """Return the estimates that the operator waits for; bounds: 6, 95 and 150 ms where the yardstick takes 0.25,
    and 150 and 925 ms of a commissioned probe."""
    quick, ramp = read_quick_model(MODELS / "quick"), read_ramp_model(MODELS / "standard")
    further_mm: dict[Mode, tuple[float, ...]] = {"precise": (SECOND_MM,)}
    recorded = {
        mode: recorded_press(tables, PRESS, mode, seed=3, further_mm=further_mm.get(mode, ())) for mode in BOUNDS
    }

    def estimate(mode: Mode) -> Callable[[], object]:
        if mode == "quick":
            return lambda: estimate_quick(recorded[mode], quick, calibration)
        return lambda: estimate_ramp(recorded[mode], mode, ramp, calibration)

    return {
        **{f"press, mode {mode}: frames to an estimate": (estimate(mode), BOUNDS[mode]) for mode in BOUNDS},
        **_own_works(ramp, tables, calibration),
    }


def _own_works(design: RampModel, tables: ProbeTables, calibration: Calibration) -> Works:
    """Return the same estimates of a probe of which only the builder's tolerances are known."""
    answers = tolerant(Design(design.answers, load_derivatives(MODELS / "simulated_probe")))
    own = RampModel(design.bundle, answers, design.ranges)

    def estimate(mode: Mode, further_mm: tuple[float, ...]) -> Callable[[], object]:
        recording = recorded_press(tables, PRESS, mode, seed=3, further_mm=further_mm)
        return lambda: estimate_ramp(recording, mode, own, calibration)

    return {
        f"{name}: frames to an estimate": (estimate(mode, further_mm), bound)
        for name, (mode, further_mm, bound) in OF_OWN_PROBE.items()
    }


def _next_frame(light: str, tables: ProbeTables) -> Callable[[], object]:
    """Return what renders one frame after the other, each under a force of its own."""
    shape = CAMERA.height_px, CAMERA.width_px
    probe = VirtualProbe(Scenario(light=light), tables, shape, CAMERA.scale)
    forces_n = itertools.cycle(np.linspace(0.3, 0.6, 97))  # each another one than the last: no frame is kept

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
