"""Puts the light together where it is simulated: the keeper of the enable line, above a line that leads to a chip here.

As a program, `python -m device.assembly.light ADDRESS`, it is that keeper: everything above the line is as on a probe.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress

from device.hardware.enable_line import KeptLine
from device.hardware.light_keeper import keep
from device.simulation.chips.remote_line import RemoteLine

PROGRAM = ("-m", "device.assembly.light")
"""What Python runs as the keeper."""


def emulated_line(address: str) -> KeptLine:
    """Start the keeper of a line that a `LineServer` serves; raise `LightLineError` when it does not get the line."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return KeptLine([sys.executable, *PROGRAM, address], environment)


def main(address: str) -> int:
    """Keep the line until the standard input ends; return the exit code."""
    try:
        line = RemoteLine(address)
    except OSError as error:
        print(error.strerror, flush=True)
        return 1
    with suppress(BrokenPipeError):  # the daemon is gone
        keep(line, sys.stdin.fileno(), sys.stdout.fileno())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
