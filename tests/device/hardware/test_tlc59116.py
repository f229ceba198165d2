"""The TLC59116 driver as a transcript of I2C bytes, against the emulated chip."""

from __future__ import annotations

import time

import pytest

from device.errors import HotLedDriverError, LightError, OpenLedError
from device.hardware.tlc59116 import Tlc59116
from device.measurement.quantities import InvalidQuantity
from device.simulation.chips.i2c_bus import EmulatedI2cBus
from device.simulation.chips.pca9685_chip import Pca9685Chip
from device.simulation.chips.tlc59116_chip import Tlc59116Chip
from device.simulation.faults import FaultTimeline, ScriptedFault


@pytest.fixture
def chip() -> Tlc59116Chip:
    return Tlc59116Chip()


@pytest.fixture
def bus(chip: Tlc59116Chip) -> EmulatedI2cBus:
    return EmulatedI2cBus({0x60: chip})


@pytest.fixture
def lights(bus: EmulatedI2cBus) -> Tlc59116:
    lights = Tlc59116(bus)
    bus.log.clear()
    return lights


def written(bus: EmulatedI2cBus) -> list[str]:
    return [data.hex(" ") for _address, data in bus.log]


def test_start_wakes_the_oscillator_darkens_every_output_then_enables_the_four_sides(chip, bus):
    Tlc59116(bus)
    assert written(bus) == [
        "00 00",
        "a2" + " 00" * 16,
        "94 aa 00 00 00",
        "98",
        "94",
    ]
    assert chip.led_ratio() == (0.0, 0.0, 0.0, 0.0)


def test_four_sides_change_in_one_transaction_and_are_read_back(chip, bus, lights):
    """0.6 * 255 = 153 = 0x99, 0.2 * 255 = 51 = 0x33."""
    lights.set_ratio((0.6, 0.0, 1.0, 0.2))
    assert written(bus) == ["a2 99 00 ff 33", "80"]
    assert chip.led_ratio() == (0.6, 0.0, 1.0, 0.2)


def test_acknowledged_time_is_not_before_the_light_changed(chip, lights):
    before_s = time.monotonic()
    acknowledged_s = lights.set_ratio((1.0, 1.0, 1.0, 1.0))
    assert before_s <= acknowledged_s <= time.monotonic()
    assert chip.ratio_at(acknowledged_s) == (1.0, 1.0, 1.0, 1.0)
    assert chip.ratio_at(before_s) == (0.0, 0.0, 0.0, 0.0)


def test_close_darkens_all_sides_before_it_releases_the_bus(chip, bus, lights):
    lights.set_ratio((1.0, 1.0, 1.0, 1.0))
    bus.log.clear()
    lights.close()
    assert written(bus) == ["a2 00 00 00 00", "80"]
    assert chip.led_ratio() == (0.0, 0.0, 0.0, 0.0)
    assert bus.is_closed


def test_close_releases_the_bus_even_when_the_chip_is_gone(chip, bus, lights):
    chip.nacks_to_come = 1
    with pytest.raises(LightError):
        lights.close()
    assert bus.is_closed


@pytest.mark.parametrize(
    ("ratio", "named"),
    [
        ((0.5, 1.2, 0.0, 0.0), r"led_ratio\[1\] is 1.2"),
        ((-0.1, 0.0, 0.0, 0.0), r"led_ratio\[0\] is -0.1"),
        ((0.0, 0.0, 0.0, float("nan")), r"led_ratio\[3\] is nan"),
        ((0.5, 0.5, 0.5), "4 numbers"),
    ],
)
def test_a_ratio_out_of_bounds_never_reaches_the_bus(bus, lights, ratio, named):
    with pytest.raises(InvalidQuantity, match=named):
        lights.set_ratio(ratio)
    assert written(bus) == []


def test_a_nack_is_a_light_error_with_address_and_errno_and_the_next_set_works(chip, lights):
    chip.nacks_to_come = 1
    with pytest.raises(LightError, match=r"0x60 does not answer: Remote I/O error \(errno 121\)"):
        lights.set_ratio((1.0, 0.0, 0.0, 0.0))
    lights.set_ratio((1.0, 0.0, 0.0, 0.0))
    assert chip.led_ratio() == (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(("number", "code"), [(110, "E202"), (16, "E202"), (11, "E202"), (121, "E201"), (5, "E201")])
def test_a_stuck_bus_is_told_from_a_chip_that_does_not_answer(bus, lights, monkeypatch, number, code):
    """ETIMEDOUT, EBUSY and EAGAIN are the bus; EREMOTEIO and EIO are the chip."""

    def fail(*_messages):
        raise OSError(number, "I2C")

    monkeypatch.setattr(bus, "i2c_rdwr", fail)
    with pytest.raises(LightError, match=f"errno {number}") as error:
        lights.set_ratio((1.0, 0.0, 0.0, 0.0))
    assert error.value.code == code


class ChipWithStuckRegister(Tlc59116Chip):
    """Register `stuck` always reads 0."""

    stuck = 0x03

    def read(self, count: int) -> bytes:
        self._registers[self.stuck] = 0
        return super().read(count)


def test_brightness_that_the_chip_does_not_hold_is_a_light_error():
    lights = Tlc59116(EmulatedI2cBus({0x60: ChipWithStuckRegister()}))
    with pytest.raises(LightError, match=r"holds brightness \[255, 0, 255, 255\] instead of \[255, 255, 255, 255\]"):
        lights.set_ratio((1.0, 1.0, 1.0, 1.0))


def test_output_modes_that_the_chip_does_not_hold_are_refused_at_start():
    chip = ChipWithStuckRegister()
    chip.stuck = 0x14
    with pytest.raises(LightError, match="holds output modes"):
        Tlc59116(EmulatedI2cBus({0x60: chip}))


def test_a_chip_that_lost_its_supply_is_noticed_although_it_holds_the_brightness(chip, lights):
    chip.power_on()
    with pytest.raises(LightError, match="had lost its set-up"):
        lights.set_ratio((1.0, 1.0, 1.0, 1.0))
    assert chip.led_ratio() == (0.0, 0.0, 0.0, 0.0)
    lights.set_ratio((1.0, 1.0, 1.0, 1.0))  # set up again, it lights again
    assert chip.led_ratio() == (1.0, 1.0, 1.0, 1.0)


def test_a_chip_at_another_address_is_a_light_error(bus):
    with pytest.raises(LightError, match="0x61 does not answer"):
        Tlc59116(bus, address=0x61)


class SharedAddress:
    """Two chips at one address: both take what is written, and a 0 from either wins on the line."""

    nacks_to_come, is_answering = 0, True

    def __init__(self, *chips):
        self.chips = chips

    def write(self, data):
        for chip in self.chips:
            chip.write(data)

    def read(self, count):
        first, second = (chip.read(count) for chip in self.chips)
        return bytes(one & other for one, other in zip(first, second, strict=True))

    def stop(self):
        for chip in self.chips:
            chip.stop()


def test_two_devices_on_one_address_are_refused_and_the_chip_is_dark(chip):
    with pytest.raises(LightError, match=r"no TLC59116, or another device too: it answers \[.*\], not \[210, 212"):
        Tlc59116(EmulatedI2cBus({0x60: SharedAddress(chip, Pca9685Chip())}))
    assert chip.led_ratio() == (0.0, 0.0, 0.0, 0.0)


def test_a_chip_of_another_kind_is_refused():
    with pytest.raises(LightError, match="At 0x60 is no TLC59116"):
        Tlc59116(EmulatedI2cBus({0x60: Pca9685Chip()}))


def with_faults(*faults: ScriptedFault, clock=time.monotonic) -> tuple[Tlc59116, EmulatedI2cBus, Tlc59116Chip]:
    chip = Tlc59116Chip(faults=FaultTimeline(faults, clock=clock))
    bus = EmulatedI2cBus({0x60: chip})
    lights = Tlc59116(bus)
    bus.log.clear()
    return lights, bus, chip


def test_the_currents_are_checked_with_all_sides_fully_on_and_the_check_ends_dark():
    lights, bus, chip = with_faults()
    lights.set_ratio((0.6, 0.6, 0.6, 0.6))
    bus.log.clear()
    lights.check_outputs()
    assert written(bus) == ["a2 00 00 00 00", "80", "14 55", "1d", "14 aa"]
    assert chip.led_ratio() == (0.0, 0.0, 0.0, 0.0)


def test_sides_without_current_are_named_after_the_flags_were_cleared_once():
    lights, bus, chip = with_faults(ScriptedFault("led_open", side="+y"), ScriptedFault("led_open", side="-y"))
    with pytest.raises(OpenLedError, match=r"No current flows through the LED at \+y and -y"):
        lights.check_outputs()
    assert written(bus)[2:] == ["14 55", "1d", "14 aa", "01 80", "01 00", "14 55", "1d", "14 aa"]
    assert chip.led_ratio() == (0.0, 0.0, 0.0, 0.0)


def test_a_chip_that_stays_hot_has_no_current_at_any_side():
    with pytest.raises(HotLedDriverError, match="too hot, or the LEDs are not connected"):
        with_faults(ScriptedFault("led_driver_hot"))[0].check_outputs()


def test_a_chip_that_has_cooled_down_still_says_that_it_was_hot_once():
    """It is hot at 1 s only: the flags it set then go away when they are cleared."""
    now_s = [0.0]
    lights, _, chip = with_faults(ScriptedFault("led_driver_hot", from_s=1.0, until_s=2.0), clock=lambda: now_s[0])
    now_s[0] = 1.0
    chip.read(1)
    now_s[0] = 3.0
    with pytest.raises(HotLedDriverError, match=r"had switched off \+x and \+y and -x and -y: it is too hot\."):
        lights.check_outputs()
    lights.check_outputs()


def test_a_check_that_fails_on_the_bus_leaves_no_side_fully_on():
    """The read of the flags is not acknowledged; the write of the output modes after it is."""
    lights, bus, chip = with_faults()
    carry = bus.i2c_rdwr

    def fail_on_flags(*messages):
        if bytes(messages[0].buf[:1]) == b"\x1d":
            raise OSError(121, "Remote I/O error")
        carry(*messages)

    bus.i2c_rdwr = fail_on_flags
    with pytest.raises(LightError, match="does not answer"):
        lights.check_outputs()
    assert chip.led_ratio() == (0.0, 0.0, 0.0, 0.0)


def test_a_check_whose_last_write_fails_is_dark_again_with_the_next_darkness():
    """The write that ends full brightness is not acknowledged: until it is, brightness 0 alone would not darken."""
    lights, bus, chip = with_faults()
    carry, failing = bus.i2c_rdwr, [True]

    def fail_once(*messages):
        if failing and bytes(messages[0].buf[:2]) == b"\x14\xaa":
            failing.clear()
            raise OSError(121, "Remote I/O error")
        carry(*messages)

    bus.i2c_rdwr = fail_once
    with pytest.raises(LightError, match="does not answer"):
        lights.check_outputs()
    assert chip.led_ratio() == (1.0, 1.0, 1.0, 1.0)
    lights.set_ratio((0.0, 0.0, 0.0, 0.0))
    assert chip.led_ratio() == (0.0, 0.0, 0.0, 0.0)
