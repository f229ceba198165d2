"""Turns features of a press into size, depth and Young's modulus, with a model bundle that has proved itself.

A bundle is a folder of `model.json` and `model.onnx`. It is used only when the hash, the contract and the golden
vectors all hold on this very machine: a network that runs is not yet a network that is right.
Source of the format: the model bundle of docs/contracts.md, schema `tsis.model/1`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
from numpy.typing import NDArray
from onnxruntime.capi import onnxruntime_pybind11_state as runtime_errors

from device.measurement.model_card import CARD_FILE, MODEL_FILE, BundleRefused, ModelCard, read_bundle_file
from device.measurement.paper_mode.feature_definitions import (
    HELD_FEATURES,
    INCLUSION_FIELD_FEATURES,
    PROFILE_FEATURES,
    Definition,
    definition_of,
)
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from device.measurement.quick_mode.profile import HELD_NAMES
from device.measurement.ramp_modes.radial_profile import ROW_NAMES


def _units(names: Iterable[str], group: Mapping[str, Definition]) -> dict[str, str]:
    return {name: definition_of(name, group).unit for name in names}


FEATURE_UNITS = _units(INCLUSION_FIELD_FEATURES, INCLUSION_FIELD_FEATURES)
"""The features of the paper's network: O1, O2, O3, in this order."""
PROFILE_UNITS = _units(ROW_NAMES, PROFILE_FEATURES)
"""The features of a network that reads the press profile: its whole row, ratios all of them."""
HELD_UNITS = _units(HELD_NAMES, HELD_FEATURES)
"""The features of a network that reads one held press."""
RATIO = "1"
"""The unit of a ratio (`Definition`); cards of earlier versions left it empty, and hold all the same."""

GOLDEN_TOLERANCE = 1e-4
"""Relative. Rounding of float32 is 6e-8; processors differ far less than this, wrong weights far more."""

RUNTIME_ERRORS = (
    runtime_errors.Fail,
    runtime_errors.InvalidArgument,
    runtime_errors.InvalidGraph,
    runtime_errors.InvalidProtobuf,
    runtime_errors.NotImplemented,
    runtime_errors.RuntimeException,
)


@dataclass(frozen=True, eq=False)
class Raw:
    """Answer of the network before any interval: mean and standard deviation over its trials.

    estimate, spread: [n, 3] in the order of `UNKNOWNS`. The spread is no accuracy: all trials learned from one data
    set. The estimate may lie outside the training box.
    """

    estimate: NDArray[np.float64]
    spread: NDArray[np.float64]


class ModelBundle:
    """A verified inverse network.

    name; sha256 of model.onnx and card_sha256 of model.json; feature_names: order of the features; feature_range:
    training range of each, in its own unit; box: training range (low, high) of each unknown in mm, mm, kPa;
    card: all of model.json; golden_error_ratio: how far this machine is from the golden vectors.
    """

    def __init__(self, folder: Path, card: bytes, network: bytes) -> None:
        """Use `load`: it alone reads the files. Raises `BundleRefused`."""
        self._made_of = folder, card, network
        fields = ModelCard(folder, card)
        self.card, self.card_sha256 = fields.fields, hashlib.sha256(card).hexdigest()
        self.name = str(fields.of("name", str))
        self.sha256 = _verified_hash(fields, network)
        self.feature_names = _verified_names(fields)
        self.feature_range = fields.ranges("features", self.feature_names)
        self.box = fields.ranges("unknowns", UNKNOWNS)
        self._session, self._fields = _open_session(fields, network), fields
        _verify_contract(fields, self._session, len(self.feature_names))
        self.golden_error_ratio = self.prove()

    def __reduce__(self) -> tuple[type[ModelBundle], tuple[Path, bytes, bytes]]:
        return ModelBundle, self._made_of  # another process opens and verifies it again: a session cannot be sent

    @classmethod
    def load(cls, folder: Path) -> ModelBundle:
        """Return the bundle in a folder; raises `BundleRefused` when anything in it is missing or does not hold."""
        return cls(folder, read_bundle_file(folder, CARD_FILE), read_bundle_file(folder, MODEL_FILE))

    def estimate(self, features: NDArray[np.floating[Any]]) -> Raw:
        """Return the raw estimate of features [n, F], in the order and units of `feature_names`.

        Raises `InvalidQuantity` for another shape and for numbers that are not finite. Features outside the training
        range are answered by extrapolation; see `outside_training_range`.
        """
        with np.errstate(over="ignore"):  # what float32 cannot hold becomes inf and is refused below
            rows = np.asarray(features, dtype=np.float32)
        columns = len(self.feature_names)
        if rows.ndim != 2 or rows.shape[1] != columns:
            bound = f"[n, {columns}] for {', '.join(self.feature_names)}"
            raise InvalidQuantity("shape of features", list(rows.shape), bound, "give one row of features a frame")
        for row, column in np.argwhere(~np.isfinite(rows)):
            name = f"{self.feature_names[column]} of row {row}"
            raise InvalidQuantity(name, rows[row, column], "a finite number", "discard the frame or press again")
        return self._run(rows)

    def outside_training_range(self, features: NDArray[np.floating[Any]]) -> list[str]:
        """Return one sentence for each of the features [F] outside what the network has learned from; [] is good."""
        sentences = []
        for (name, (low, high)), value in zip(self.feature_range.items(), features, strict=True):
            if not low <= value <= high:
                unit = (FEATURE_UNITS | PROFILE_UNITS | HELD_UNITS)[name]
                after = "" if unit == RATIO else f" {unit}"
                spoken = name.rpartition("_")[0].replace("_", " ").capitalize()
                sentences.append(f"{spoken} is {value:.4g}{after}, outside the trained {low:.4g} to {high:.4g}{after}.")
        return sentences

    def _run(self, rows: NDArray[np.float32]) -> Raw:
        estimate, spread = self._session.run(["estimate", "spread"], {"features": rows})
        return Raw(np.asarray(estimate, dtype=np.float64), np.asarray(spread, dtype=np.float64))

    def prove(self) -> float:
        """Run the golden vectors; return the largest relative deviation, or raise `BundleRefused` for it."""
        fields, largest = self._fields, 0.0
        rows = fields.table("golden.features", len(self.feature_names)).astype(np.float32)
        found = self._run(rows)
        for name, values in (("estimate", found.estimate), ("spread", found.spread)):
            expected = fields.table(f"golden.{name}", len(UNKNOWNS))
            if expected.shape != values.shape:
                fields.refuse(f"golden.{name}", f"{len(expected)} rows", f"{len(values)} rows")
            worst = float(np.max(np.abs(values - expected) / np.abs(expected)))
            if not worst <= GOLDEN_TOLERANCE:
                deviation = f"off by {worst:.2g} relative on this machine"
                fields.refuse(f"golden.{name}", deviation, f"reproduced within {GOLDEN_TOLERANCE:g}")
            largest = max(largest, worst)
        return largest


def _verified_hash(fields: ModelCard, network: bytes) -> str:
    stated, found = fields.of("sha256", str), hashlib.sha256(network).hexdigest()
    if stated != found:
        fields.refuse(f"sha256 of {MODEL_FILE}", found, f"{stated} as {CARD_FILE} states")
    return found


def _verified_names(fields: ModelCard) -> tuple[str, ...]:
    features = fields.of("features", list)
    for units in (FEATURE_UNITS, PROFILE_UNITS, HELD_UNITS):
        named = [{"name": name, "unit": unit} for name, unit in units.items()]
        earlier = [{"name": name, "unit": "" if unit == RATIO else unit} for name, unit in units.items()]
        if features in (named, earlier):
            return tuple(units)
    paper = f"{', '.join(FEATURE_UNITS)}, each with its unit and in this order"
    bound = f"{paper}, or the columns of the press profile or of a held press"
    fields.refuse("features", [entry.get("name") if isinstance(entry, dict) else entry for entry in features], bound)


def _open_session(fields: ModelCard, network: bytes) -> onnxruntime.InferenceSession:
    try:
        return open_session(network)
    except RUNTIME_ERRORS as error:
        raise BundleRefused(
            fields.folder, MODEL_FILE, f"unusable ({error})", "a network onnxruntime can run"
        ) from error


def open_session(network: bytes) -> onnxruntime.InferenceSession:
    """Return an onnxruntime session that leaves the probe's other cores alone: one thread, which does not spin."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    return onnxruntime.InferenceSession(network, options, providers=["CPUExecutionProvider"])


def _verify_contract(fields: ModelCard, session: onnxruntime.InferenceSession, feature_count: int) -> None:
    outputs = {"estimate": len(UNKNOWNS), "spread": len(UNKNOWNS)}
    verify_ports(fields.folder, MODEL_FILE, session, feature_count, outputs)


def verify_ports(
    folder: Path, file: str, session: onnxruntime.InferenceSession, features: int, outputs: Mapping[str, int]
) -> None:
    """Raise `BundleRefused` unless a network takes any number of rows of `features`, and gives just these outputs.

    All single precision; `outputs` are their names and columns, in their order.
    """
    expected = {
        "inputs": [("features", "tensor(float)", features)],
        "outputs": [(name, "tensor(float)", columns) for name, columns in outputs.items()],
    }
    for side, ports in (("inputs", session.get_inputs()), ("outputs", session.get_outputs())):
        found = [(port.name, port.type, port.shape[-1]) for port in ports if len(port.shape) == 2]
        if found != expected[side] or any(isinstance(port.shape[0], int) for port in ports):
            shapes = [(port.name, port.type, port.shape) for port in ports]
            bound = f"{expected[side]} (name, type, columns) with any row count"
            raise BundleRefused(folder, f"{side} of {file}", shapes, bound)
