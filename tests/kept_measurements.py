"""Measurements as a press leaves them in a store, for what lists, exports and prints them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from probe_card import RECORDING

from device.measurement.recording.recording import Recording
from device.records.store import Store

NOTHING = {"value": None, "low": None, "high": None, "std": None, "identifiable": False}


def unknown(value: float, *, half_width: float, is_open: bool = False) -> dict[str, Any]:
    """Return an unknown that the press determines, with its 90 % interval."""
    ends = {"low": value - half_width, "high": value + half_width, "std": half_width / 1.645}
    return {"value": value, **ends, "identifiable": not is_open, "low_is_open": False, "high_is_open": is_open}


ESTIMATE = {
    "size_mm": unknown(10.2, half_width=0.3),
    "depth_mm": unknown(6.4, half_width=0.5),
    "youngs_modulus_kpa": unknown(81.0, half_width=30.0, is_open=True),
    "status": "partly_identifiable",
    "reason": "The press does not tell the modulus.",
    "mode": "standard",
    "model": "standard",
    "model_sha256": "a1" * 32,
    "model_card_sha256": "b2" * 32,
    "calibration_id": "c-1",
    "simulated": True,
}
REJECTED = dict.fromkeys(("size_mm", "depth_mm", "youngs_modulus_kpa"), NOTHING)


def taken(minute: int) -> str:
    """Return a time of one day."""
    return f"2026-03-04T10:{minute:02d}:05.250Z"


def keep(
    store: Store,
    number: int,
    *,
    exam_id: str | None = None,
    mode: str = "standard",
    status: str = "partly_identifiable",
    recording: Recording = RECORDING,
    picture: bytes = b"",
    **fields: Any,
) -> dict[str, Any]:
    """Keep the measurement m-NUMBER, taken at that minute, and its press p-NUMBER; return the measurement."""
    numbers = {} if "identifiable" in status or status == "ok" else REJECTED
    record = {
        "id": f"m-{number}",
        "taken_at": taken(number),
        "mode": mode,
        "estimate": {**ESTIMATE, **numbers, "status": status, "mode": mode, "model": mode},
        "features": {"contrast_0": 0.25 + number / 100, "force_n": 0.5},
        "force_n": 0.5012,
        "frames": 10,
        "recording_id": f"r-{number}",
        "serial": "SIM-0001",
        "software": "0.1.0",
        "truth": None,
        "warnings": [],
        "ramps": 1,
        "until": None,
        "within_s": None,
        "reached": None,
        **fields,
    }
    kept = store.add_measurement(record, replace(recording, id=f"r-{number}"), exam_id=exam_id, picture=picture)
    store.save_press(
        {
            "id": f"p-{number}", "mode": mode, "state": "done", "progress": 1.0, "reason": "", "code": None,
            "measurement_id": kept["id"], "warnings": [], "light_on_s": 2.0, "ramps": 1, "until": None,
            "within_s": None, "asked_at": taken(number % 60), "exam_id": exam_id,
        }
    )  # fmt: skip
    return kept
