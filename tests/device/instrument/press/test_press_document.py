"""docs/press.md says what the machine does: its table is the code's, its figures are the settings' and constants'."""

import re

import pytest
from daemon_process import ROOT

from device.config import PressSection
from device.instrument.press import machine as press_machine
from device.instrument.press.frame_outliers import DEVIATION_RATIO, ROBUST_SIGMAS
from device.instrument.press.states import TOUCHING, TRANSITIONS, PressState
from device.measurement.estimate import SATURATED_RATIO

PAGE = (ROOT / "docs" / "press.md").read_text(encoding="utf-8")


def row(state):
    """Return a state's line of the table."""
    others = [after.code for after in PressState if after in TRANSITIONS[state] and after is not state]
    return f"| `{state.code}` | {state.meaning} | {', '.join(others) or 'nothing: the next press is a new one'} |"


def test_the_table_of_the_document_is_that_of_the_code():
    table = re.search(r"\|---\|---\|---\|\n(.*?)\n\n", PAGE, re.DOTALL).group(1)
    assert table.splitlines() == [row(state) for state in PressState]


def test_the_diagram_is_the_table_with_all_states_of_a_pressed_probe_as_one():
    """But for `holding`, the only one of them from which the hand may lift."""

    def name(state):
        return "pressed" if state in TOUCHING else state.code

    steps = {
        (name(before), name(after)) for before in PressState for after in TRANSITIONS[before] if before is not after
    }
    drawn = set(re.findall(r"^ +(\w+) --> (\w+)$", PAGE, re.MULTILINE))
    assert drawn == steps - {("pressed", "pressed"), ("pressed", "releasing")} | {("holding", "releasing")}
    assert [state for state in TOUCHING if PressState.RELEASING in TRANSITIONS[state]] == [PressState.HOLDING]


@pytest.mark.parametrize(
    "figure",
    [
        f"{press_machine.STEADY_WINDOW_S:g} s",
        f"{press_machine.SETTLE_S:g} s",
        f"{press_machine.MAX_LIFTS} times",
        f"{press_machine.MAX_SATURATED} saturated frames",
        f"{press_machine.MAX_REPLACED} frames",
        f"{SATURATED_RATIO:.1%}",
        f"{ROBUST_SIGMAS:g} robust standard deviations",
        f"{DEVIATION_RATIO:.0%} of the light",
        f"{PressSection().overload_n:g} N",
        f"{PressSection().max_offset_mm:g} mm",
        f"{PressSection().timeout_s:g} s",
    ],
)
def test_the_figures_of_the_document_are_those_of_the_code(figure):
    assert figure in PAGE
