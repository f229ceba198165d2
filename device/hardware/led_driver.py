"""The LED chip that the settings name, opened on its bus: all sides dark, set up and read back.

With an enable line it shines only while that is held (device/hardware/enabled_lights.py).
"""

from __future__ import annotations

import sys
from functools import partial

from smbus2 import SMBus

from device.config_chips import LightWiring
from device.errors import LightError
from device.hardware import light_keeper
from device.hardware.enable_line import EnableLine, KeptLine
from device.hardware.enabled_lights import GatedLights, ResettingLights
from device.hardware.i2c_chip import I2cBus
from device.hardware.interfaces import Lights
from device.hardware.pca9685 import Pca9685
from device.hardware.tlc59116 import Tlc59116, is_reset


def led_driver(light: LightWiring, bus: I2cBus, line: EnableLine | None = None) -> Lights:
    """Start the chip on an open bus; raise `LightError` when it does not answer, hold its set-up or obey its line."""
    set_up = partial(_chip, light, bus)
    if line is None:
        return set_up()
    if light.chip == "pca9685":
        return GatedLights(set_up(), line)
    return ResettingLights(set_up, partial(is_reset, bus, light.chip_address), line)


def _chip(light: LightWiring, bus: I2cBus) -> Lights:
    if light.chip == "pca9685":
        return Pca9685(bus, address=light.chip_address, clock=light.pwm_clock)
    return Tlc59116(bus, address=light.chip_address)


def open_led_driver(light: LightWiring) -> Lights:
    """Open /dev/i2c-<light.bus> and start the chip, whatever its line; raise `LightError` without bus or chip."""
    bus = open_bus(light)
    try:
        return led_driver(light, bus)
    except LightError:
        bus.close()
        raise


def open_enabled_led_driver(light: LightWiring) -> Lights:
    """Do the same with the enable line that the settings name, if they do; raise `LightLineError` without it."""
    if light.enable_line is None:
        return open_led_driver(light)
    bus = open_bus(light)
    try:
        line = KeptLine(keeper_command(light))
    except LightError:
        bus.close()
        raise
    try:
        return led_driver(light, bus, line)
    except LightError:
        line.close()
        bus.close()
        raise


def keeper_command(light: LightWiring) -> list[str]:
    """Return the program that keeps the line: by its path, so that it loads nothing else of ours."""
    level = "low" if light.is_enabled_low else "high"
    return [sys.executable, "-P", light_keeper.__file__, light.enable_chip, str(light.enable_line), level]


def open_bus(light: LightWiring) -> SMBus:
    """Open /dev/i2c-<light.bus>; raise `LightError` when it is not there."""
    try:
        return SMBus(light.bus)
    except OSError as error:
        cause = f"I2C bus {light.bus} cannot be opened: {error.strerror} (errno {error.errno})."
        raise LightError(cause, "Enable I2C on the board and check the bus number in the configuration.") from error
