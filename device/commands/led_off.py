"""`python -m device led-off`: darkens the LED chip whatever became of the daemon, as systemd's `ExecStopPost=`.

It is dark before anything is loaded that is not needed for that: the settings files are read for the chip's place
alone, without pydantic, and checked as a whole afterwards, where they are bad. The enable line goes first, if there is
one; the bus is asked in a process of its own, since a transfer that hangs in the kernel cannot be ended and may keep
any process that made it.
Exit codes: 0 dark, 1 not known to be dark, 2 usage.
"""

from __future__ import annotations

import argparse
import os
import select
import signal
import sys
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path

from device.config_chips import LightWiring
from device.errors import DeviceError, LightBusError, LightError
from device.files.plain_settings import layer_files
from device.hardware.led_driver import open_led_driver
from device.hardware.light_keeper import GpioLine
from device.settings.plain_light import PlainLight, plain_light

TRY_FOR_S = 0.5
"""A transaction that the killed daemon was in may spoil the next one; beyond this a chip that is silent stays so."""
PAUSE_S = 0.05
LINE_FOR_S = 0.2
"""The keeper of a daemon that has ended has let the line go long before this program runs."""
HANGS_AFTER_S = TRY_FOR_S + 0.2
"""A process that has not come back from the bus by then hangs in it."""
MOST_FILES = 256
"""A program that has just begun has opened fewer."""
SPLIT = "\x1f"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add nothing: the verb takes the options of the whole command line."""


def led_off_by_settings(files: Sequence[Path]) -> None:
    """Darken the chip wherever settings files, lowest first, or the last good ones say that it is.

    Raises `LightError` when one of these places is not known to be dark, `ConfigError` with all that is wrong when
    the files say no place and there are no last good ones: every chip that there is has been darkened then, if it
    answered.
    """
    said = plain_light(files)
    refused = _refused(said.wirings)
    if not said.is_said:
        refused = _checked(files, said, refused)
    if refused:
        raise next(iter(refused.values()))


def _refused(wirings: Iterable[LightWiring]) -> dict[LightWiring, LightError]:
    """Darken the chip at each of some places; return why not, of those that did not answer."""
    refused = {}
    for wiring in wirings:
        try:
            led_off(wiring)
        except LightError as error:
            refused[wiring] = error
    return refused


def _checked(
    files: Sequence[Path], said: PlainLight, refused: dict[LightWiring, LightError]
) -> dict[LightWiring, LightError]:
    """Return what was refused at the place that the settings as a whole say; raise `ConfigError` when they cannot."""
    from device.settings.last_good import start_settings  # dark first
    from device.settings.layers import read_layers

    wiring = start_settings(read_layers(files)).config.light.wiring
    if wiring not in said.wirings:
        return _refused([wiring])
    return {wiring: refused[wiring]} if wiring in refused else {}


def led_off(light: LightWiring) -> None:
    """Darken all sides, by the line and by the bus, and read it back; returns in time also when the bus hangs.

    Raises `LightError` when bus or chip do not answer: then nobody knows, or the line alone is what keeps it dark.
    """
    line, told = _lowered(light)
    try:
        if line and not light.is_enabled_low:
            line.switch(True)  # a chip that has been reset is dark, and answers only so
        _darken_in_time(light)
    except LightError as error:
        raise type(error)(f"{error.cause}{told}", error.remedy) from error
    finally:
        if line:
            line.close()


def _lowered(light: LightWiring) -> tuple[GpioLine | None, str]:
    """Return the enable line, low, once whoever held it has gone, and what there is to tell of it."""
    deadline_s = time.monotonic() + LINE_FOR_S
    while light.enable_line is not None:
        try:
            line = GpioLine(light.enable_chip, light.enable_line, active_low=light.is_enabled_low)
            return line, " The line that enables the LEDs is low."
        except OSError as error:
            if time.monotonic() > deadline_s:
                return None, f" The line that enables the LEDs cannot be had: {error.strerror or error}."
            time.sleep(PAUSE_S)
    return None, ""


def _darken_in_time(light: LightWiring) -> None:
    """Darken the chip in a child process; raise what it raised, or `LightBusError` when it does not come back."""
    hearing, telling = os.pipe()
    child = os.fork()
    if not child:
        _darken_and_tell(light, telling)
    os.close(telling)
    with open(hearing, "rb") as answer:
        is_back = bool(select.select([answer], [], [], HANGS_AFTER_S)[0])
        said = answer.read().decode() if is_back else ""
    if not is_back:
        os.kill(child, signal.SIGKILL)  # which a process in the kernel heeds only when it comes out again
        remedy = "Switch the probe off and on; if it stays, a chip on the bus or its cable is broken."
        raise LightBusError(f"The I2C bus of the LED chip hangs: no answer for {HANGS_AFTER_S:g} s.", remedy)
    os.waitpid(child, 0)
    if said:
        code, cause, remedy = said.split(SPLIT)
        raise DeviceError.by_code[code](cause, remedy)


def _darken_and_tell(light: LightWiring, telling: int) -> None:
    """Darken the chip, say nothing or what went wrong, and end this process, which may be long after its parent."""
    _keep_only(telling)
    said = SPLIT.join(["E201", "The LED chip could not be darkened.", "Switch the probe off and on."])
    try:
        darken(light)
        said = ""
    except LightError as error:
        said = SPLIT.join([error.code, error.cause, error.remedy])
    finally:
        with suppress(OSError):
            os.write(telling, said.encode())
        os._exit(0)


def _keep_only(handle: int) -> None:
    """Let go of all files but one: a process that hangs in the bus must not keep the line, or whoever reads output."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for standard in range(3):
        os.dup2(nowhere, standard)
    os.closerange(3, handle)
    os.closerange(handle + 1, MOST_FILES)


def darken(light: LightWiring) -> None:
    """Darken the chip and read it back, again and again for a while; raise `LightError` when that does not help."""
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
        files = layer_files(stated=options.config)
        try:
            led_off_by_settings(files)
        finally:
            from device.instrument.watch.restart_note import note_end  # dark first

            note_end(plain_light(files).data, os.environ)
    except DeviceError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
