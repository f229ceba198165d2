"""The LED chip that the settings name, opened on its bus: all sides dark, set up and read back."""

from __future__ import annotations

from smbus2 import SMBus

from device.config import LightSection
from device.errors import LightError
from device.hardware.i2c_chip import I2cBus
from device.hardware.interfaces import Lights
from device.hardware.pca9685 import Pca9685
from device.hardware.tlc59116 import Tlc59116


def led_driver(light: LightSection, bus: I2cBus) -> Lights:
    """Start the chip on an open bus; raise `LightError` when it does not answer or hold its set-up."""
    if light.chip == "pca9685":
        return Pca9685(bus, address=light.chip_address, clock=light.pwm_clock)
    return Tlc59116(bus, address=light.chip_address)


def open_led_driver(light: LightSection) -> Lights:
    """Open /dev/i2c-<light.bus> and start the chip; raise `LightError` when there is no bus or no chip."""
    try:
        bus = SMBus(light.bus)
    except OSError as error:
        cause = f"I2C bus {light.bus} cannot be opened: {error.strerror} (errno {error.errno})."
        raise LightError(cause, "Enable I2C on the board and check the bus number in the configuration.") from error
    try:
        return led_driver(light, bus)
    except LightError:
        bus.close()
        raise
