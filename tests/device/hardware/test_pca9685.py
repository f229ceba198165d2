"""The PCA9685 driver as a transcript of I2C bytes, against the emulated chip."""

from __future__ import annotations

import time

import pytest

from device.config_chips import PwmClock
from device.errors import LightError
from device.hardware.pca9685 import Pca9685
from device.measurement.quantities import InvalidQuantity
from device.simulation.chips.i2c_bus import EmulatedI2cBus
from device.simulation.chips.pca9685_chip import Pca9685Chip
from device.simulation.chips.tlc59116_chip import Tlc59116Chip

DARK = (0.0, 0.0, 0.0, 0.0)
FULL = (1.0, 1.0, 1.0, 1.0)
PERIOD_S = 655.36e-6


@pytest.fixture
def chip() -> Pca9685Chip:
    return Pca9685Chip()


@pytest.fixture
def bus(chip: Pca9685Chip) -> EmulatedI2cBus:
    return EmulatedI2cBus({0x40: chip})


@pytest.fixture
def lights(bus: EmulatedI2cBus) -> Pca9685:
    lights = Pca9685(bus)
    bus.log.clear()
    return lights


def written(bus: EmulatedI2cBus) -> list[str]:
    return [data.hex(" ") for _address, data in bus.log]


def test_start_darkens_every_output_then_sets_the_prescaler_asleep_then_wakes(chip, bus):
    """The four addresses, modes and prescaler are read back from 02, 00 and FE."""
    Pca9685(bus)
    assert written(bus) == ["fd 10", "00 30", "fe 03", "01 04", "00 20", "02", "00", "fe"]
    assert chip.led_ratio() == DARK


def test_the_prescaler_is_that_of_the_clock(bus):
    Pca9685(bus, clock=PwmClock.nearest(200.0))
    assert "fe 1e" in written(bus)


def test_a_chip_that_a_dead_process_left_shining_is_dark_after_the_first_write(chip, bus, lights):
    lights.set_ratio(FULL)
    bus.log.clear()
    carry = bus.i2c_rdwr
    light_after = []
    bus.i2c_rdwr = lambda *messages: (carry(*messages), light_after.append(chip.led_ratio()))[0]
    Pca9685(bus)
    assert set(light_after) == {DARK}


def test_four_sides_change_in_one_transaction_and_are_read_back(chip, bus, lights):
    """0.6 * 4096 = 2458 = 0x99a, 0.2 * 4096 = 819 = 0x333; none and all have bits of their own."""
    lights.set_ratio((0.6, 0.0, 1.0, 0.2))
    assert written(bus) == ["06" + " 00 00 9a 09" + " 00 00 00 10" + " 00 10 00 00" + " 00 00 33 03", "00"]
    assert chip.led_ratio() == pytest.approx((0.6, 0.0, 1.0, 0.2), abs=0.5 / 4096)


def test_the_returned_time_is_not_before_the_period_in_which_the_light_changes(chip, lights):
    before_s = time.monotonic()
    changed_s = lights.set_ratio(FULL)
    assert changed_s >= before_s + PERIOD_S
    assert chip.ratio_at(changed_s) == FULL
    assert chip.ratio_at(before_s) == DARK


def test_close_darkens_all_outputs_before_it_releases_the_bus(chip, bus, lights):
    lights.set_ratio(FULL)
    bus.log.clear()
    lights.close()
    assert written(bus) == ["fd 10", "09"]
    assert chip.led_ratio() == DARK
    assert bus.is_closed


def test_close_releases_the_bus_even_when_the_chip_is_gone(chip, bus, lights):
    chip.nacks_to_come = 1
    with pytest.raises(LightError):
        lights.close()
    assert bus.is_closed


@pytest.mark.parametrize("ratio", [(0.5, 1.2, 0.0, 0.0), (0.0, 0.0, 0.0, float("nan")), (0.5, 0.5, 0.5)])
def test_a_ratio_out_of_bounds_never_reaches_the_bus(bus, lights, ratio):
    with pytest.raises(InvalidQuantity, match="led_ratio"):
        lights.set_ratio(ratio)
    assert written(bus) == []


class ChipWithStuckRegister(Pca9685Chip):
    """Register `stuck` always reads 0."""

    stuck = 0x09

    def read(self, count: int) -> bytes:
        self._registers[self.stuck] = 0
        return super().read(count)


def test_brightness_that_the_chip_does_not_hold_is_a_light_error():
    lights = Pca9685(EmulatedI2cBus({0x40: ChipWithStuckRegister()}))
    with pytest.raises(LightError, match=r"0x40 holds brightness \[0, 0, 0, 0, .* instead of \[0, 0, 0, 16, "):
        lights.set_ratio(DARK)


def test_a_prescaler_that_the_chip_does_not_hold_is_refused_at_start():
    chip = ChipWithStuckRegister()
    chip.stuck = 0xFE
    with pytest.raises(LightError, match=r"holds modes and prescaler \[32, 4, 0\] instead of \[32, 4, 3\]"):
        Pca9685(EmulatedI2cBus({0x40: chip}))


def test_a_chip_that_lost_its_supply_is_noticed_and_set_up_again(chip, lights):
    chip.power_on()
    with pytest.raises(LightError, match="0x40 had lost its set-up"):
        lights.set_ratio(FULL)
    assert chip.led_ratio() == DARK
    lights.set_ratio(FULL)
    assert chip.led_ratio() == FULL


def test_a_chip_of_another_kind_is_refused():
    with pytest.raises(LightError, match="At 0x40 is no PCA9685"):
        Pca9685(EmulatedI2cBus({0x40: Tlc59116Chip()}))


def test_nobody_at_the_address_is_a_light_error(bus):
    with pytest.raises(LightError, match=r"0x41 does not answer: Remote I/O error \(errno 121\)"):
        Pca9685(bus, address=0x41)
