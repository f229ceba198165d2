"""The page and the problem document: plain words, nothing of a fault as markup, and ways out at the probe only."""

import re

import pytest

from device.errors import CameraError, ConfigError
from device.fallback.address import ServedAddress
from device.fallback.page import page, problem, revision
from device.fallback.situation import Situation
from device.fallback.words import PageWords
from device.web.schema import Problem

FAULTS = tuple(
    fault.as_record() for fault in (ConfigError("a < 3 & b.", "Correct <it>."), CameraError("None.", "Plug it in."))
)
REFUSED = Situation("The probe does not start", "Again.", FAULTS, ("<script>",), "0.2.0+9", "0.1.0+3")
STARTING = Situation("The probe is starting", "Soon.")
ADDRESS = ServedAddress(serial="TSIS-<7>")


def shown(situation, language="en", *, is_local=True, has_support=True):
    return page(situation, ADDRESS, PageWords(language), is_local=is_local, has_support=has_support)


def test_every_fault_stands_there_as_text():
    text = shown(REFUSED)
    assert re.findall(r'"fault-code">(\w+)<', text) == ["E001", "E101"]
    for words in ("a &lt; 3 &amp; b.", "Correct &lt;it&gt;.", "A setting is wrong", "TSIS-&lt;7&gt;", "&lt;script&gt;"):
        assert words in text


def test_the_screen_at_the_probe_has_the_ways_out_and_the_log_another_machine_has_not():
    assert set(re.findall(r'<button id="([\w-]+)"', shown(REFUSED))) == {"roll-back", "support"}
    assert "Go back to 0.1.0+3" in shown(REFUSED)
    elsewhere = shown(REFUSED, is_local=False)
    assert "<button" not in elsewhere
    assert "&lt;script&gt;" not in elsewhere
    assert "E101" in elsewhere


def test_what_service_needs_is_one_tap_away_and_what_to_do_is_not():
    before, details = shown(REFUSED).split("<details")
    assert "Call service." in before
    assert "a &lt; 3" not in before
    assert "a &lt; 3 &amp; b. Correct &lt;it&gt;." in details
    assert "<details" not in shown(STARTING)


@pytest.mark.parametrize("has_support", [True, False])
def test_what_is_not_there_is_not_offered(has_support):
    text = shown(STARTING, has_support=has_support)
    assert 'id="roll-back"' not in text
    assert ('id="support"' in text) == has_support
    assert "none other on this probe" in text


def test_a_program_gets_the_first_fault_as_problem_and_all_of_them():
    document = Problem.model_validate(problem(REFUSED))
    assert (document.status, document.code, document.detail) == (503, "E001", "a < 3 & b.")
    assert [fault["code"] for fault in problem(REFUSED)["faults"]] == ["E001", "E101"]


def test_a_program_gets_a_problem_also_when_there_is_no_fault():
    document = Problem.model_validate(problem(STARTING))
    assert (document.status, document.code) == (503, "E000")
    assert "The probe is starting" in document.detail


def test_the_page_is_loaded_anew_when_what_it_says_changes():
    assert revision(REFUSED) == revision(Situation(**vars(REFUSED)))
    assert revision(REFUSED) != revision(STARTING)
