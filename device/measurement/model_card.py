"""model.json, the card of a model bundle, read field by field: what is missing or of another kind refuses the bundle.

Source of the format: the model bundle of docs/contracts.md, schema `tsis.model/1`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound

SCHEMA = "tsis.model/1"
MODEL_FILE, CARD_FILE = "model.onnx", "model.json"

_REMEDY = "Install the bundle again, or train and export it anew."


class BundleRefused(ValueError):  # noqa: N818 - reads as what it says: this bundle was refused
    """A model bundle that must not be used; says which field, its value, the bound and what to do."""

    def __init__(self, folder: Path, field: str, value: object, bound: str, action: str = _REMEDY) -> None:
        self.folder, self.field, self.value, self.bound = folder, field, value, bound
        super().__init__(f"Model bundle {folder}: {field} is {value}, but must be {bound}. {action}")


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

    def _range(self, group: str, name: str) -> tuple[float, float]:
        values, path = self.of(group, list, name), f"{group}.{name}"
        anywhere = Bound(-np.inf, np.inf, "")
        if len(values) != 2 or not all(isinstance(v, int | float) and anywhere.holds(v) for v in values):
            self.refuse(path, values, "two finite numbers")
        low, high = map(float, values)
        if not low < high:
            self.refuse(path, values, "the lower number first")
        return low, high

    def table(self, path: str, columns: int) -> NDArray[np.float64]:
        """Return a table [n, columns], n >= 1, of finite numbers."""
        values = self.of(path, list)
        try:
            table = np.array(values, dtype=np.float64)
        except (TypeError, ValueError):
            self.refuse(path, "no table of numbers", f"[n, {columns}] numbers")
        if table.ndim != 2 or table.shape[1] != columns or not len(table) or not np.all(np.isfinite(table)):
            self.refuse(path, f"of shape {list(table.shape)}", f"[n, {columns}] finite numbers")
        return table


def read_bundle_file(folder: Path, file: str) -> bytes:
    """Return a file of a bundle; raises `BundleRefused` when it cannot be read."""
    try:
        return (folder / file).read_bytes()
    except OSError as error:
        raise BundleRefused(folder, file, f"unreadable ({error.strerror})", "a readable file") from error


def _parsed(folder: Path, content: bytes) -> dict[str, Any]:
    try:
        card = json.loads(content)
    except ValueError as error:
        raise BundleRefused(folder, CARD_FILE, f"not JSON ({error})", "valid JSON") from error
    if not isinstance(card, dict) or card.get("schema") != SCHEMA:
        found = card.get("schema") if isinstance(card, dict) else None
        raise BundleRefused(folder, "schema", repr(found), repr(SCHEMA), "Use a bundle made for this software version.")
    return card
