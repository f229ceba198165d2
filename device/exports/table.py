"""Measurements as CSV (RFC 4180, UTF-8): wide, a row a measurement, or long, a row a quantity; units in the names.

A cell that people wrote and that a spreadsheet would take for a formula has an apostrophe before it; so has one that
begins with an apostrophe: a program that takes one away has what was written. An empty cell is what is not known:
value and spread of an unknown that the press does not determine, too.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from device.exports.selection import Exported
from device.measurement.confidence_belt import COVERAGE
from device.measurement.feature_definitions import unit_of_feature
from device.measurement.quantities import UNKNOWNS, unit_of

FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""What a cell of a formula begins with, also in full width (OWASP, CSV injection)."""
OF_PRESS = (
    "kind", "simulated", "warnings", "reason", "model_card_sha256", "serial", "software", "interval_level_percent",
    "patient_issuer",
)  # fmt: skip
"""Columns of the wide table that the long one ends with: whoever reads by position goes on."""
OF_EXAM = ("kind", "patient_ref", "order_number", "side", "clock_position", "nipple_distance_mm", "operator", "note")
PARTS_OF_UNKNOWN = ("value", "low", "high", "std", "identifiable", "low_is_open", "high_is_open")
WITH_UNIT = ("low", "high", "std", "mean", "spread")
LONG_COLUMNS = (
    "measurement_id", "taken_at_utc", "exam_id", "patient_ref", "mode", "status", "quantity", "unit",
    "value", "low", "high", "std", "identifiable", "low_is_open", "high_is_open", "voided_at",
    *OF_PRESS,
)  # fmt: skip

Cell = str | float | int | bool | None
CellOf = Callable[[Exported], Cell]


def _of_measurement(name: str) -> CellOf:
    return lambda one: one.measurement.get(name)


def _of_estimate(name: str) -> CellOf:
    return lambda one: one.measurement["estimate"].get(name)


def _interval_level_percent(one: Exported) -> Cell:
    """Return the level of a measurement's intervals; releases that did not keep it knew this one alone."""
    level: Cell = one.measurement["estimate"].get("interval_level_percent", 100 * COVERAGE)
    return level


def _of_exam(name: str) -> CellOf:
    return lambda one: (one.exam or {}).get(name)


def _of_unknown(name: str, part: str) -> CellOf:
    return lambda one: part_of(one.measurement["estimate"][name], part)


def part_of(quantity: Mapping[str, Any], part: str) -> Cell:
    """Return a part of an unknown; value and spread of one that the press does not determine are no measurement."""
    if part in ("value", "std") and not quantity["identifiable"]:
        return None
    found: Cell = quantity.get(part)
    return found


def _of_part(whole: str, name: str) -> CellOf:
    return lambda one: (one.measurement.get(whole) or {}).get(name)


def column_of(name: str, part: str) -> str:
    """Return the name of a column: `size_low_mm` of `size_mm` and `low`, the unit last if the part has it."""
    if part == "value":
        return name
    stem, unit = name.rsplit("_", 1)
    return f"{stem}_{part}_{unit}" if part in WITH_UNIT else f"{stem}_{part}"


WIDE_COLUMNS: Mapping[str, CellOf] = {
    "measurement_id": _of_measurement("id"),
    "seq": _of_measurement("seq"),
    "taken_at_utc": lambda one: one.taken_at,
    "taken_at_local": lambda one: one.taken_at_local,
    "exam_id": _of_measurement("exam_id"),
    **{name: _of_exam(name) for name in OF_EXAM},
    "mode": _of_measurement("mode"),
    **{name: _of_estimate(name) for name in ("status", "reason")},
    **{column_of(name, part): _of_unknown(name, part) for name in UNKNOWNS for part in PARTS_OF_UNKNOWN},
    **{name: _of_measurement(name) for name in ("force_n", "frames", "ramps", "reached")},
    "warnings": lambda one: " ".join(warning["code"] for warning in one.measurement["warnings"]),
    **{f"voided_{name}": _of_part("voided", name) for name in ("at", "by", "reason")},
    **{f"true_{name}": _of_part("truth", name) for name in UNKNOWNS},
    **{name: _of_estimate(name) for name in ("model", "model_sha256", "calibration_id", "simulated")},
    "recording_id": _of_measurement("recording_id"),
    "model_card_sha256": _of_estimate("model_card_sha256"),
    **{name: _of_measurement(name) for name in ("serial", "software")},
    "interval_level_percent": _interval_level_percent,
    "patient_issuer": _of_exam("patient_issuer"),
    **{f"until_{name}": _of_part("until", name) for name in UNKNOWNS},
    "within_s": _of_measurement("within_s"),
    "measurement_version": _of_measurement("version"),
    "exam_changed_at": _of_exam("changed_at"),
}
"""The wide table: what stands in each column of a measurement's row."""


def wide_table(exported: Iterable[Exported]) -> Iterator[bytes]:
    """Yield the table's bytes, the header and then row by row."""
    return written(WIDE_COLUMNS, ([cell(one) for cell in WIDE_COLUMNS.values()] for one in exported))


def long_table(exported: Iterable[Exported]) -> Iterator[bytes]:
    """Yield the tidy table's bytes: of each measurement the unknowns, the force, and every feature."""
    return written(LONG_COLUMNS, (row for one in exported for row in _quantities(one)))


def _quantities(one: Exported) -> Iterator[list[Cell]]:
    measurement, estimate = one.measurement, one.measurement["estimate"]
    patient_ref = (one.exam or {}).get("patient_ref")
    of_all = [measurement["id"], one.taken_at, measurement["exam_id"], patient_ref, measurement["mode"]]
    of_all.append(estimate["status"])
    last = [(measurement["voided"] or {}).get("at"), *(WIDE_COLUMNS[name](one) for name in OF_PRESS)]
    for name in UNKNOWNS:
        yield [*of_all, name, unit_of(name), *(part_of(estimate[name], part) for part in PARTS_OF_UNKNOWN), *last]
    for name, value in ({"force_n": None} | measurement["features"] | {"force_n": measurement["force_n"]}).items():
        yield [*of_all, name, unit_of_feature(name), value, *(None for _ in PARTS_OF_UNKNOWN[1:]), *last]


def written(columns: Iterable[str], rows: Iterable[Iterable[Cell]]) -> Iterator[bytes]:
    """Yield a table's bytes, the header and then row by row."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    for row in rows:
        yield _taken(text)
        writer.writerow([_cell(value) for value in row])
    yield _taken(text)


def _taken(text: io.StringIO) -> bytes:
    content = text.getvalue().encode()
    text.seek(0)
    text.truncate()
    return content


def _cell(value: Cell) -> Any:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str) and value.lstrip(" ").startswith((*FORMULA_STARTS, "'")):
        return f"'{value}"
    return value
