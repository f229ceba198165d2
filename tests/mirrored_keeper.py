"""The keeper of the simulated daemon's enable line, which also drives the line of the LED chip in the test's process.

As a program: `python mirrored_keeper.py OUTSIDE INSIDE`. The line outside goes first: the daemon may be frozen.
"""

from __future__ import annotations

import sys

from device.hardware.light_keeper import keep
from device.simulation.chips.remote_line import RemoteLine


class BothLines:
    """Two lines as one."""

    def __init__(self, *addresses: str) -> None:
        self._lines = [RemoteLine(address) for address in addresses]

    def switch(self, is_up: bool) -> None:
        for line in self._lines:
            line.switch(is_up)

    def close(self) -> None:
        for line in self._lines:
            line.close()


if __name__ == "__main__":
    keep(BothLines(*sys.argv[1:]), sys.stdin.fileno(), sys.stdout.fileno())
