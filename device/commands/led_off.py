"""`python -m device led-off`: darkens the LED chip whatever became of the daemon, as systemd's `ExecStopPost=`.

Imports no more than the settings and the driver, and no NumPy, so that `python -m device.commands.led_off` is done long
before the daemon would have started. A bus that is held low cannot be helped by any program: see docs/contracts.md.
Exit codes: 0 dark, 1 not known to be dark, 2 usage.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from device.config import LightSection
from device.errors import DeviceError, LightError
from device.hardware.led_driver import open_led_driver
from device.instrument.watch.restart_note import note_end
from device.settings.last_good import start_settings
from device.settings.layers import layer_files, read_layers

TRY_FOR_S = 0.5
"""A transaction that the killed daemon was in may spoil the next one; beyond this a chip that is silent stays so."""
PAUSE_S = 0.05


def led_off(light: LightSection) -> None:
    """Darken all sides and read it back; raise `LightError` when bus or chip do not answer."""
    deadline_s = time.monotonic() + TRY_FOR_S
    while True:
        try:
            open_led_driver(light).close()
        except LightError:
            if time.monotonic() > deadline_s:
                raise
            time.sleep(PAUSE_S)
        else:
            return


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line; return its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m device.commands.led_off", description="Darken the LEDs of a real probe."
    )
    parser.add_argument("--config", type=Path, metavar="FILE", help="the daemon's settings (TOML)")
    options = parser.parse_args(arguments)
    try:
        config = start_settings(read_layers(layer_files(stated=options.config))).config
        try:
            led_off(config.light)
        finally:
            note_end(config.data, os.environ)
    except DeviceError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
