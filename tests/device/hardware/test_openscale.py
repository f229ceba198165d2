"""The OpenScale driver as a transcript of bytes, through real pyserial on a pseudo-terminal."""

from __future__ import annotations

import os
import threading
import time
import tty
import types
from collections.abc import Iterator

import pytest

from device.errors import (
    DetachedCellError,
    LoadCellError,
    SaturatedCellError,
    UnpluggedCellError,
    UnreadableCellError,
)
from device.hardware import cell_line
from device.hardware.load_cell import open_load_cell
from device.hardware.openscale import DELAY_S, MOST_ALIKE, OpenScale, parse_reading

BANNER = b"\r\nSerial Load Cell Converter version 1.2\r\nBy SparkFun Electronics\r\nReadings:\r\n"


class Line:
    """The amplifier's end of a serial line."""

    def __init__(self) -> None:
        self.master, slave = os.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        self.cell = open_load_cell(self.path)
        os.close(slave)

    def send(self, data: bytes) -> None:
        os.write(self.master, data)

    def unplug(self) -> None:
        os.close(self.master)
        self.master = -1


@pytest.fixture
def line() -> Iterator[Line]:
    line = Line()
    yield line
    line.cell.close()
    if line.master >= 0:
        line.unplug()


def read_counts(cell: OpenScale, samples: int) -> list[float]:
    return [cell.read(timeout_s=10.0).counts for _ in range(samples)]


def test_whole_lines_give_their_raw_counts_in_order(line):
    line.send(b"1234,-0.532,kg,-53200,\r\n1246,0.001,kg,8388606,\r\n")
    assert read_counts(line.cell, 2) == [-53200.0, 8388606.0]
    assert line.cell.skipped_lines == 0


def test_a_partial_line_waits_for_its_rest(line):
    line.send(b"1234,0.5,kg,12")
    with pytest.raises(LoadCellError):
        line.cell.read(timeout_s=0.3)
    line.send(b"345,\r\n")
    assert read_counts(line.cell, 1) == [12345.0]


def test_a_sample_is_of_two_conversions_before_its_line_is_complete(line):
    before_s = time.monotonic()
    line.send(b"1,0.5,kg,1,\r\n")
    sample = line.cell.read(timeout_s=10.0)
    assert before_s - DELAY_S <= sample.t_s <= time.monotonic() - DELAY_S


def test_a_firmware_that_sends_offset_binary_is_read_around_its_middle(line):
    """8355808 is the example in OpenScale's own source: a bridge near zero."""
    line.cell.close()
    line.cell = open_load_cell(line.path, coding="offset_binary")
    line.send(b"1,0.5,kg,8355808,\r\n2,0.5,kg,10400000,\r\n3,0.5,kg,16777216,\r\n4,0.5,kg,1,\r\n")
    assert read_counts(line.cell, 3) == [-32800.0, 2011392.0, 1.0 - 2**23]
    assert line.cell.skipped_lines == 1


def test_readings_beyond_the_middle_of_offset_binary_are_refused_with_the_setting_that_tells_it(line):
    line.send(b"1,0.5,kg,8400000,\r\n")
    with pytest.raises(UnreadableCellError, match="offset binary: cell.coding"):
        line.cell.read(timeout_s=0.3)


def test_an_amplifier_that_has_been_on_for_25_days_is_still_read(line):
    """`millis` becomes negative there, as the firmware prints it, and goes on by as much as before."""
    before, after = b"2147483640,0.5,kg,1,", b"-2147483643,0.5,kg,2,"
    line.send(before + b"\r\n" + after + b"\r\n")
    assert read_counts(line.cell, 2) == [1.0, 2.0]
    assert parse_reading(after)[0] - parse_reading(before)[0] == pytest.approx(0.013)


def test_samples_that_are_read_late_are_as_far_apart_as_the_amplifier_says(line):
    line.send(b"1000,0.5,kg,1,\r\n")
    first = line.cell.read(timeout_s=10.0)
    time.sleep(0.1)  # the reader is busy with something else
    line.send(b"1012,0.5,kg,2,\r\n1025,0.5,kg,3,\r\n")
    times_s = [first.t_s, *(line.cell.read(timeout_s=10.0).t_s for _ in range(2))]
    assert times_s == pytest.approx([first.t_s, first.t_s + 0.012, first.t_s + 0.025], abs=3e-4)


def test_lines_that_gather_are_read_at_once_and_keep_their_own_times(line, monkeypatch):
    """They come while it pauses, and say themselves when they were measured."""
    line.send(b"1000,0.5,kg,1,\r\n")
    first = line.cell.read(timeout_s=10.0)
    pauses_s = []

    def pause(seconds):
        if not pauses_s:
            time.sleep(0.03)
            line.send(b"1012,0.5,kg,2,\r\n1025,0.5,kg,3,\r\n")
        pauses_s.append(seconds)  # the terminal may pass the lines on in pieces

    monkeypatch.setattr(cell_line, "time", types.SimpleNamespace(sleep=pause))
    line.cell.pause_s = 0.04
    samples = [line.cell.read(timeout_s=10.0) for _ in range(2)]
    assert set(pauses_s) == {0.04}
    assert [one.counts for one in samples] == [2.0, 3.0]
    assert [one.t_s - first.t_s for one in samples] == pytest.approx([0.012, 0.025], abs=3e-4)


def test_the_banner_is_skipped_and_counted(line):
    line.send(BANNER + b"1,0.5,kg,7,\r\n")
    assert read_counts(line.cell, 1) == [7.0]
    assert line.cell.skipped_lines == 4


@pytest.mark.parametrize(
    "bad",
    [
        b"\xff\x00\xfe\x80",
        b"1234,0.5,kg,",
        b"1234,0.5,kg,nan,",
        b"1234,0.5,kg,100,24.5,",
        b"1234,0.5,kg,inf,",
        b"1234,0.5,kg,100",
        b"1234,0.5,stone,100,",
        b"0.5,kg,100,",
        b"1234,0.5,kg,8388608,",
        b"1234,0.5,kg,-8388609,",
        b"1234,0.5,kg,99999999999,",
        b"12,0.5,kg,1012,0.5,kg,10,",
    ],
)
def test_a_line_without_a_valid_raw_reading_is_never_a_sample(line, bad):
    line.send(bad + b"\r\n1,0.5,kg,7,\r\n")
    assert read_counts(line.cell, 1) == [7.0]
    assert line.cell.skipped_lines == 1


@pytest.mark.parametrize("reading", [b"nan", b"inf", b"-inf", b"ovf", b"-0.25"])
def test_an_amplifier_without_a_calibration_of_its_own_is_read(line, reading):
    """Its memory is blank as it comes from the shop: it divides by 0, and Arduino prints that as a word."""
    line.send(b"1," + reading + b",lbs,7,\r\n")
    assert read_counts(line.cell, 1) == [7.0]


def test_an_over_long_line_is_dropped_up_to_its_end(line):
    line.send(b"1,0.5,kg,9," * 100)
    line.send(b"1,0.5,kg,9,\r\n1,0.5,kg,7,\r\n")
    assert read_counts(line.cell, 1) == [7.0]
    assert line.cell.skipped_lines == 1


def test_silence_is_a_load_cell_error_with_a_remedy(line):
    with pytest.raises(LoadCellError, match=r"has sent nothing for 0.3 s. Check its cable"):
        line.cell.read(timeout_s=0.3)


def test_lines_without_raw_reading_name_the_setting_that_is_missing(line):
    line.send(b"1234,-0.532,kg,\r\n" * 3)
    said = r"3 lines skipped, the last b'1234,-0.532,kg,\\r'. In its menu switch on timestamp"
    with pytest.raises(LoadCellError, match=said):
        line.cell.read(timeout_s=0.3)


def test_unplugging_while_reading_is_a_load_cell_error(line):
    unplug = threading.Timer(0.02, line.unplug)
    unplug.start()
    with pytest.raises(LoadCellError, match="is gone"):
        line.cell.read(timeout_s=10.0)
    unplug.join()


def test_unplugging_between_reads_is_a_load_cell_error(line):
    line.unplug()
    with pytest.raises(LoadCellError, match="is gone"):
        line.cell.read(timeout_s=10.0)


def test_a_line_that_was_plugged_in_again_is_read_on_without_what_was_half_sent(line, tmp_path):
    """The path stays, as udev's link does; the half line of before must not be glued to the first one after."""
    link, again = tmp_path / "force", Line()
    for amplifier in (line, again):
        amplifier.cell.close()
    link.symlink_to(line.path)
    cell = open_load_cell(str(link))
    line.send(b"1,0.5,kg,7,\r\n2,0.5,kg,8")
    assert read_counts(cell, 1) == [7.0]
    with pytest.raises(LoadCellError):
        cell.read(timeout_s=0.3)
    line.unplug()
    link.unlink()
    for words in ("is gone", "force cannot be opened"):
        with pytest.raises(UnpluggedCellError, match=words) as error:
            cell.read(timeout_s=10.0)
        assert error.value.code == "E304"
    link.symlink_to(again.path)
    assert reads_again(cell)
    again.send(b"8,0.5,kg,9,\r\n")
    assert read_counts(cell, 1) == [9.0]
    cell.close()
    again.unplug()


def reads_again(cell: OpenScale) -> bool:
    """Return whether the port can be opened: then the error is that nothing has been sent yet."""
    with pytest.raises(LoadCellError) as error:
        cell.read(timeout_s=0.3)
    return error.value.code == "E301"


@pytest.mark.parametrize("end", [b"8388607", b"-8388608"])
def test_a_reading_at_the_end_of_the_range_is_an_error_and_those_behind_it_are_not_waited_for(line, end):
    line.send((b"1,0.5,kg," + end + b",\r\n") * 5)
    with pytest.raises(SaturatedCellError, match="the end of its range") as error:
        line.cell.read(timeout_s=10.0)
    assert error.value.code == "E303"
    line.send(b"1,0.5,kg,7,\r\n")
    assert read_counts(line.cell, 1) == [7.0]


def test_a_reading_that_never_changes_comes_from_no_bridge_and_is_an_error_until_it_does(line):
    line.send(b"1,0.0,kg,0,\r\n" * (MOST_ALIKE + 3))
    assert read_counts(line.cell, MOST_ALIKE - 1) == [0.0] * (MOST_ALIKE - 1)
    with pytest.raises(DetachedCellError, match="has read 0 counts 20 times running") as error:
        line.cell.read(timeout_s=10.0)
    assert error.value.code == "E307"
    line.send(b"1,0.0,kg,0,\r\n")
    with pytest.raises(DetachedCellError, match="21 times"):
        line.cell.read(timeout_s=10.0)
    line.send(b"1,0.5,kg,7,\r\n")
    assert read_counts(line.cell, 1) == [7.0]


def test_readings_that_return_to_a_number_again_and_again_are_a_cell_at_rest(line):
    rest = [7.0, 7.0, 7.0, 8.0] * 10
    line.send(b"".join(b"1,0.5,kg,%d,\r\n" % counts for counts in rest))
    assert read_counts(line.cell, len(rest)) == rest


def test_lines_that_cannot_be_read_have_a_code_of_their_own(line):
    line.send(b"\xff\x00\n" * 5)
    with pytest.raises(UnreadableCellError) as error:
        line.cell.read(timeout_s=0.3)
    assert error.value.code == "E302"


def test_babble_without_line_ends_is_unreadable_not_silent(line):
    line.send(b"1,0.5,kg,9," * 100)
    with pytest.raises(UnreadableCellError, match="1 lines skipped"):
        line.cell.read(timeout_s=0.3)


def test_nothing_is_ever_sent_to_the_amplifier(line):
    """An `x` would open its menu and stop the stream."""
    line.send(b"1,0.5,kg,7,\r\n")
    line.cell.read(timeout_s=10.0)
    os.set_blocking(line.master, False)
    with pytest.raises(BlockingIOError):
        os.read(line.master, 1)


def test_a_second_program_cannot_open_the_same_port(line):
    with pytest.raises(LoadCellError, match="cannot be opened"):
        open_load_cell(line.path).read(timeout_s=10.0)


def test_a_missing_port_is_a_load_cell_error_naming_it_until_it_is_plugged_in(line, tmp_path):
    link = tmp_path / "force"
    cell = open_load_cell(str(link))
    for _ in range(2):
        with pytest.raises(UnpluggedCellError, match=f"{link} cannot be opened"):
            cell.read(timeout_s=10.0)
    line.cell.close()
    link.symlink_to(line.path)
    assert reads_again(cell)
    line.send(b"8,0.5,kg,9,\r\n")
    assert read_counts(cell, 1) == [9.0]
    cell.close()


def test_both_ends_of_24_bit_are_readings():
    assert parse_reading(b"1,0,kg,8388607,") == (0.001, 2**23 - 1)
    assert parse_reading(b"4294967295,0,lbs,-8388608,\r") == (4294967.295, -(2**23))
