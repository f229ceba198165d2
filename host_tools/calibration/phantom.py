"""Simulated phantom recordings: what the probe would record on a phantom of known inclusion.

The frames come from the virtual probe's own face, light and camera, so that a calibration or a score made from them
holds for the frames that the daemon sees. Simulated: evidence of the method, never of a real probe's accuracy.
"""

from __future__ import annotations

import uuid
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from device import __version__
from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require
from device.measurement.recording.led_sides import LedRatio
from device.measurement.recording.recording import CameraSettings, RecordedCell, Recording
from device.measurement.recording.tactile_image import Frame, Role
from device.simulation.grid_target import GridTarget
from device.simulation.hand import BESIDE_MM
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.physics.surface_table import PressRamps
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import ProbeTables, VirtualProbe
from host_tools.scenes.probe import Probe
from host_tools.scenes.probe_file import simulated_probe

EXPOSURE_US, GAIN = 4000.0, 1.0


def camera_settings(probe: Probe) -> CameraSettings:
    """Return the settings under which a probe's camera is simulated: its frame and geometry, 8 bits."""
    scale = probe.scale
    return CameraSettings(
        width_px=probe.camera.width_px,
        height_px=probe.camera.height_px,
        bits=8,
        mm_per_px_x=scale.mm_per_px_x,
        mm_per_px_y=scale.mm_per_px_y,
        exposure_us=EXPOSURE_US,
        gain=GAIN,
    ).seen_as(probe.geometry)


CAMERA = camera_settings(simulated_probe())
LIT, DARK = (0.6, 0.6, 0.6, 0.6), (0.0, 0.0, 0.0, 0.0)
UNLOADED_FRAMES, PRESS_FRAMES = 4, 10
TARGET_N, HOLD_STD_N = 0.5, 0.006
"""Force the hand aims at, and how far it strays while it holds: standard deviations."""
TURN_STD_DEG = 2.0
"""How far from a quarter of a turn a cap is put on."""


@dataclass(frozen=True)
class PhantomProtocol:
    """How a phantom is pressed: `frames` at each of the forces, how far they stray, and where beside the lesion.

    A scan presses it at `further_places`, too.
    """

    forces_n: Sequence[float] = (TARGET_N,)
    frames: int = PRESS_FRAMES
    place: ProbePlacement = field(default_factory=ProbePlacement)
    stray_n: float = HOLD_STD_N
    further_places: Sequence[ProbePlacement] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        action = "press a phantom as one would a patient"
        if not self.forces_n:
            raise InvalidQuantity("forces_n", "empty", "at least one force", action)
        for force_n in self.forces_n:
            require("forces_n", force_n, Bound(0.0, 5.0, "N", low_included=False), action)
        require("stray_n", self.stray_n, Bound(0.0, 0.1, "N"), action)
        require("frames", self.frames, Bound(1, 1000, "frames a force"), action)


class _Recorder:
    """Takes frames one after the other, each with its true force and the force that the cell reports."""

    def __init__(self, probe: VirtualProbe, camera: CameraSettings, seed: int, imbalance_ratio: LedRatio) -> None:
        self.probe, self.camera, self.rng, self.number = probe, camera, np.random.default_rng(seed), 0
        self.imbalance_ratio = imbalance_ratio
        cell = probe.scenario.cell
        self.force_noise_n = cell.noise_counts / cell.counts_per_n

    def unloaded(self, role: Role) -> list[Frame]:
        return [self._frame(role, 0.0, ProbePlacement(*BESIDE_MM)) for _ in range(UNLOADED_FRAMES)]

    def pressed(self, role: Role, protocol: PhantomProtocol, place: ProbePlacement) -> list[Frame]:
        loads = [force_n for force_n in protocol.forces_n for _ in range(protocol.frames)]
        return [self._frame(role, force_n, place, protocol.stray_n) for force_n in loads]

    def _frame(self, role: Role, target_n: float, place: ProbePlacement, stray_n: float = 0.0) -> Frame:
        self.number += 1
        force_n = max(0.0, self.rng.normal(target_n, stray_n)) if target_n else 0.0
        light = DARK if role == "dark" else LIT
        counts = self.probe.frame_counts(
            force_n=force_n,
            place=place,
            led_ratio=self._shining(light),
            exposure_us=self.camera.exposure_us,
            gain=self.camera.gain,
            frame_number=self.number,
        )
        span_ratio = self.probe.scenario.world.cell_span_ratio
        reported_n = span_ratio * force_n + float(self.rng.normal(0.0, self.force_noise_n))
        return Frame(counts, role, self.number / 30.0, reported_n, light)

    def _shining(self, light: LedRatio) -> LedRatio:
        """Return how bright the LEDs are where the chip was told `light`, which is what a recording says."""
        x, y, minus_x, minus_y = (ratio * (1 + by) for ratio, by in zip(light, self.imbalance_ratio, strict=True))
        return x, y, minus_x, minus_y


def phantom_recording(
    inclusion: Inclusion,
    tables: ProbeTables,
    *,
    seed: int,
    protocol: PhantomProtocol | None = None,
    scenario: Scenario | None = None,
    ramps: PressRamps | None = None,
    probe: Probe | None = None,
) -> Recording:
    """Return the recording of one phantom: dark, unloaded, reference press and press, with its truth.

    `scenario` says what the probe is made of (its inclusion and seed are not used), `ramps` how the face deforms where
    the table does not say. A `probe`, of which the tables must be, brings its own camera, lens, load cell, serial
    number and imbalance of the LEDs; the scenario's world is then what is true against its file.
    """
    asked = protocol or PhantomProtocol()
    made_of = _made_of(replace(scenario or Scenario(), inclusion=inclusion, seed=seed), probe)
    recorder = _recorder(made_of, tables, probe, ramps)
    frames = [
        *recorder.unloaded("dark"),
        *recorder.unloaded("reference"),
        *recorder.pressed("reference", asked, ProbePlacement(*BESIDE_MM)),
        *recorder.pressed("press", asked, asked.place),
    ]
    for ramp, place in enumerate(asked.further_places, start=1):
        frames += [replace(frame, ramp=ramp) for frame in recorder.pressed("press", asked, place)]
    places = f" {asked.further_places}" if asked.further_places else ""
    described = f"phantom {made_of} {asked} {ramps is None}{places}{probe or ''}"
    taken = _recording(recorder, frames, described, probe)
    return replace(taken, position_mm=(asked.place.x_mm, asked.place.y_mm), truth=inclusion)


def grid_recordings(
    count: int,
    target: GridTarget,
    tables: ProbeTables,
    *,
    play_mm: float,
    seed: int,
    scenario: Scenario | None = None,
    probe: Probe | None = None,
) -> Iterator[Recording]:
    """Yield recordings of a grid target in its cap, which is put on anew for each, a quarter of a turn farther.

    Their reference frames show a blank plate.
    `play_mm` is by how much its middle misses the face's along x and y, a standard deviation; it is turned by some
    degrees more. Scenario and probe are as in `phantom_recording`.
    """
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        x_mm, y_mm = target.x_mm + play_mm * rng.standard_normal(2)
        turn_deg = target.turn_deg + 90.0 * number + float(rng.normal(0, TURN_STD_DEG))
        put_on = replace(target, x_mm=float(x_mm), y_mm=float(y_mm), turn_deg=turn_deg)
        made_of = _made_of(replace(scenario or Scenario(), grid=put_on, seed=seed + number), probe)
        recorder = _recorder(made_of, tables, probe)
        held = PhantomProtocol(forces_n=(TARGET_N,))
        frames = [
            *recorder.unloaded("dark"),
            *recorder.pressed("reference", held, ProbePlacement(*BESIDE_MM)),
            *recorder.pressed("press", held, ProbePlacement()),
        ]
        yield _recording(recorder, frames, f"grid {made_of} {probe or ''}", probe)


def _recorder(
    made_of: Scenario, tables: ProbeTables, probe: Probe | None, ramps: PressRamps | None = None
) -> _Recorder:
    stated = probe or simulated_probe()
    camera = replace(camera_settings(stated), bits=8 if made_of.sensor.bits == 8 else 16)
    pressed = VirtualProbe(made_of, tables, (camera.height_px, camera.width_px), camera.scale, ramps=ramps)
    return _Recorder(pressed, camera, made_of.seed, stated.leds.imbalance_ratio)


def _recording(recorder: _Recorder, frames: Sequence[Frame], described: str, probe: Probe | None) -> Recording:
    made_of = recorder.probe.scenario
    return Recording(
        id=str(uuid.uuid5(uuid.NAMESPACE_OID, described)),
        serial=probe.serial if probe else made_of.serial,
        software=__version__,
        started_at="1970-01-01T00:00:00.000Z",
        camera=recorder.camera,
        frames=tuple(frames),
        simulated=True,
        cell=RecordedCell(made_of.cell.counts_per_n, made_of.cell.zero_counts),
    )


def _made_of(scenario: Scenario, probe: Probe | None) -> Scenario:
    """Return a scenario with the lens, axis and distortion, the sensor's bits and the load cell of a probe."""
    if probe is None:
        return scenario
    camera, known, true = probe.camera, probe.geometry, scenario.world.camera
    seen_by = replace(
        true,
        axis_x_mm=known.axis_x_mm + true.axis_x_mm,
        axis_y_mm=known.axis_y_mm + true.axis_y_mm,
        rim_distortion_percent=known.rim_distortion_percent + true.rim_distortion_percent,
    )
    return replace(
        scenario,
        lens=replace(scenario.lens, blur_px=camera.blur_px, distance_mm=camera.lens_distance_mm),
        sensor=replace(scenario.sensor, bits=camera.bits),
        cell=replace(scenario.cell, counts_per_n=probe.cell.counts_per_n),
        world=replace(scenario.world, camera=seen_by),
    )
