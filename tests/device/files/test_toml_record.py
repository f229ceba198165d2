"""A TOML file to a record: what is misspelt, mistyped, missing or no TOML is refused with the key."""

import pickle
import tomllib
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest

from device.files.toml_record import InvalidRecord, as_table, from_table, read_toml, table_problems
from device.measurement.quantities import Bound, InvalidQuantity, require


@dataclass(frozen=True)
class Lens:
    focal_mm: float
    stops: int = 4

    def __post_init__(self):
        require("lens.focal_mm", self.focal_mm, Bound(1.0, 50.0, "mm"), "use another lens")


@dataclass(frozen=True)
class Optics:
    name: str = "none"
    folder: Path = Path("here")
    polarised: bool = False
    ratio: tuple[float, ...] = (1.0,)
    lens: Lens = field(default_factory=lambda: Lens(8.0))


@dataclass(frozen=True)
class Tap:
    name: str
    opens_at: datetime | None = None
    heights_mm: tuple[Annotated[float, Bound(0.0, 90.0, "mm")], ...] = (0.0, 1.0)
    place_mm: tuple[float, float] = (0.0, 0.0)
    shape: Literal["round", "square"] = "round"
    lenses: tuple[Lens, ...] = ()
    other: dict[str, Any] = field(default_factory=dict)


def refusal_of(table):
    with pytest.raises(InvalidQuantity) as refusal:
        from_table(Optics, table)
    return refusal.value


def test_a_whole_table_becomes_the_record(tmp_path):
    (tmp_path / "o.toml").write_text(
        'name = "b"\nfolder = "there"\npolarised = true\nratio = [0.5, 1]\n[lens]\nfocal_mm = 25\n'
    )
    expected = Optics("b", Path("there"), polarised=True, ratio=(0.5, 1), lens=Lens(25.0, 4))
    assert read_toml(Optics, tmp_path / "o.toml") == expected


def test_absent_keys_take_the_defaults():
    assert from_table(Optics, {}) == Optics()


@pytest.mark.parametrize("focal_mm", [1.0, 50.0])
def test_both_ends_of_the_records_own_bound_are_taken(focal_mm):
    assert from_table(Optics, {"lens": {"focal_mm": focal_mm}}).lens.focal_mm == focal_mm


@pytest.mark.parametrize("focal_mm", [0.99, 50.01, float("nan"), float("inf")])
def test_beyond_the_records_own_bound_is_refused(focal_mm):
    assert refusal_of({"lens": {"focal_mm": focal_mm}}).quantity == "lens.focal_mm"


@pytest.mark.parametrize(
    ("table", "key", "meant"),
    [
        ({"nam": "b"}, "nam", "did you mean name"),
        ({"lens": {"focal_cm": 1.0}}, "lens.focal_cm", "did you mean lens.focal_mm"),
        ({"zzz": 1}, "zzz", "remove it"),
    ],
)
def test_an_unknown_key_is_refused_with_what_was_meant(table, key, meant):
    error = refusal_of(table)
    assert error.quantity == key
    assert error.action == meant


def test_a_refused_key_comes_with_all_the_known_ones():
    assert refusal_of({"zzz": 1}).bound == "one of name, folder, polarised, ratio, lens"


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("name", 3),
        ("name", ["b"]),
        ("folder", 3),
        ("folder", ["here"]),
        ("polarised", 1),
        ("polarised", "yes"),
        ("ratio", 0.5),
        ("ratio", "0.5"),
    ],
)
def test_a_wrong_type_is_refused_by_its_key(key, value):
    error = refusal_of({key: value})
    assert error.quantity == key
    assert error.value == repr(value)


@pytest.mark.parametrize(
    ("key", "value"), [("stops", 4.0), ("stops", True), ("stops", [4]), ("focal_mm", "8"), ("focal_mm", True)]
)
def test_a_wrong_type_inside_a_section_is_refused_by_its_whole_key(key, value):
    assert refusal_of({"lens": {"focal_mm": 8.0} | {key: value}}).quantity == f"lens.{key}"


def test_a_whole_number_is_a_number():
    assert from_table(Optics, {"lens": {"focal_mm": 8}}).lens.focal_mm == 8


def test_a_number_where_a_section_is_due_is_refused_with_how_to_write_it():
    assert "[lens]" in refusal_of({"lens": 8.0}).action


def test_a_missing_key_without_a_default_is_named():
    assert str(refusal_of({"lens": {"stops": 2}})) == "lens.focal_mm is missing, but must be given: add it."


def test_a_missing_file_is_refused_by_its_path(tmp_path):
    with pytest.raises(InvalidQuantity, match=r"none\.toml.*No such file"):
        read_toml(Optics, tmp_path / "none.toml")


@pytest.mark.parametrize("content", [b"name = \n", b"name = 'a'\nname = 'b'\n", b"\xff\xfe"])
def test_what_is_no_toml_is_refused_by_its_path(tmp_path, content):
    (tmp_path / "bad.toml").write_bytes(content)
    with pytest.raises(InvalidQuantity, match=r"bad\.toml, but must be valid TOML"):
        read_toml(Optics, tmp_path / "bad.toml")


def test_a_toml_error_says_in_which_line(tmp_path):
    (tmp_path / "bad.toml").write_text("name = 'a'\npolarised = maybe\n")
    with pytest.raises(InvalidQuantity, match="line 2"):
        read_toml(Optics, tmp_path / "bad.toml")


def test_all_unknown_keys_are_found_at_once_and_then_the_wrong_types():
    table = {"nam": "b", "ratio": [1, "x", True], "lens": {"focal_mm": "8", "stop": 4}, "name": "good"}
    assert [problem.quantity for problem in table_problems(Optics, table)] == [
        "lens.stop", "nam", "ratio[1]", "ratio[2]", "lens.focal_mm",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"heights_mm": [1.0, 91.0]}, "heights_mm[1] is 91.0, but must be at least 0 and at most 90 mm: correct it."),
        ({"place_mm": [1.0]}, "place_mm[1] is missing, but must be given: add it."),
        ({"place_mm": [1.0, 2, 3]}, "place_mm is [1.0, 2, 3], but must be at most 2 items: correct it."),
        ({"place_mm": [1.0, float("inf")]}, "place_mm[1] is inf, but must be a finite number: correct it."),
        ({"place_mm": [1.0, float("nan")]}, "place_mm[1] is nan, but must be a finite number: correct it."),
        ({"shape": "oval"}, "shape is 'oval', but must be 'round' or 'square': correct it."),
        ({"lenses": [{"focal_mm": 8.0}, {"focal_cm": 1.0}]}, "lenses[1].focal_cm is 1.0, "),
        ({"opens_at": 7.5}, "opens_at is 7.5, but must be a valid datetime: correct it."),
    ],
)
def test_what_an_annotation_demands_is_demanded(table, message):
    with pytest.raises(InvalidQuantity) as refusal:
        from_table(Tap, {"name": "left"} | table)
    assert str(refusal.value).startswith(message)


def test_a_table_of_any_content_and_a_time_are_taken_as_they_are():
    text = 'name = "left"\nopens_at = 2026-01-31T12:00:00Z\n[other.deep]\nlist = [1, 2.5, "x"]\n'
    tap = from_table(Tap, tomllib.loads(text))
    assert tap.opens_at == datetime(2026, 1, 31, 12, tzinfo=UTC)
    assert tap.other == {"deep": {"list": [1, 2.5, "x"]}}


def test_a_record_is_the_table_that_it_is_read_from():
    optics = Optics("b", Path("there"), lens=Lens(25.0))
    assert from_table(Optics, as_table(optics)) == optics
    assert "opens_at" not in as_table(Tap("left"), without_none=True)


def test_a_refusal_has_a_line_for_each_problem_also_in_another_process():
    error = refusal_of({"name": 3, "nam": "b"})
    assert isinstance(error, InvalidRecord)
    carried = pickle.loads(pickle.dumps(error))
    assert str(carried).splitlines() == str(error).splitlines() == [str(problem) for problem in carried.problems]
    assert (carried.quantity, len(carried.problems)) == ("nam", 2)
