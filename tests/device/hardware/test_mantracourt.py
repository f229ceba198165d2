"""The Mantracourt driver as a transcript of requests and replies, through real pyserial on a pseudo-terminal."""

from __future__ import annotations

import os
import select
import threading
import time
import tty
from collections import deque
from collections.abc import Iterator
from contextlib import suppress

import pytest

from device.errors import (
    DetachedCellError,
    LoadCellError,
    SaturatedCellError,
    UnpluggedCellError,
    UnreadableCellError,
)
from device.hardware import mantracourt
from device.hardware.load_cell import open_load_cell

FINE = b"+00000.000000\r"


class Unit:
    """Station 1 on a serial line: answers each request with the next reply of its script, then with nothing."""

    def __init__(self) -> None:
        self.master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self.master, False)
        self.path = os.ttyname(slave)
        self.requests: list[bytes] = []
        self.answered = threading.Event()
        self._replies: deque[bytes] = deque()
        self._ended = threading.Event()
        self.cell = open_load_cell(self.path, 115_200, "mantracourt", 1)
        os.close(slave)
        self._thread = threading.Thread(target=self._answer, daemon=True)
        self._thread.start()

    def will_say(self, *replies: bytes) -> None:
        self._replies.extend(replies)

    def _answer(self) -> None:
        heard = b""
        while not self._ended.wait(0.001):
            select.select([self.master], [], [], 0.01)
            with suppress(OSError):  # nothing has come, or nobody has the other end open
                *whole, heard = (heard + os.read(self.master, 100)).split(b"\r")
                for request in whole:
                    self.requests.append(request)
                    os.write(self.master, self._replies.popleft() if self._replies else b"")
                    self.answered.set()

    def unplug(self) -> None:
        if not self._ended.is_set():
            self._ended.set()
            self._thread.join()
            os.close(self.master)


@pytest.fixture(autouse=True)
def _long_waits(monkeypatch):
    """A reply that is only late, on a busy machine, is not asked for again."""
    monkeypatch.setattr(mantracourt, "REPLY_S", 30.0)


@pytest.fixture
def _short_waits(monkeypatch):
    """For who gets no reply, or half of one."""
    monkeypatch.setattr(mantracourt, "REPLY_S", 0.3)


@pytest.fixture
def unit() -> Iterator[Unit]:
    unit = Unit()
    yield unit
    unit.unplug()
    unit.cell.close()


def test_the_bridge_is_asked_for_and_then_its_flags_and_a_count_is_a_nanovolt_a_volt(unit):
    unit.will_say(b"+00000.123456\r", FINE, b"-00002.500000\r", FINE)
    assert [unit.cell.read(timeout_s=30.0).counts for _ in range(2)] == pytest.approx([123_456.0, -2_500_000.0])
    assert unit.requests == [b"!001:MVV?", b"!001:STAT?"] * 2
    assert unit.cell.skipped_lines == 0


def test_a_partial_reply_waits_for_its_rest_and_the_sample_is_stamped_when_that_has_come(unit):
    unit.will_say(b"+00000.12", FINE)
    sent_s = []

    def send_the_rest():
        unit.answered.wait()  # what comes before the request is thrown away
        time.sleep(0.03)  # the part is read by itself, unless the machine is very busy
        sent_s.append(time.monotonic())
        os.write(unit.master, b"3456\r")

    rest = threading.Thread(target=send_the_rest, daemon=True)
    rest.start()
    sample = unit.cell.read(timeout_s=30.0)
    rest.join()
    assert sample.counts == pytest.approx(123_456.0)
    assert sent_s[0] <= sample.t_s <= time.monotonic()


@pytest.mark.usefixtures("_short_waits")
def test_a_station_that_is_not_there_answers_nothing_and_is_named(unit):
    with pytest.raises(LoadCellError, match=r"station 1 on .* answered nothing for 0\.3 s\. Check .*station") as error:
        unit.cell.read(timeout_s=0.3)
    assert error.value.code == "E301"


@pytest.mark.usefixtures("_short_waits")
def test_a_request_that_got_no_reply_is_repeated_within_the_time_allowed(unit):
    unit.will_say(b"", b"+00000.000007\r", b"", b"+00000.000008\r", FINE)
    assert unit.cell.read(timeout_s=30.0).counts == pytest.approx(8.0)
    assert unit.requests == [b"!001:MVV?", b"!001:MVV?", b"!001:STAT?", b"!001:MVV?", b"!001:STAT?"]


@pytest.mark.parametrize(
    "bad",
    [
        b"?",
        b"",
        b"\xff\x00\xfe\x80",
        b"00000.000007",
        b"+00000,000007",
        b"+00000.00007",
        b"+00000.",
        b"+nan",
        b"+1e3",
        b"!001:MVV?",
        b"7" * 3000,
    ],
)
def test_a_line_that_is_no_reply_is_skipped_and_counted(unit, bad):
    unit.will_say(bad + b"\r+00000.000007\r", FINE)
    assert unit.cell.read(timeout_s=30.0).counts == pytest.approx(7.0)
    assert unit.cell.skipped_lines == 1


def test_a_reply_that_lost_a_digit_is_not_of_the_others_length_and_is_asked_for_again(unit):
    unit.will_say(b"+0000.123456\r", FINE, b"+00000.123456\r", FINE)
    assert unit.cell.read(timeout_s=30.0).counts == pytest.approx(123_456.0)
    assert unit.cell.skipped_lines == 1


def test_flags_that_are_no_whole_number_are_the_late_reply_to_something_else(unit):
    unit.will_say(b"+00000.000007\r", b"+00000.500000\r", b"+00000.000008\r", FINE)
    assert unit.cell.read(timeout_s=30.0).counts == pytest.approx(8.0)


def test_what_came_unasked_is_not_an_answer(unit):
    os.write(unit.master, b"+00009.000000\r+00009.")
    unit.will_say(b"+00000.000007\r", FINE)
    assert unit.cell.read(timeout_s=30.0).counts == pytest.approx(7.0)


@pytest.mark.usefixtures("_short_waits")
def test_a_unit_of_too_few_decimals_is_told_which_setting_is_wrong(unit):
    unit.will_say(b"+00000.123\r")
    with pytest.raises(
        UnreadableCellError, match=r"1 lines skipped, the last b'\+00000\.123'\. Set its DP to 6"
    ) as error:
        unit.cell.read(timeout_s=0.3)
    assert error.value.code == "E302"


@pytest.mark.usefixtures("_short_waits")
def test_babble_without_an_end_is_unreadable_not_silent(unit):
    unit.will_say(b"7" * 3000)
    with pytest.raises(UnreadableCellError, match="1 lines skipped"):
        unit.cell.read(timeout_s=0.3)


@pytest.mark.parametrize(
    ("flags", "error", "code"),
    [
        (1 << 4, SaturatedCellError, "E303"),
        (1 << 5, SaturatedCellError, "E303"),
        (1 << 11, DetachedCellError, "E307"),
        (1 << 11 | 1 << 5, DetachedCellError, "E307"),
    ],
)
def test_a_reading_that_its_flags_do_not_vouch_for_is_an_error_until_they_do(unit, flags, error, code):
    unit.will_say(b"+00003.000000\r", b"+%05d.000000\r" % flags, b"+00000.000007\r", FINE)
    with pytest.raises(error, match=rf"STAT {flags}") as caught:
        unit.cell.read(timeout_s=30.0)
    assert (type(caught.value), caught.value.code) == (error, code)
    assert unit.cell.read(timeout_s=30.0).counts == pytest.approx(7.0)


@pytest.mark.parametrize("flags", [1 << 0, 1 << 1, 1 << 12])
def test_flags_of_the_units_ports_say_nothing_about_the_bridge(unit, flags):
    unit.will_say(b"+00000.000007\r", b"+%05d.000000\r" % flags)
    assert unit.cell.read(timeout_s=30.0).counts == pytest.approx(7.0)


def test_unplugged_and_plugged_in_again_it_goes_on_by_itself(unit, tmp_path):
    """The path stays, as udev's link does."""
    again, link = Unit(), tmp_path / "force"
    for one in (unit, again):
        one.cell.close()
    link.symlink_to(unit.path)
    cell = open_load_cell(str(link), 115_200, "mantracourt", 1)
    unit.unplug()
    link.unlink()
    for words in ("is gone", "force cannot be opened"):
        with pytest.raises(UnpluggedCellError, match=words) as error:
            cell.read(timeout_s=30.0)
        assert error.value.code == "E304"
    link.symlink_to(again.path)
    again.will_say(b"+00000.000007\r", FINE)
    assert cell.read(timeout_s=30.0).counts == pytest.approx(7.0)
    cell.close()
    again.unplug()
