"""Whatever the fallback can say it says in each language, and in the one that the browser likes best."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest
from daemon_process import ROOT

from device.errors import ConfigError, DeviceError
from device.fallback import words as module
from device.fallback.address import ServedAddress
from device.fallback.page import page
from device.fallback.situation import UPDATING, Situation
from device.fallback.words import LANGUAGES, PageWords, wished_language
from device.web.screen.screen_words import LANGUAGES as OF_THE_SCREEN
from device.web.screen.screen_words import words_of

ENGLISH = words_of("en")
GERMAN = PageWords("de")
FALLBACK = ROOT / "device" / "fallback"
OF_SERVICE = "The probe's software"
"""Begins what is said of a release without a name: service text, which is in English."""


def said_by_the_page() -> Iterator[str]:
    """Yield every text that page.py has translated."""
    tree = ast.parse((FALLBACK / "page.py").read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        name = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
        if name in ("said", "words.say") and isinstance(node.args[0], ast.Constant):
            yield node.args[0].value


def said_of_the_situation() -> Iterator[str]:
    """Yield every sentence of situation.py but its docstrings."""
    tree = ast.parse((FALLBACK / "situation.py").read_text(encoding="utf-8"))
    alone = {node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    within = {part for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    texts = {node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    yield from (one.value for one in texts - alone - within if re.match(r"[A-Z][a-z']* \w", one.value))


def test_every_sentence_that_the_page_can_say_has_words() -> None:
    texts = {*said_by_the_page(), *said_of_the_situation()} - {OF_SERVICE}
    assert {"The probe is starting", "It is tried again every few seconds.", "Save support file", "Details"} <= texts
    assert texts <= set(ENGLISH.values())
    of_it = {text for key, text in ENGLISH.items() if key.startswith("fallback.")}
    assert of_it - texts == set()


SITUATIONS = [
    Situation("A release is being installed", UPDATING["checking"], release="0.2.0+9", last_good="0.1.0+3"),
    Situation("The probe's software is stopped", "Whoever stopped it starts it again."),
    Situation("The probe is starting", "This takes up to a minute."),
    Situation(
        "The probe does not start",
        "It is tried again every few seconds.",
        (
            ConfigError("press.target_n is 99.", "Correct it.").as_record(),
            DeviceError(
                "It ended.", "Switch the probe off and on; if that does not help, go back to the last good release."
            ).as_record(),
        ),
        ("Traceback",),
        "0.2.0+9",
        "0.1.0+3",
    ),
]


@pytest.mark.parametrize("situation", SITUATIONS, ids=lambda one: one.headline)
def test_in_german_nothing_is_left_in_english_but_what_service_reads(situation: Situation) -> None:
    text = page(situation, ServedAddress(), GERMAN, is_local=True, has_support=True)
    assert '<html lang="de" ' in text
    shown = re.sub(r"<p class=\"fault-cause\".*?</p>|<pre.*?</pre>", "", text, flags=re.DOTALL)
    german = words_of("de")
    english = {one for key, one in ENGLISH.items() if len(one) > 8 and "{" not in one and one not in german.values()}
    assert [one for one in english if one in shown] == []
    assert german["not_a_diagnosis"] in shown


def test_what_to_do_is_what_the_page_says_itself_before_the_words_of_a_code() -> None:
    refused, silent = SITUATIONS[-1].faults
    assert (GERMAN.meaning(refused), GERMAN.remedy(refused)) == ("Eine Einstellung ist falsch", "Den Service rufen.")
    assert (
        GERMAN.remedy(silent)
        == "Sonde aus- und einschalten. Wenn das nicht hilft, zur letzten guten Version zurückgehen."
    )
    unknown = {"code": "E999", "title": "Something new", "remedy": "Do it."}
    assert (GERMAN.meaning(unknown), GERMAN.remedy(unknown)) == ("Something new", "Do it.")


@pytest.mark.parametrize("content", [None, "{", "[]"])
def test_a_release_without_its_words_speaks_english(content: str | None, tmp_path, monkeypatch) -> None:
    if content is not None:
        for language in LANGUAGES:
            (tmp_path / f"{language}.json").write_text(content)
    monkeypatch.setattr(module, "WORDS", tmp_path)
    words = PageWords("de")
    assert words.say("Go back to {release}", release="0.1.0") == "Go back to 0.1.0"
    assert words.remedy(SITUATIONS[-1].faults[0]) == "Correct it."


@pytest.mark.parametrize(
    ("accepted", "language"),
    [
        ("", "en"),
        ("de", "de"),
        ("de-DE,de;q=0.9,en;q=0.8", "de"),
        ("en-GB,de;q=0.9", "en"),
        ("fr-FR, de ; q=0.5, en;q=0.4", "de"),
        ("de;q=0", "en"),
        ("fr", "en"),
        ("*", "en"),
        ("de;q=x, ;;, " + "en" * 1000, "en"),
    ],
)
def test_the_language_is_the_one_that_the_browser_likes_best(accepted: str, language: str) -> None:
    assert wished_language(accepted) == language


def test_the_page_has_the_languages_of_the_screen() -> None:
    assert set(LANGUAGES) == set(OF_THE_SCREEN)
