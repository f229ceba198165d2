"""A store with an exam whose measurements can be written as DICOM, and dciodvfy's verdict on what was written."""

from __future__ import annotations

import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from device.measurement.recording.recording import CameraSettings, Recording
from device.measurement.recording.tactile_image import Frame
from device.records.exams import ExamContent
from device.records.store import Store

CAMERA = CameraSettings(
    width_px=64, height_px=64, bits=8, mm_per_px_x=0.05, mm_per_px_y=0.05, exposure_us=4000.0, gain=1.0
)
FRAME = Frame(np.full((64, 64), 90, np.uint8), "press", 0.0, 0.5, (0.6,) * 4)
RECORDING = Recording("r-0", "TSIS-0042", "1.0", "2026-01-02T03:04:05Z", CAMERA, (FRAME,))
OF_A_PATIENT = {
    "kind": "patient", "patient_ref": "Ä-17", "order_number": "2026/1", "side": "left", "clock_position": 10,
    "nipple_distance_mm": 35.0, "operator": "Ada Byron", "note": "Zwei Zeilen\nÜber der Läsion",
}  # fmt: skip
OF_A_PHANTOM = {"kind": "phantom", "operator": "Ada Byron"}
PICTURE = cv2.imencode(".png", np.tile(np.arange(240, dtype=np.uint8), (240, 1)))[1].tobytes()

KNOWN_WARNINGS = {
    "Unrecognized defined term = <99TSIS>": "docs/dicom.md has these terms: there are no public ones",
    "</Laterality(0020,0060)> - is only permitted to be empty when actually unknown": "nobody has said the side",
}
"""What dciodvfy may say, by what it says and why it is right to do it all the same."""
needs_dciodvfy = pytest.mark.skipif(
    not shutil.which("dciodvfy") and "TSIS_REQUIRE_PEERS" not in os.environ,  # there its absence is a failure
    reason="dciodvfy is not installed (Debian: dicom3tools)",
)


def quantity(value: float | None, low: float | None, high: float | None, **said: bool) -> dict[str, Any]:
    return {"value": value, "low": low, "high": high, "std": None, "identifiable": value is not None, **said}


ESTIMATE = {
    "size_mm": quantity(9.8, 9.1, 10.6), "depth_mm": quantity(6.0, 5.5, 6.7, high_is_open=True),
    "youngs_modulus_kpa": quantity(80.0, 40.0, 120.0, identifiable=False), "status": "partly_identifiable",
    "reason": "This press does not determine Young's modulus.", "mode": "standard", "model": "standard",
    "model_sha256": "ab" * 32, "calibration_id": "c-1", "simulated": False,
}  # fmt: skip


def measure(store: Store, exam: dict[str, Any], *, simulated: bool = False, **changes: Any) -> dict[str, Any]:
    """Keep one more measurement of an exam."""
    number = len(store.measurements(before_seq=2**62, limit=200)) + 1
    record = {
        "id": f"00000000-0000-4000-8000-{number:012d}", "recording_id": f"r-{number}", "taken_at":
        "2026-01-02T03:04:05.678Z", "mode": "standard", "estimate": {**ESTIMATE, "simulated": simulated},
        "warnings": [], "force_n": 0.5, **changes,
    }  # fmt: skip
    recording = replace(RECORDING, id=record["recording_id"], simulated=simulated)
    return store.add_measurement(record, recording, exam_id=exam["id"], picture=PICTURE)


def begin(store: Store, **said: Any) -> dict[str, Any]:
    """Make an exam, of a patient unless said otherwise."""
    of_kind = OF_A_PHANTOM if said.get("kind") == "phantom" else OF_A_PATIENT
    return store.exams.make(ExamContent(**{**of_kind, **said}))


def verdict(path: Path) -> list[str]:
    """Return every line in which dciodvfy says something against a file, but for what is known."""
    told = subprocess.run(["dciodvfy", "-new", str(path)], capture_output=True, text=True)
    lines = [line for line in told.stderr.splitlines() if line.startswith(("Error", "Warning"))]
    unknown = [line for line in lines if not any(known in line for known in KNOWN_WARNINGS)]
    is_right = told.returncode == 0 or unknown
    assert is_right, told.stderr
    return unknown
