"""What a press leaves behind: the recording of its frames, and the record of what was measured.

The record says in which mode the press was taken; the estimate in it, which mode's model answered. They are kept by
`device.records.store` and described in docs/contracts.md.
"""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from typing import Any

from device import __version__
from device.config import Config
from device.errors import DeviceError
from device.measurement.estimate import Estimate
from device.measurement.mode import Mode
from device.measurement.quantities import Inclusion
from device.measurement.recording import CameraSettings, RecordedCell, Recording
from device.measurement.tactile_image import Frame


def recording_of(
    frames: Sequence[Frame],
    config: Config,
    *,
    started_at: str,
    calibration_id: str | None,
    simulated_truth: Inclusion | None,
) -> Recording:
    """Return a new recording of a probe's frames; a probe whose truth is known is a simulated one."""
    camera = config.camera
    settings = CameraSettings(
        width_px=camera.width_px,
        height_px=camera.height_px,
        bits=8,
        mm_per_px_x=camera.mm_per_px_x,
        mm_per_px_y=camera.mm_per_px_y,
        exposure_us=camera.exposure_us,
        gain=camera.gain,
    )
    return Recording(
        id=str(uuid.uuid4()),
        serial=config.serial,
        software=__version__,
        started_at=started_at,
        camera=settings,
        frames=tuple(frames),
        calibration_id=calibration_id,
        truth=simulated_truth,
        simulated=simulated_truth is not None,
        cell=RecordedCell(config.cell.sensitivity_counts_per_n, config.cell.commissioned_tare_counts),
    )


def measurement_record(
    recording: Recording, estimate: Estimate, mode: Mode, warnings: Sequence[DeviceError]
) -> dict[str, Any]:
    """Return the JSON object of a new measurement, without its sequence number."""
    press = recording.with_role("press")
    return {
        "id": str(uuid.uuid4()),
        "taken_at": recording.started_at,
        "mode": mode,
        "estimate": estimate.as_record(),
        "features": estimate.features,
        "force_n": sum(frame.force_n for frame in press) / len(press),
        "frames": len(press),
        "recording_id": recording.id,
        "truth": None if recording.truth is None else vars(recording.truth),
        "warnings": [warning.as_record() for warning in warnings],
    }
