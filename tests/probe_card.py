"""A card of a probe below a folder: settings, certificates, an own model, and a data folder with measurements."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from device.files import medium
from device.measurement.recording.recording import CameraSettings, Recording
from device.measurement.recording.tactile_image import Frame
from device.records.store import Store

SERIAL = "TSIS-0042"
OWN_CARD, STICK = "no-disk:1", "no-disk:2"
CAMERA = CameraSettings(
    width_px=32, height_px=24, bits=8, mm_per_px_x=0.03, mm_per_px_y=0.04, exposure_us=4000.0, gain=1.0
)
FRAME = Frame(np.arange(768, dtype=np.uint8).reshape(24, 32), "press", 0.0, 0.5, (0.6, 0.6, 0.6, 0.6))
RECORDING = Recording("r-0", SERIAL, "1.0", "2026-01-02T03:04:05Z", CAMERA, (FRAME, FRAME))
SETTINGS = f'serial = "{SERIAL}"\nquick_model = "/srv/models/quick"\n'
DROP_IN = "[press]\ntarget_n = 0.6\n"
CERTIFICATE = {"id": "c-1", "serial": SERIAL, "validity": {"expires_at": "2027-01-02T03:04:05Z"}}


def data_of(root: Path) -> Path:
    return root / "var/lib/tsis"


def plug_in_stick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let only data folders of cards lie on the card, and all else on a stick, on whichever disks this machine runs."""
    monkeypatch.setattr(medium, "device_number", lambda path: OWN_CARD if "var/lib/tsis" in str(path) else STICK)


def put(path: Path, content: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content)
    return path


def write_settings(root: Path, settings: str = SETTINGS) -> None:
    put(root / "etc/tsis/config.toml", settings)
    put(root / "etc/tsis/config.d/50-press.toml", DROP_IN)


def write_card(root: Path, measurements: int = 3) -> Path:
    """Write a whole card; return its data folder."""
    data = data_of(root)
    write_settings(root)
    put(root / "srv/models/quick/model.json", '{"schema": "tsis.model/1"}')
    put(data / "calibrations/c-1.json", json.dumps(CERTIFICATE)).chmod(0o444)
    put(data / "calibrations/active", "c-1\n")
    put(data / "config.last_good.toml", SETTINGS)
    store = Store(data)
    for number in range(1, measurements + 1):
        add_measurement(store, number)
    store.add_light_on_s(12.5)
    store.close()
    return data


def add_measurement(store: Store, number: int) -> dict[str, Any]:
    job = {"id": f"p-{number}", "mode": "quick", "state": "done", "code": None, "warnings": [{"code": "E206"}]}
    store.save_press(job)
    record = {"id": f"m-{number}", "recording_id": f"r-{number}", "force_n": 0.5}
    return store.add_measurement(record, replace(RECORDING, id=f"r-{number}"))


def kept_files(root: Path) -> dict[str, bytes]:
    """Return every file that a restored card must have again, by its path below the root, but for the database."""
    skipped = ("lock", "tsis.sqlite", "saved.json")
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for path in sorted(root.rglob("*"))
        if path.is_file() and not path.name.startswith(skipped)
    }


def records(data: Path) -> list[dict[str, Any]]:
    """Return every measurement of a data folder, newest first."""
    store = Store(data)
    try:
        return store.measurements(before_seq=2**62, limit=1000)
    finally:
        store.close()
