"""Simulated phantom recordings: what the probe would record on a phantom of known inclusion.

The frames come from the virtual probe's own renderer and camera, so that a calibration or a score made from them holds
for the frames that the daemon sees. Simulated: evidence of the method, never of a real probe's accuracy.
"""

from __future__ import annotations

import uuid
from dataclasses import replace

import numpy as np

from device import __version__
from device.measurement.quantities import Inclusion
from device.measurement.recording import CameraSettings, Recording
from device.measurement.tactile_image import Frame, Role
from device.simulation.hand import BESIDE_MM, ON_LESION_MM
from device.simulation.scenario import Scenario
from device.simulation.surface_table import SurfaceTable
from device.simulation.virtual_probe import VirtualProbe

SERIAL = "SIM-0001"
CAMERA = CameraSettings(
    width_px=768, height_px=492, bits=8, mm_per_px_x=0.03125, mm_per_px_y=0.03646, exposure_us=4000.0, gain=1.0
)
LIT, DARK = (0.6, 0.6, 0.6, 0.6), (0.0, 0.0, 0.0, 0.0)
UNLOADED_FRAMES, PRESS_FRAMES = 4, 10
TARGET_N, HOLD_STD_N = 0.5, 0.006
"""Force the hand aims at, and how far it strays while it holds."""


class _Recorder:
    """Takes frames one after the other, each with its true force and the force that the cell reports."""

    def __init__(self, probe: VirtualProbe, seed: int) -> None:
        self.probe, self.rng, self.number = probe, np.random.default_rng(seed), 0
        cell = probe.scenario.cell
        self.force_noise_n = cell.noise_counts / cell.counts_per_n

    def frames(self, role: Role, count: int, *, target_n: float, position_mm: tuple[float, float]) -> list[Frame]:
        return [self._frame(role, target_n, position_mm) for _ in range(count)]

    def _frame(self, role: Role, target_n: float, position_mm: tuple[float, float]) -> Frame:
        self.number += 1
        force_n = max(0.0, self.rng.normal(target_n, HOLD_STD_N)) if target_n else 0.0
        light = DARK if role == "dark" else LIT
        counts = self.probe.frame_counts(
            force_n=force_n,
            position_mm=position_mm,
            led_ratio=light,
            exposure_us=CAMERA.exposure_us,
            gain=CAMERA.gain,
            frame_number=self.number,
        )
        reported_n = force_n + float(self.rng.normal(0.0, self.force_noise_n))
        return Frame(counts, role, self.number / 30.0, reported_n, light)


def phantom_recording(
    inclusion: Inclusion, table: SurfaceTable, *, seed: int, press_frames: int = PRESS_FRAMES
) -> Recording:
    """Return the recording of one phantom: dark, unloaded, reference press and press, with its truth."""
    scenario = replace(Scenario(), inclusion=inclusion, seed=seed)
    probe = VirtualProbe(scenario, table, (CAMERA.height_px, CAMERA.width_px), CAMERA.scale)
    recorder = _Recorder(probe, seed)
    frames = [
        *recorder.frames("dark", UNLOADED_FRAMES, target_n=0.0, position_mm=BESIDE_MM),
        *recorder.frames("reference", UNLOADED_FRAMES, target_n=0.0, position_mm=BESIDE_MM),
        *recorder.frames("reference", PRESS_FRAMES, target_n=TARGET_N, position_mm=BESIDE_MM),
        *recorder.frames("press", press_frames, target_n=TARGET_N, position_mm=ON_LESION_MM),
    ]
    return Recording(
        id=str(uuid.uuid5(uuid.NAMESPACE_OID, f"phantom {inclusion} {seed}")),
        serial=SERIAL,
        software=__version__,
        started_at="1970-01-01T00:00:00.000Z",
        camera=CAMERA,
        frames=tuple(frames),
        truth=inclusion,
        simulated=True,
    )
