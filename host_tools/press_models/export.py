"""Turns the trained modes into model bundles: model.onnx and model.json.

That of the ramps holds surrogate and range classifier, too. The same parts give the same bytes.
Source of the format: the model bundle of docs/contracts.md.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from device.measurement.arrays import Array, Single
from device.measurement.bundle import CARD_FILE, MODEL_FILE, SCHEMA
from device.measurement.confidence_belt import Belt
from device.measurement.mode import FRAMES, Mode
from device.measurement.parameters import NUISANCES, RANGES
from device.measurement.quantities import UNKNOWNS
from device.measurement.quick_mode.model import QUICK_UNITS
from device.measurement.ramp_modes.model import RAMP_UNITS, SURROGATE_FILE, surrogate_arrays
from device.measurement.ramp_modes.radial_profile import network_rows
from device.measurement.ramp_modes.range_classifier import ENTRY, RANGE_FILE
from host_tools.paper_network.export import write_folder
from host_tools.press_models.mode_outcome import ModeOutcome
from host_tools.press_models.mode_statistics import half_width_by_ramps, reachable_half_width, statistics
from host_tools.press_models.onnx_networks import (
    budget_entry,
    build_network,
    build_range_network,
    golden_vectors,
    range_entry,
)
from host_tools.press_models.quick_training import QuickOutcome, TrainedQuick
from host_tools.press_models.ramp_training import TrainedRamp

GOLDEN_ROWS = 8


def export_ramp(
    trained: TrainedRamp, folder: Path, *, serials: tuple[str, ...], software_version: str, training_command: str
) -> None:
    """Write the bundle to `folder`, whole or not at all; raises `ExportRefused` when onnxruntime and NumPy differ.

    `serials` are those of the probes whose light and tables it was trained with: it answers for no other.
    """
    rows = trained.samples.rows[:: len(trained.samples.rows) // GOLDEN_ROWS][:GOLDEN_ROWS].astype(np.float32)
    network = build_network(trained.ensemble)
    read: Array = network_rows(rows.astype(np.float64))
    golden = golden_vectors(trained.ensemble, network, read)
    surrogate = npz_content(surrogate_arrays(trained.answers))
    ranges = build_range_network(trained.ranges.network)
    card = {
        **_card(folder, network, serials, software_version, training_command),
        "surrogate_sha256": hashlib.sha256(surrogate).hexdigest(),
        "seed": trained.seed,
        "dataset_sha256": hashlib.sha256(trained.samples.rows.tobytes()).hexdigest(),
        "effort": budget_entry(asdict(trained.budget)),
        "features": [{"name": name, "unit": unit} for name, unit in RAMP_UNITS.items()],
        "training_range": _training_range(dict(zip(RAMP_UNITS, network_rows(trained.samples.rows).T, strict=True))),
        "surrogate_error": _error(trained.surrogate_error),
        "beside_error": _error(trained.beside_error),
        "modes": {mode: mode_entry(mode, outcome) for mode, outcome in trained.outcomes.items()},
        ENTRY: range_entry(trained.ranges, ranges, np.array(golden["features"])),
        "golden": golden,
    }
    files = {SURROGATE_FILE: surrogate, RANGE_FILE: ranges}
    write_folder(folder, {MODEL_FILE: network, CARD_FILE: _text(card), **files})


def export_quick(
    trained: TrainedQuick,
    folder: Path,
    *,
    surrogate_sha256: str,
    serials: tuple[str, ...],
    software_version: str,
    training_command: str,
    more: Mapping[str, Any] = MappingProxyType({}),
    worth: Mapping[str, Any] = MappingProxyType({}),
) -> None:
    """Write the bundle of mode quick, learnt from the surrogate of that hash; as `export_ramp`.

    Of a commissioned probe its card says `more`, and of the mode what its answers are `worth`.
    """
    rows = trained.training_set.rows[:GOLDEN_ROWS]
    network = build_network(trained.ensemble)
    card = {
        **_card(folder, network, serials, software_version, training_command),
        "seed": trained.seed,
        "dataset_sha256": hashlib.sha256(trained.training_set.rows.tobytes()).hexdigest(),
        "surrogate_sha256": surrogate_sha256,
        **more,
        "effort": budget_entry(asdict(trained.budget)),
        "features": [{"name": name, "unit": unit} for name, unit in QUICK_UNITS.items()],
        "training_range": _training_range(dict(zip(QUICK_UNITS, trained.usual_rows.T, strict=True))),
        "modes": {
            "quick": {
                "faintest_contrast": list(trained.faintest_contrast),
                "elongation_ratio": trained.outcome.elongation_ratio,
                "bands": _belts(trained.outcome.belts),
                **_answers(trained.outcome),
                **worth,
            }
        },
        "golden": golden_vectors(trained.ensemble, network, rows.astype(np.float64)),
    }
    write_folder(folder, {MODEL_FILE: network, CARD_FILE: _text(card)})


def _card(
    folder: Path, network: bytes, serials: tuple[str, ...], software_version: str, training_command: str
) -> dict[str, Any]:
    """Return what every card says first."""
    return {
        "schema": SCHEMA,
        "name": folder.resolve().name,
        "sha256": hashlib.sha256(network).hexdigest(),
        "software_version": software_version,
        "training_command": training_command,
        "serials": list(serials),
        "unknowns": list(UNKNOWNS),
    }


def _training_range(columns: Mapping[str, Array | Single]) -> dict[str, Any]:
    return {
        "features": {name: [float(column.min()), float(column.max())] for name, column in columns.items()},
        "unknowns": {name: [RANGES[name].low, RANGES[name].high] for name in UNKNOWNS},
        "nuisances": {name: [RANGES[name].low, RANGES[name].high] for name in NUISANCES},
    }


def _text(card: dict[str, Any]) -> bytes:
    return (json.dumps(card, indent=1, allow_nan=False) + "\n").encode()


def npz_content(arrays: dict[str, Any]) -> bytes:
    """Return a .npz of arrays by their names."""
    content = io.BytesIO()
    np.savez(content, **arrays)
    return content.getvalue()


def _error(of_columns: Array) -> dict[str, float]:
    return {"largest": float(of_columns.max()), "mean": float(of_columns.mean())}


def mode_entry(mode: Mode, outcome: ModeOutcome) -> dict[str, Any]:
    """Return what the card says of a mode that reads ramps: critical values, statistics, and what a scan can reach."""
    return asdict(outcome.critical) | _reachable(mode, outcome) | _answers(outcome)


def _reachable(mode: Mode, outcome: ModeOutcome) -> dict[str, Any]:
    """Return what accuracy can be asked for, in the mode that goes on until it is there."""
    if not FRAMES[mode].is_scan:
        return {}
    return {
        "reachable_half_width": reachable_half_width(outcome.simulated),
        "half_width_by_ramps": half_width_by_ramps(outcome.simulated, outcome.ramps),
    }


def _belts(belts: tuple[Belt, ...]) -> dict[str, Any]:
    """Return the belts of a mode."""
    parts = "truth", "log_spread", "beside", "low", "high"
    return {
        name: {part: np.round(getattr(of_unknown, part), 4).tolist() for part in parts}
        for name, of_unknown in zip(UNKNOWNS, belts, strict=True)
    }


def _answers(outcome: ModeOutcome | QuickOutcome) -> dict[str, Any]:
    """Return the statistics of a mode."""
    recorded = {} if outcome.recorded is None else {"recorded": statistics(outcome.recorded)}
    return {"simulated": statistics(outcome.simulated)} | recorded
