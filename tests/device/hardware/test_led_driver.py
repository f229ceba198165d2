"""Which chip the settings open, and what a missing bus says."""

from __future__ import annotations

import pytest

from device.config import LightSection
from device.errors import LightError
from device.hardware.led_driver import led_driver, open_led_driver
from device.simulation.chips.i2c_bus import EmulatedI2cBus
from device.simulation.chips.pca9685_chip import Pca9685Chip
from device.simulation.chips.tlc59116_chip import Tlc59116Chip


@pytest.mark.parametrize(
    ("light", "address", "chip"),
    [
        (LightSection(), 0x60, Tlc59116Chip()),
        (LightSection(address=0x63), 0x63, Tlc59116Chip()),
        (LightSection(chip="pca9685"), 0x40, Pca9685Chip()),
        (LightSection(chip="pca9685", address=0x60), 0x60, Pca9685Chip()),
    ],
)
def test_the_chip_of_the_settings_is_driven_at_its_address(light, address, chip):
    led_driver(light, EmulatedI2cBus({address: chip})).set_ratio((1.0, 0.0, 0.0, 1.0))
    assert chip.led_ratio() == (1.0, 0.0, 0.0, 1.0)


def test_a_missing_bus_is_a_light_error_naming_it():
    with pytest.raises(LightError, match=r"I2C bus 254 cannot be opened: No such file or directory \(errno 2\)"):
        open_led_driver(LightSection(bus=254))
