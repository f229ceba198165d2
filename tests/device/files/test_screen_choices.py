"""What was chosen at the own screen is in the data folder as it was written; what cannot be read is no choice."""

import json

import pytest

from device.fallback.words import LANGUAGES
from device.files.screen_choices import ALLOWED, NAME, ScreenChoices, read_choices, write_choices
from device.web.screen import screen_words

CHOSEN = ScreenChoices("de", "dark", "off")


def test_what_was_written_is_read(tmp_path):
    write_choices(tmp_path / "var", CHOSEN)
    assert read_choices(tmp_path / "var") == CHOSEN
    assert json.loads((tmp_path / "var" / NAME).read_text()) == {"language": "de", "colours": "dark", "sound": "off"}


def test_of_a_probe_where_nobody_has_chosen_nothing_is_said(tmp_path, caplog):
    assert read_choices(tmp_path) == ScreenChoices()
    assert caplog.text == ""


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"null", b"\xff\xfe", b'"de"', b"[" * 100_000])
def test_a_file_that_cannot_be_read_is_no_choice_and_logged(tmp_path, caplog, content):
    (tmp_path / NAME).write_bytes(content)
    assert read_choices(tmp_path) == ScreenChoices()
    assert f"{tmp_path / NAME}, cannot be read and counts as no choice" in caplog.text


def test_a_disk_that_reads_nothing_is_no_choice_and_logged(tmp_path, caplog):
    (tmp_path / NAME).mkdir()
    assert read_choices(tmp_path) == ScreenChoices()
    assert "cannot be read" in caplog.text


@pytest.mark.parametrize("value", ["fr", 1, ["de"], {"de": 1}, True])
def test_a_value_of_another_release_is_no_choice_and_the_others_hold(tmp_path, caplog, value):
    (tmp_path / NAME).write_text(json.dumps({"language": value, "sound": "off", "size": "large"}))
    assert read_choices(tmp_path) == ScreenChoices(sound="off")
    assert "which is none of en, de" in caplog.text


def test_the_languages_are_those_that_the_screen_and_the_fallback_speak():
    assert ALLOWED["language"] == tuple(screen_words.LANGUAGES) == LANGUAGES
