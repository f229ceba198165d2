"""A GPIO line that outlives the process that drives it: unmodified gpiod settings here, the line's end in another.

libgpiod asks the kernel by `gpiod.request_lines`. As a program, this file puts a Unix socket in its place and runs
another program above it: `python gpiod_over_socket.py SOCKET FILE [ARGUMENT]...`.
"""

from __future__ import annotations

import runpy
import sys
from typing import Any

import gpiod
from gpiod.line import Direction, Value

from device.simulation.chips.remote_line import RemoteLine


class RequestedLine:
    """The part of `gpiod.LineRequest` that one output needs."""

    def __init__(self, address: str, offset: int, settings: gpiod.LineSettings) -> None:
        assert settings.direction is Direction.OUTPUT
        self._offset, self._line = offset, RemoteLine(address)
        self.set_value(offset, settings.output_value)

    def set_value(self, line: int, value: Value) -> None:
        assert line == self._offset
        self._line.switch(value is Value.ACTIVE)

    def release(self) -> None:
        self._line.close()


def stand_in_for_the_kernel(address: str) -> None:
    """Let gpiod of this process have every line at a socket."""

    def requested(_path: str, *, consumer: str, config: dict[int, gpiod.LineSettings]) -> Any:
        [(offset, settings)] = config.items()
        assert consumer
        return RequestedLine(address, offset, settings)

    gpiod.request_lines = requested


if __name__ == "__main__":
    stand_in_for_the_kernel(sys.argv[1])
    sys.argv = sys.argv[2:]
    runpy.run_path(sys.argv[0], run_name="__main__")
