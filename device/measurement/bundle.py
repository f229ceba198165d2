"""The contents of a model bundle to a network that has proved itself: hash, contract and golden vectors.

All three hold on this very machine: a network that runs is not yet a network that is right. This module knows no mode
and reads no file. Each mode's model says which features it reads; device/files/bundle_file.py reads the folders.
Source of the format: the model bundle of docs/contracts.md, schema `tsis.model/1`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import onnxruntime
from numpy.typing import NDArray
from onnxruntime.capi import onnxruntime_pybind11_state as runtime_errors

from device.measurement.arrays import Array
from device.measurement.mode import Mode, ModeWorth
from device.measurement.parameters import NUISANCES, RANGES
from device.measurement.quantities import UNKNOWNS, Bound, InvalidQuantity

SCHEMA = "tsis.model/1"
MODEL_FILE, CARD_FILE, CARD_HASH_FILE = "model.onnx", "model.json", "model.json.sha256"
"""The network, its card, and the card's own hash as `sha256sum` writes and checks it."""
RATIO = "1"
"""The unit of a ratio (`feature_definitions.Definition`); cards of earlier versions left it empty, and hold as well."""
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

_REMEDY = "Install the bundle again, or train and export it anew."


class BundleRefused(ValueError):  # noqa: N818 - reads as what it says: this bundle was refused
    """A model bundle that must not be used; says which field, its value, the bound and what to do."""

    def __init__(self, folder: Path, field: str, value: object, bound: str, action: str = _REMEDY) -> None:
        self.folder, self.field, self.value, self.bound, self.action = folder, field, value, bound, action
        super().__init__(f"Model bundle {folder}: {field} is {value}, but must be {bound}. {action}")

    def __reduce__(self) -> tuple[type[BundleRefused], tuple[Path, str, object, str, str]]:
        """Carry the error to another process: an exception alone forgets what it was made of."""
        return type(self), (self.folder, self.field, self.value, self.bound, self.action)


@dataclass(frozen=True)
class BundleFiles:
    """The contents of a bundle's files by name; `folder` is where they are from, and only named in refusals."""

    folder: Path
    contents: Mapping[str, bytes]

    def content(self, name: str) -> bytes:
        """Return what a file holds; raises `BundleRefused` when the bundle has no such file."""
        if name not in self.contents:
            raise BundleRefused(self.folder, name, "missing", "in the bundle's folder")
        return self.contents[name]

    def verified(self, name: str, stated: str | None) -> bytes:
        """Return what a file holds whose SHA-256 is the one stated; raises `BundleRefused`."""
        if stated is None:
            raise BundleRefused(
                self.folder, f"the hash of {name}", "missing", "in the card: use a bundle of this version"
            )
        found = hashlib.sha256(self.content(name)).hexdigest()
        if found != stated:
            raise BundleRefused(self.folder, name, found, f"{stated} as {CARD_FILE} states")
        return self.content(name)

    def verified_card(self) -> ModelCard:
        """Return the card, which is the one that was exported: ranges and intervals hang on it; raises `BundleRefused`.

        What it says of itself comes first: an earlier version's card had no hash.
        """
        card = ModelCard(self.folder, self.content(CARD_FILE))
        stated, found = self.content(CARD_HASH_FILE), card_hash(self.content(CARD_FILE))
        if found != stated:
            told = stated.decode(errors="replace").partition(" ")[0][:64]
            raise BundleRefused(
                self.folder, f"sha256 of {CARD_FILE}", found.split()[0].decode(), f"{told!r} as {CARD_HASH_FILE} states"
            )
        return card


def card_hash(card: bytes) -> bytes:
    """Return what stands in `CARD_HASH_FILE` for a card: guards against a slip or a worn disk, and is no signature."""
    return f"{hashlib.sha256(card).hexdigest()}  {CARD_FILE}\n".encode()


class ModelCard:
    """Typed fields of model.json by dotted path; each raises `BundleRefused` when it is missing or wrong."""

    def __init__(self, folder: Path, content: bytes) -> None:
        self.folder, self.fields = folder, _parsed(folder, content)

    def refuse(self, field: str, value: object, bound: str) -> NoReturn:
        """Refuse the bundle of this card."""
        raise BundleRefused(self.folder, field, value, bound)

    def of(self, path: str, kind: type, *within: str) -> Any:
        """Return the field of a dotted path, or of a key `within` it that may hold dots itself."""
        value: Any = self.fields
        for key in (*path.split("."), *within):
            value = value.get(key) if isinstance(value, dict) else None
        if not isinstance(value, kind):
            self.refuse(
                ".".join((path, *within)),
                "missing" if value is None else repr(value),
                f"present and of type {kind.__name__}",
            )
        return value

    def ranges(self, group: str, names: tuple[str, ...]) -> dict[str, tuple[float, float]]:
        """Return (low, high) of each name under training_range."""
        return {name: self._range(f"training_range.{group}", name) for name in names}

    def require_known_ranges(self) -> None:
        """Refuse a network of other ranges of unknowns and nuisances: its coordinates mean something else here."""
        for group, names in (("unknowns", UNKNOWNS), ("nuisances", NUISANCES)):
            for name, (low, high) in self.ranges(group, names).items():
                known = RANGES[name]
                if (low, high) != (known.low, known.high):
                    bound = f"{known.low:g} to {known.high:g}: install models that this software was released with"
                    self.refuse(f"training_range.{group}.{name}", f"{low:g} to {high:g}", bound)

    def _range(self, group: str, name: str) -> tuple[float, float]:
        values, path = self.of(group, list, name), f"{group}.{name}"
        anywhere = Bound(-np.inf, np.inf, "")
        if len(values) != 2 or not all(isinstance(v, int | float) and anywhere.holds(v) for v in values):
            self.refuse(path, values, "two finite numbers")
        low, high = map(float, values)
        if not low < high:
            self.refuse(path, values, "the lower number first")
        return low, high

    def table(self, path: str, columns: int) -> Array:
        """Return a table [n, columns], n >= 1, of finite numbers; a list of numbers is a table of one column."""
        values = self.of(path, list)
        try:
            table = np.array(values, dtype=np.float64)
        except (TypeError, ValueError):
            self.refuse(path, "no table of numbers", f"[n, {columns}] numbers")
        if columns == 1 and table.ndim == 1:
            table = table[:, None]
        if table.ndim != 2 or table.shape[1] != columns or not len(table) or not np.all(np.isfinite(table)):
            self.refuse(path, f"of shape {list(table.shape)}", f"[n, {columns}] finite numbers")
        return table


def _parsed(folder: Path, content: bytes) -> dict[str, Any]:
    try:
        card = json.loads(content)
    except ValueError as error:
        raise BundleRefused(folder, CARD_FILE, f"not JSON ({error})", "valid JSON") from error
    if not isinstance(card, dict) or card.get("schema") != SCHEMA:
        found = card.get("schema") if isinstance(card, dict) else None
        raise BundleRefused(folder, "schema", repr(found), repr(SCHEMA), "Use a bundle made for this software version.")
    return card


class Network:
    """A network of a bundle: features float32 [n, F] to named outputs, each float32 [n, columns]."""

    def __init__(self, folder: Path, file: str, content: bytes, features: int, outputs: Mapping[str, int]) -> None:
        """Open it; raises `BundleRefused` unless it takes `features` columns and gives just these outputs."""
        self._made_of = folder, file, content, features, outputs
        self._outputs = list(outputs)
        try:
            self._session = open_session(content)
        except RUNTIME_ERRORS as error:
            raise BundleRefused(folder, file, f"unusable ({error})", "a network onnxruntime can run") from error
        _verify_ports(folder, file, self._session, features, outputs)

    def __reduce__(self) -> tuple[type[Network], tuple[Path, str, bytes, int, Mapping[str, int]]]:
        return Network, self._made_of  # another process opens it again: a session cannot be sent

    def run(self, rows: NDArray[np.floating[Any]]) -> dict[str, Array]:
        """Return the outputs [n, columns] by name, for features [n, F]."""
        found = self._session.run(self._outputs, {"features": rows.astype(np.float32)})
        return {name: np.asarray(one, dtype=np.float64) for name, one in zip(self._outputs, found, strict=True)}


@dataclass(frozen=True, eq=False)
class GoldenVectors:
    """Features [n, F] and the outputs [n, columns] that a network gave for them where it was trained.

    `path`: of the outputs in the card. `floor`: magnitudes below it count as this, where an output crosses zero.
    """

    card: ModelCard
    path: str
    rows: Array
    outputs: Mapping[str, Array]
    floor: float = 0.0

    @classmethod
    def of_card(
        cls, card: ModelCard, path: str, features: int, outputs: Mapping[str, int], *, floor: float = 0.0
    ) -> GoldenVectors:
        """Return what a card states under `path`, for its golden features; raises `BundleRefused`."""
        rows = card.table("golden.features", features)
        tables = {name: card.table(f"{path}.{name}", columns) for name, columns in outputs.items()}
        for name, table in tables.items():
            if len(table) != len(rows):
                card.refuse(f"{path}.{name}", f"{len(table)} rows", f"{len(rows)} rows")
        return cls(card, path, rows, tables, floor)

    def prove(self, network: Network) -> float:
        """Run them; return the largest relative deviation, or raise `BundleRefused` for it."""
        largest = 0.0
        for name, found in network.run(self.rows).items():
            deviation = largest_deviation(found, self.outputs[name], self.floor)
            if not deviation <= GOLDEN_TOLERANCE:
                found_off = f"off by {deviation:.2g} relative on this machine"
                self.card.refuse(f"{self.path}.{name}", found_off, f"reproduced within {GOLDEN_TOLERANCE:g}")
            largest = max(largest, deviation)
        return largest


def largest_deviation(found: Array, expected: Array, floor: float = 0.0) -> float:
    """Return the largest |found - expected| over the larger of |expected| and `floor`."""
    return float(np.max(np.abs(found - expected) / np.maximum(np.abs(expected), floor)))


@dataclass(frozen=True, eq=False)
class Raw:
    """Answer of the network before any interval: mean and standard deviation over its trials.

    estimate, spread: [n, 3] in the order of `UNKNOWNS`. The spread is no accuracy: all trials learned from one data
    set. The estimate may lie outside the training box.
    """

    estimate: Array
    spread: Array


class ModelBundle:
    """A verified inverse network: features of a press to size, depth and Young's modulus.

    folder: where it is from; name; sha256 of model.onnx and card_sha256 of model.json; feature_names: order of the
    features; feature_range: training range of each, in its own unit; box: training range (low, high) of each unknown in
    mm, mm, kPa; card: all of model.json, `fields` the same by type; golden_error_ratio: how far this machine is from
    the golden vectors.
    """

    def __init__(self, files: BundleFiles, feature_units: Mapping[str, str]) -> None:
        """Verify the contents of a bundle that reads these features, named in order with their units.

        Raises `BundleRefused` when anything is missing or does not hold.
        """
        self._made_of, self.folder = (files, feature_units), files.folder
        self.fields, self.card_sha256 = files.verified_card(), hashlib.sha256(files.content(CARD_FILE)).hexdigest()
        self.card = self.fields.fields
        self.name = str(self.fields.of("name", str))
        self.sha256 = _verified_hash(self.fields, files.content(MODEL_FILE))
        self.feature_names = _verified_names(self.fields, feature_units)
        self.feature_range = self.fields.ranges("features", self.feature_names)
        self.box = self.fields.ranges("unknowns", UNKNOWNS)
        columns, outputs = len(self.feature_names), {"estimate": len(UNKNOWNS), "spread": len(UNKNOWNS)}
        self._network = Network(files.folder, MODEL_FILE, files.content(MODEL_FILE), columns, outputs)
        self._golden = GoldenVectors.of_card(self.fields, "golden", columns, outputs)
        self.golden_error_ratio = self.prove()

    def __reduce__(self) -> tuple[type[ModelBundle], tuple[BundleFiles, Mapping[str, str]]]:
        return ModelBundle, self._made_of  # another process verifies it again

    def worth(self, mode: Mode) -> ModeWorth | None:
        """Return what the card says the answers of a mode are worth, None when it says nothing; may refuse it."""
        if "dial" not in self.card.get("modes", {}).get(mode, {}):
            return None
        path, fields = f"modes.{mode}.dial", self.fields
        return ModeWorth(
            compute_s=fields.of(f"{path}.compute_ms", float) / 1e3,
            answered_ratio=fields.of(f"{path}.answered", int) / fields.of(f"{path}.presses", int),
            median_percent={name: fields.of(f"{path}.median_percent.{name}", float) for name in UNKNOWNS},
            determined_ratio={name: fields.of(f"{path}.determined.{name}", float) for name in UNKNOWNS},
            reachable_half_width=self._reachable(f"modes.{mode}"),
            half_width_by_ramps=self._by_ramps(f"modes.{mode}"),
        )

    def _reachable(self, path: str) -> dict[str, float] | None:
        """Return the narrowest half widths that the card states of a mode; None when it states none."""
        if "reachable_half_width" not in self.fields.of(path, dict):
            return None
        path = f"{path}.reachable_half_width"
        return {name: self.fields.of(f"{path}.{name}", float) for name in self.fields.of(path, dict)}

    def _by_ramps(self, path: str) -> dict[int, dict[str, tuple[float, ...]]]:
        """Return the half widths that the card states of scans of so many ramps; {} when it states none."""
        if "half_width_by_ramps" not in self.fields.of(path, dict):
            return {}
        path, by_ramps = f"{path}.half_width_by_ramps", {}
        for ramps in self.fields.of(path, dict):
            if not ramps.isdecimal():
                self.fields.refuse(path, repr(ramps), "by numbers of ramps")
            columns = {name: self.fields.table(f"{path}.{ramps}.{name}", 1)[:, 0] for name in UNKNOWNS}
            by_ramps[int(ramps)] = {name: tuple(column.tolist()) for name, column in columns.items()}
        return by_ramps

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
        return Raw(**self._network.run(rows))

    def outside_training_range(self, features: NDArray[np.floating[Any]]) -> dict[str, tuple[float, float]]:
        """Return the trained range of each of the features [F] that lies outside it, by name; {} is good."""
        ranges = zip(self.feature_range.items(), features, strict=True)
        return {name: (low, high) for (name, (low, high)), value in ranges if not low <= value <= high}

    def prove(self) -> float:
        """Run the golden vectors; return the largest relative deviation, or raise `BundleRefused` for it."""
        return self._golden.prove(self._network)


def _verified_hash(fields: ModelCard, network: bytes) -> str:
    stated, found = fields.of("sha256", str), hashlib.sha256(network).hexdigest()
    if stated != found:
        fields.refuse(f"sha256 of {MODEL_FILE}", found, f"{stated} as {CARD_FILE} states")
    return found


def _verified_names(fields: ModelCard, units: Mapping[str, str]) -> tuple[str, ...]:
    features = fields.of("features", list)
    named = [{"name": name, "unit": unit} for name, unit in units.items()]
    earlier = [{"name": name, "unit": "" if unit == RATIO else unit} for name, unit in units.items()]
    if features not in (named, earlier):
        found = [f"{e.get('name')} ({e.get('unit')})" if isinstance(e, dict) else repr(e) for e in features]
        expected = ", ".join(f"{name} ({unit})" for name, unit in units.items())
        fields.refuse("features", f"[{', '.join(found)}]", f"{expected}, in this order")
    return tuple(units)


def open_session(network: bytes) -> onnxruntime.InferenceSession:
    """Return an onnxruntime session that leaves the probe's other cores alone: one thread, which does not spin."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    return onnxruntime.InferenceSession(network, options, providers=["CPUExecutionProvider"])


def _verify_ports(
    folder: Path, file: str, session: onnxruntime.InferenceSession, features: int, outputs: Mapping[str, int]
) -> None:
    """Raise `BundleRefused` unless a network takes any number of rows of `features`, and gives just these outputs."""
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
