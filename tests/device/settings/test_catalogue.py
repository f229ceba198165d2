"""Every setting is known by name, default, range and sentence; a value is written so that TOML reads it back."""

import tomllib
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import get_type_hints

import pytest
from daemon_process import ROOT

from device.config import Config, LightSection
from device.files.toml_record import annotation_parts, table_problems
from device.settings.catalogue import SETTINGS, Known
from device.settings.page import markdown

WORDS = Known("w", "", str)


def test_the_page_of_the_settings_is_the_one_the_program_writes():
    assert (ROOT / "docs" / "settings.md").read_text(encoding="utf-8") == markdown()


def test_every_field_of_every_section_is_a_setting():
    sections = {one.name: get_type_hints(Config)[one.name] for one in fields(Config)}
    names = [name for name, kind in sections.items() if not is_dataclass(kind)]
    names += [f"{name}.{one.name}" for name, kind in sections.items() if is_dataclass(kind) for one in fields(kind)]
    assert list(SETTINGS) == names


@pytest.mark.parametrize("known", SETTINGS.values(), ids=lambda known: known.name)
def test_a_setting_has_a_sentence_and_a_number_has_a_range(known):
    assert known.sentence.endswith(".")
    kinds = {type(known.default)} if known.default is not None else {*annotation_parts(known.kind)}
    numbers = bool(kinds & {int, float, tuple}) and known.default != ()  # () may hold names
    assert numbers == (known.bound is not None)


@pytest.mark.parametrize("known", SETTINGS.values(), ids=lambda known: known.name)
def test_the_bound_of_the_catalogue_is_the_one_a_file_is_checked_by(known):
    """A type alias that the catalogue reads otherwise than pydantic would document a range that does not hold."""
    if known.bound is None:
        return
    beyond = int(known.bound.high) + 1
    table = {known.section: {known.name.rpartition(".")[2]: [beyond] * 4 if "4 numbers" in known.range else beyond}}
    problems = table_problems(Config, table)
    assert {problem.quantity.partition("[")[0] for problem in problems} == {known.name}
    assert {problem.bound for problem in problems} == {str(known.bound)}


@pytest.mark.parametrize("text", ["TSIS-0001", 'a "b" \\c', "Größe µ 𝜇", "tab\tnewline\n", "\x7f\x01"])
def test_a_text_is_written_as_toml_reads_it(text):
    assert tomllib.loads(f"text = {WORDS.written(text)}") == {"text": text}


@pytest.mark.parametrize(
    ("name", "value", "written"),
    [
        ("paper_model", Path("/opt/m"), '"/opt/m"'),
        ("light.address", 0x0A, "0x0a"),
        ("light.ratio", (0.5, 1), "[0.5, 1]"),
        ("light.commissioned_counts", None, "not set"),
        ("cell.sensitivity_counts_per_n", 1e-5, "1e-05"),
        ("press.mode", "paper", '"paper"'),
    ],
)
def test_each_type_has_its_way_to_be_written(name, value, written):
    assert SETTINGS[name].written(value) == written


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("light.address", "0x08 to 0x77"),
        ("light.ratio", "4 numbers, above 0 to 1"),
        ("cell.baud", "300 to 4000000"),
        ("press.mode", "quick, standard, precise, paper"),
        ("serial", ""),
    ],
)
def test_the_range_is_told_in_words(name, words):
    assert SETTINGS[name].range == words


def test_the_value_of_a_configuration_is_found_by_the_full_name():
    config = Config(serial="TSIS-0009", light=LightSection(bus=3))
    assert [SETTINGS[name].value(config) for name in ("serial", "light.bus")] == ["TSIS-0009", 3]
