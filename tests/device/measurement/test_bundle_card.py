"""A model's card gives typed fields, and refuses the bundle by the name of the field that is missing or wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from device.measurement.bundle import SCHEMA, BundleRefused, ModelCard

SIZE_RANGE = "training_range.unknowns.size_mm"


def card_with(**fields: Any) -> ModelCard:
    return ModelCard(Path("demo"), json.dumps({"schema": SCHEMA, **fields}).encode())


def test_a_field_is_found_by_its_path_and_a_key_may_hold_dots() -> None:
    card = card_with(modes={"quick": {"size.mm": 3.0}})
    assert card.of("modes.quick", dict) == {"size.mm": 3.0}
    assert card.of("modes.quick", float, "size.mm") == 3.0


@pytest.mark.parametrize("path", ["name", "modes.quick", "name.first"])
def test_a_missing_field_is_refused_by_its_path(path: str) -> None:
    with pytest.raises(BundleRefused, match=rf"^Model bundle demo: {path} is missing, but must be present"):
        card_with(modes={}).of(path, str)


def test_a_field_of_another_type_is_refused_with_its_value() -> None:
    with pytest.raises(BundleRefused, match=r"name is 7, but must be present and of type str"):
        card_with(name=7).of("name", str)


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe"])
def test_a_card_that_is_not_json_is_refused(content: bytes) -> None:
    with pytest.raises(BundleRefused, match=r"model\.json is not JSON"):
        ModelCard(Path("demo"), content)


@pytest.mark.parametrize("content", [b"[]", b"{}", b'{"schema": "tsis.model/2"}'])
def test_an_unknown_schema_is_refused(content: bytes) -> None:
    with pytest.raises(BundleRefused, match=r"schema is .* but must be 'tsis\.model/1'"):
        ModelCard(Path("demo"), content)


def test_a_training_range_is_given_by_name() -> None:
    card = card_with(training_range={"unknowns": {"size_mm": [0, 15.0]}})
    assert card.ranges("unknowns", ("size_mm",)) == {"size_mm": (0.0, 15.0)}


@pytest.mark.parametrize("bad", [[1.0], [2.0, 1.0], [0.0, float("nan")], ["0", "1"], None])
def test_a_training_range_that_is_none_is_refused(bad: object) -> None:
    card = card_with(training_range={"unknowns": {"size_mm": bad}})
    with pytest.raises(BundleRefused, match=rf"{SIZE_RANGE} is"):
        card.ranges("unknowns", ("size_mm",))


def test_a_table_has_its_rows_and_columns() -> None:
    table = card_with(golden={"estimate": [[1, 2.0, 3.0], [4.0, 5.0, 6.0]]}).table("golden.estimate", 3)
    np.testing.assert_array_equal(table, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


@pytest.mark.parametrize("table", [[], [[1.0, 2.0]], [[1.0, 2.0, "x"]], [[1.0, 2.0, float("nan")]]])
def test_a_table_of_another_shape_or_without_a_number_is_refused(table: list[Any]) -> None:
    with pytest.raises(BundleRefused, match=r"golden\.estimate is"):
        card_with(golden={"estimate": table}).table("golden.estimate", 3)
