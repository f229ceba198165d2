"""The log of a service engineer has a line when a fault comes and one when it goes, with the press it came in."""

import logging

import pytest

from device.errors import ClockJumpError, LightBusError
from device.instrument.status import PressJob, StatusBoard


@pytest.fixture
def lines(caplog):
    caplog.set_level(logging.INFO, "device.instrument.status")
    return lambda: [(record.levelname, record.getMessage()) for record in caplog.records]


def test_a_fault_is_a_line_with_its_press_when_it_comes_and_one_when_it_goes(lines):
    board = StatusBoard()
    board.update(press=PressJob("p-1", "quick", "capturing"))
    for _ in range(3):  # each round of the procedure finds it again
        board.update(fault=LightBusError("The bus is stuck.", "Switch off."))
    board.update(fault=None)
    assert lines() == [
        ("ERROR", "fault code=E202 severity=fault press=p-1 cause='The bus is stuck.'"),
        ("INFO", "fault over code=E202 press=p-1"),
    ]


def test_a_warning_is_one_without_a_press_where_none_is_under_way(lines):
    board = StatusBoard()
    board.update(press=PressJob("p-1", "quick", "done"))
    board.update(warnings=(ClockJumpError("It was set.", "Check it."),))
    board.update(step="ready")
    assert lines() == [("WARNING", "fault code=E701 severity=warning press=none cause='It was set.'")]
