"""Holds the GPIO line that enables the LEDs' outputs, and lowers it when it is not told in time to hold it. A program.

`python light_keeper.py CHIP LINE high|low`: a process of its own, so that a daemon that is frozen, killed or stuck in
its bus loses the light within `HOLD_S`. Requests are bytes on standard input: `UP`, `HOLD`, `DOWN`; the end of the
input is the end of the daemon. Each is answered on standard output by whether the line had been up until then; a first
byte says that the line was opened, anything else why not.
Easy to get wrong: a line that is released keeps its level on Raspberry Pi OS unless `dtparam=strict_gpiod` is set; so
it is lowered before it is released, and asked for low.
Standard library and gpiod alone: it has to be there quickly. Source: Linux' GPIO character device,
Documentation/userspace-api/gpio/chardev.rst; libgpiod 2, `gpiod.request_lines`.
"""

from __future__ import annotations

import os
import select
import sys
import time
from contextlib import suppress
from typing import Protocol

HOLD_S = 0.75
"""The line is up for so long after the last request: with what the chip takes, dark within a second."""
UP, HOLD, DOWN = b"U", b"H", b"D"
OPENED, WAS_UP, WAS_DOWN = b"O", b"1", b"0"


class SwitchedLine(Protocol):
    """A line that is low until it is told otherwise."""

    def switch(self, is_up: bool) -> None:
        """Enable the LEDs' outputs, or disable them; raise `OSError` when the line does not follow."""

    def close(self) -> None:
        """Disable the outputs and release the line."""


class GpioLine:
    """One line of a GPIO chip, asked for by this process alone. Implements `SwitchedLine`."""

    def __init__(self, chip: str, offset: int, *, active_low: bool) -> None:
        """Ask for the line with the outputs disabled; raise `OSError` when it is not there or another has it."""
        import gpiod  # only where a line is wired
        from gpiod.line import Direction, Value

        self._offset, self._up, self._down = offset, Value.ACTIVE, Value.INACTIVE
        settings = gpiod.LineSettings(
            direction=Direction.OUTPUT, active_low=active_low, output_value=Value.INACTIVE
        )  # fmt: skip
        try:
            self._request = gpiod.request_lines(chip, consumer="tsis-light", config={offset: settings})
        except ValueError as error:  # what the library knows without the kernel
            raise OSError(f"{chip} has no line {offset}") from error

    def switch(self, is_up: bool) -> None:
        """Enable the LEDs' outputs, or disable them."""
        self._request.set_value(self._offset, self._up if is_up else self._down)

    def close(self) -> None:
        """Disable the outputs and release the line."""
        try:
            self.switch(False)
        finally:
            self._request.release()


def keep(line: SwitchedLine, requests: int, answers: int) -> None:
    """Switch a line as the requests of one file descriptor ask, and answer on another, until their end; ends low."""
    until_s: float | None = None
    try:
        os.write(answers, OPENED)
        while True:
            left_s = None if until_s is None else max(until_s - time.monotonic(), 0.0)
            is_asked = bool(select.select([requests], [], [], left_s)[0])
            if until_s is not None and time.monotonic() >= until_s:
                line.switch(False)  # also when a request has come meanwhile: it has come too late
                until_s = None
            if is_asked:
                if not (request := os.read(requests, 1)):
                    return
                was_up = until_s is not None
                until_s = _next_until_s(line, request, was_up)
                os.write(answers, WAS_UP if was_up else WAS_DOWN)
    finally:
        line.close()


def _next_until_s(line: SwitchedLine, request: bytes, was_up: bool) -> float | None:
    """Do what is asked; return until when the line is up, None for down."""
    if request == UP and not was_up:
        line.switch(True)
    if request == DOWN and was_up:
        line.switch(False)
    is_up = request == UP or (request == HOLD and was_up)
    return time.monotonic() + HOLD_S if is_up else None


def main(arguments: list[str]) -> int:
    """Keep the line that is named until the standard input ends; return the exit code."""
    chip, offset, level = arguments
    try:
        line = GpioLine(chip, int(offset), active_low=level == "low")
    except OSError as error:
        print(error.strerror or error, flush=True)
        return 1
    with suppress(BrokenPipeError):  # the daemon is gone
        keep(line, sys.stdin.fileno(), sys.stdout.fileno())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
