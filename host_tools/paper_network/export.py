"""Turns a trained ensemble into a model bundle: `model.onnx` (the arithmetic) and `model.json` (what it is good for).

Input and output are float32, everything between is float64, so that the seed's scatter is not drowned in rounding.
The same rows and seed give the same bytes: a bundle carries no time and no path.
Source of the format: the model bundle of docs/contracts.md; operators: the ONNX standard, opset 17.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from device.files.durable import sync_directory, write_and_sync
from device.measurement.arrays import Array
from device.measurement.bundle import (
    CARD_FILE,
    CARD_HASH_FILE,
    MODEL_FILE,
    SCHEMA,
    card_hash,
    largest_deviation,
    open_session,
)
from device.measurement.paper_mode.estimate import PAPER_UNITS
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from host_tools.paper_network.evaluate import ErrorTable
from host_tools.paper_network.export_refused import ExportRefused
from host_tools.paper_network.network import LAYERS, LOG_RATIOS, Ensemble, unpack
from host_tools.paper_network.train import Trained

OPSET, IR_VERSION = 17, 8
"""Of 2022: old enough for any onnxruntime a probe may carry."""

Constant = Array | NDArray[np.float32] | np.float64 | np.float32

AGREEMENT = 1e-5
"""Largest relative difference between the exported network and NumPy; float32 outputs round at 6e-8."""

GOLDEN_ROWS = 9


def export(trained: Trained, folder: Path, *, software_version: str, training_command: str = "") -> None:
    """Write the bundle of a trained ensemble to `folder`, whole or not at all; an older bundle there is replaced.

    The folder's name becomes the model's name. Raises `ExportRefused` when onnxruntime and NumPy differ by more than
    1e-5 relative on the phantom rows, and as `require_replaceable`, before anything is written.
    """
    network = build_network(trained.ensemble)
    phantoms = held_out_features(trained)
    expected = trained.ensemble.estimate(phantoms)
    agreed_outputs(network, phantoms, {"estimate": expected.estimate, "spread": expected.spread})
    command = training_command or f"python -m host_tools train --trials {trained.trials} --seed {trained.seed}"
    card = {
        "schema": SCHEMA,
        "name": folder.resolve().name,
        "sha256": hashlib.sha256(network).hexdigest(),
        "software_version": software_version,
        **model_card(trained),
        "training_command": command,
    }
    text = json.dumps(card, indent=1, allow_nan=False) + "\n"
    write_folder(folder, {MODEL_FILE: network, CARD_FILE: text.encode()})


def build_network(ensemble: Ensemble) -> bytes:
    """Return the ensemble as serialised ONNX: features float32 [n, 3] -> estimate, spread float32 [n, 3]."""
    scaling, trials = ensemble.scaling, len(ensemble.parameters)
    low, half_width = scaling.box_low, 0.5 * (scaling.box_high - scaling.box_low)
    graph = OnnxGraph()
    logs = graph.add("Log", graph.add("Max", graph.add("Cast", "features", to=TensorProto.DOUBLE), scaling.floor))
    signal = graph.add(
        "Div", graph.add("Sub", graph.add("MatMul", logs, LOG_RATIOS), scaling.log_mean), scaling.log_std
    )
    *hidden, last = unpack(ensemble.parameters)  # weights [trials, fan_in, fan_out] broadcast over the rows
    for layer in hidden:
        signal = graph.add("Sigmoid", graph.add("Add", graph.add("MatMul", signal, layer.weights), layer.biases))
    outputs = graph.add("Add", graph.add("MatMul", signal, last.weights), last.biases)
    unknowns = graph.add("Add", graph.add("Mul", outputs, half_width), low + half_width)  # [trials, n, 3]
    mean = graph.add("ReduceMean", unknowns, axes=[0], keepdims=0)
    length = graph.add("ReduceL2", graph.add("Sub", unknowns, mean), axes=[0], keepdims=0)
    graph.add("Cast", mean, to=TensorProto.FLOAT, output="estimate")
    graph.add("Cast", graph.add("Div", length, np.sqrt(trials - 1.0)), to=TensorProto.FLOAT, output="spread")
    return graph.serialise()


ESTIMATE_AND_SPREAD = {"estimate": len(UNKNOWNS), "spread": len(UNKNOWNS)}


class OnnxGraph:
    """Collects ONNX nodes; arrays given as inputs become constants, of single precision where they are."""

    def __init__(self) -> None:
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def add(self, operator: str, *inputs: str | Constant, output: str = "", **attributes: int | list[int]) -> str:
        """Append a node and return the name of its output."""
        names = [value if isinstance(value, str) else self._constant(value) for value in inputs]
        output = output or f"{operator.lower()}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, names, [output], **attributes))
        return output

    def _constant(self, values: Constant) -> str:
        name = f"constant_{len(self.constants)}"
        kept = values if values.dtype == np.float32 else np.asarray(values, dtype=np.float64)
        self.constants.append(numpy_helper.from_array(np.ascontiguousarray(kept), name))
        return name

    def serialise(self, features: int = LAYERS[0], outputs: Mapping[str, int] = ESTIMATE_AND_SPREAD) -> bytes:
        """Return the checked model from so many features to outputs of so many columns."""

        def port(name: str, columns: int) -> Any:
            return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", columns])

        ports = [port(name, columns) for name, columns in outputs.items()]
        graph = helper.make_graph(self.nodes, "inverse", [port("features", features)], ports, self.constants)
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
        onnx.checker.check_model(model, full_check=True)
        return bytes(model.SerializeToString(deterministic=True))


def held_out_features(trained: Trained) -> Array:
    """Return the phantom rows' features [n, 3], rounded to float32 as the network sees them."""
    return trained.rows.features[trained.rows.phantom_index].astype(np.float32).astype(np.float64)


def agreed_outputs(
    network: bytes,
    rows: Array,
    expected: Mapping[str, Array],
    *,
    tolerance: float = AGREEMENT,
    floor: float = 0.0,
    of: str = "",
) -> dict[str, Array]:
    """Return what onnxruntime makes of rows [n, F], outputs [n, columns] by name: golden vectors are made of these.

    Raises `ExportRefused` when NumPy's `expected` ones are further away than the tolerance: relative, magnitudes below
    `floor` counting as this. `of` names the network in the refusal.
    """
    found = open_session(network).run(list(expected), {"features": rows.astype(np.float32)})
    outputs = {name: np.asarray(one, np.float64) for name, one in zip(expected, found, strict=True)}
    for name, ours in expected.items():
        worst = largest_deviation(outputs[name], ours, floor)
        if not worst <= tolerance:
            raise ExportRefused(
                f"{name} of the exported network{of} differs from NumPy by {worst:.2g} relative, but must agree within "
                f"{tolerance:g}: train anew, or check the installed onnx and onnxruntime. Nothing was written."
            )
    return outputs


def model_card(trained: Trained) -> dict[str, Any]:
    """Return what model.json says of the training: ranges, scaling, held-out errors, golden vectors, origin."""
    rows, scaling = trained.rows, trained.ensemble.scaling
    resolved = np.maximum(rows.features[rows.training_index], scaling.floor)  # below it the network sees no difference
    return {
        "features": [{"name": name, "unit": PAPER_UNITS[name]} for name in rows.feature_names],
        "unknowns": list(UNKNOWNS),
        "architecture": {"layers": list(LAYERS), "hidden": "logistic", "output": "linear"},
        "trials": trained.trials,
        "seed": trained.seed,
        "scaling": {
            "inputs": "(ln(max(features, floor)) @ log_ratios - log_mean) / log_std",
            "floor": scaling.floor.tolist(),
            "log_ratios": LOG_RATIOS.tolist(),
            "log_mean": scaling.log_mean.tolist(),
            "log_std": scaling.log_std.tolist(),
            "outputs": "-1..1 over the box",
            "box_low": scaling.box_low.tolist(),
            "box_high": scaling.box_high.tolist(),
        },
        "training_range": {
            "features": _ranges(rows.feature_names, resolved),
            "unknowns": _ranges(UNKNOWNS, rows.truth[rows.training_index]),
        },
        "scene_defaults": rows.scene_defaults,
        "training_rows": len(rows.training_index),
        "excluded_rows": rows.excluded_rows,
        "dataset_sha256": rows.dataset_sha256,
        "phantoms": rows.truth[rows.phantom_index].tolist(),
        "held_out_errors_percent": _held_out_errors(trained),
        "golden": _golden(trained),
    }


def _ranges(names: tuple[str, ...], table: Array) -> dict[str, list[float]]:
    return {name: [float(column.min()), float(column.max())] for name, column in zip(names, table.T, strict=True)}


def _held_out_errors(trained: Trained) -> dict[str, Any]:
    truth = trained.rows.truth[trained.rows.phantom_index]
    totals = ErrorTable(truth, trained.ensemble.estimate(held_out_features(trained)).estimate).totals()
    by_unknown = {
        unknown: {statistic: float(values[i]) for statistic, values in totals.items()}
        for i, unknown in enumerate(UNKNOWNS)
    }
    return {"phantoms": len(truth), **by_unknown}


def _golden(trained: Trained) -> dict[str, list[list[float]]]:
    """Inputs spread evenly over the sorted training range, with what NumPy makes of them."""
    rows = trained.rows.features[trained.rows.training_index]
    order = np.argsort(rows[:, 0], kind="stable")
    chosen = rows[order[np.linspace(0, len(order) - 1, GOLDEN_ROWS).round().astype(int)]]
    features = chosen.astype(np.float32).astype(np.float64)
    estimate, spread = trained.ensemble.estimate(features)
    return {"features": features.tolist(), "estimate": estimate.tolist(), "spread": spread.tolist()}


def write_folder(folder: Path, files: dict[str, bytes]) -> None:
    """Write a bundle's files, and the hash of its card, to a new folder; make it durable, then put it in place.

    A crash leaves the old folder, the new one or, between two renames, none; never a mixture. Raises as
    `require_replaceable`, since what is replaced is gone.
    """
    require_replaceable(folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{folder.name}.", dir=folder.parent) as scratch:
        fresh, former = Path(scratch) / "new", Path(scratch) / "old"
        fresh.mkdir()
        for name, content in {**files, CARD_HASH_FILE: card_hash(files[CARD_FILE])}.items():
            write_and_sync(fresh / name, content)
        sync_directory(fresh)
        if folder.exists():
            folder.rename(former)
        fresh.rename(folder)
    sync_directory(folder.parent)


OF_BUNDLES = {".json", ".sha256", ".onnx", ".npz"}
"""What the files of a trained bundle end with; a commissioned one has a page, too, and is written once."""


def require_replaceable(folder: Path) -> None:
    """Raise `InvalidQuantity` for what a bundle would take the place of, unless it is an empty folder or a bundle."""
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return
    there = list(folder.iterdir()) if folder.is_dir() else []
    is_bundle = folder / CARD_FILE in there and all(one.is_file() and one.suffix in OF_BUNDLES for one in there)
    if not is_bundle:
        action = "name another one: what is in it would be lost"
        raise InvalidQuantity("out", folder, "a new folder or a model bundle", action)
