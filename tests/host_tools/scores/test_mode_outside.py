"""Shares of refused presses; what the modes say of them is made up."""

from __future__ import annotations

from typing import Any, cast

import pytest

from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, Quantity
from device.measurement.mode import Mode
from device.measurement.recording.recording import Recording
from host_tools.scores.outside import ORDINARY_KIND, Kind, outside_chapter, refused_share

ANSWERED, UNDETERMINED, REFUSED, UNSEEN = "answered", "undetermined", "refused", "unseen"


def presses(*outcomes: str, name: str = "spots", modes: tuple[Mode, ...] = ("standard", "quick")) -> Kind:
    """Each recording is the word for what is made of it."""
    return Kind(name, len(outcomes), lambda mode, i: cast(Recording, outcomes[i]), modes)


def answer(recording: Recording, mode: Mode) -> Estimate:
    outcome: Any = recording
    value = Quantity(10.0, 9.0, 11.0, 1.0, True) if outcome in (ANSWERED, UNDETERMINED) else UNKNOWN_QUANTITY
    status: Any = {ANSWERED: "ok", REFUSED: "outside_range"}.get(outcome, "not_identifiable")
    return Estimate(value, value, value, status, "", mode, "m", "0", "c", True, {})


def share(kind: Kind, **how: bool) -> float:
    return refused_share(answer, kind, "standard", jobs=1, **how)


def test_a_press_without_numbers_is_refused_and_one_that_is_not_determined_is_not():
    assert share(presses(ANSWERED, REFUSED, UNDETERMINED, ANSWERED)) == 0.25


def test_an_inclusion_that_does_not_stand_out_is_refused_or_left_out():
    """Of five presses one shows nothing and one is refused; left out, four are counted."""
    kind = presses(ANSWERED, UNSEEN, REFUSED, ANSWERED, UNDETERMINED)
    assert share(kind) == pytest.approx(2 / 5)
    assert share(kind, counts_unseen=False) == pytest.approx(1 / 4)


def test_a_kind_is_recorded_and_answered_in_the_mode_that_is_asked():
    asked: list[tuple[Mode, int]] = []

    def record(mode: Mode, number: int) -> Recording:
        asked.append((mode, number))
        return cast(Recording, ANSWERED)

    refused_share(answer, Kind("one", 2, record), "quick", jobs=1)
    assert asked == [("quick", 0), ("quick", 1)]


def test_few_ordinary_presses_and_nearly_all_of_the_others_must_be_refused():
    """A chapter passes on a false share of 0 beside one of 1, and fails when both kinds change places."""
    good, strange = (ANSWERED, ANSWERED, UNSEEN), (REFUSED, UNSEEN)
    chapter = outside_chapter(answer, [presses(*good, name=ORDINARY_KIND), presses(*strange)], jobs=1)
    assert [one.measured for one in chapter.benchmarks] == [0.0, 1.0]
    assert chapter.passed
    assert not outside_chapter(answer, [presses(*strange, name=ORDINARY_KIND), presses(*good)], jobs=1).passed


def test_each_mode_is_judged_on_the_kinds_that_are_of_it():
    scan_only = presses(REFUSED, ANSWERED, name="gives way", modes=("precise",))
    chapter = outside_chapter(answer, [presses(REFUSED), scan_only], jobs=1)
    assert [(one.case, one.measured) for one in chapter.benchmarks] == [
        ("standard, spots (1)", 1.0),
        ("precise, gives way (2)", 0.5),
    ]
    assert chapter.tables[0].rows == (("spots (1)", "100%"),)


def test_mode_quick_is_shown_and_not_judged():
    chapter = outside_chapter(answer, [presses(ANSWERED), presses(ANSWERED, REFUSED)], jobs=1)
    assert chapter.tables[0].rows == (("spots (1)", "0%"), ("spots (2)", "50%"))
    assert not any("quick" in one.case for one in chapter.benchmarks)
