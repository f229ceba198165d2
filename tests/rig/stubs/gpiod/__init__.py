"""Stands in the place of libgpiod's package on a machine without GPIO: every line is the world's, at $TSIS_RIG_LINE."""

from __future__ import annotations

import os
from dataclasses import dataclass

from device.simulation.chips.remote_line import RemoteLine

from .line import Direction, Value


@dataclass
class LineSettings:
    """What a line is asked for as."""

    direction: Direction
    active_low: bool
    output_value: Value


class LineRequest:
    """One output."""

    def __init__(self, offset: int, settings: LineSettings) -> None:
        assert settings.direction is Direction.OUTPUT
        self._offset, self._line = offset, RemoteLine(os.environ["TSIS_RIG_LINE"])
        self.set_value(offset, settings.output_value)

    def set_value(self, line: int, value: Value) -> None:
        """Set its level."""
        assert line == self._offset
        self._line.switch(value is Value.ACTIVE)

    def release(self) -> None:
        """Let go of it."""
        self._line.close()


def request_lines(path: str, *, consumer: str, config: dict[int, LineSettings]) -> LineRequest:
    """Return the one line that is asked for."""
    assert path.startswith("/dev/gpiochip")
    assert consumer
    [(offset, settings)] = config.items()
    return LineRequest(offset, settings)
