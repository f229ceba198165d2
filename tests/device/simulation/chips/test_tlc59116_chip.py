"""The emulated TLC59116 and its bus: registers in, light out, as its datasheet says."""

from __future__ import annotations

import pytest
from smbus2 import i2c_msg

from device.simulation.chips.i2c_bus import EmulatedI2cBus
from device.simulation.chips.tlc59116_chip import Tlc59116Chip
from device.simulation.faults import FaultTimeline, ScriptedFault

DARK = (0.0, 0.0, 0.0, 0.0)


@pytest.fixture
def chip() -> Tlc59116Chip:
    return Tlc59116Chip()


def send(chip: Tlc59116Chip, *messages: str) -> None:
    for message in messages:
        chip.write(bytes.fromhex(message))
        chip.stop()


def test_a_chip_just_powered_is_dark_with_its_oscillator_off(chip):
    chip.write(b"\x00")
    assert chip.read(1) == b"\x11"
    send(chip, "a2 ff ff ff ff", "94 aa")
    assert chip.led_ratio() == DARK


def test_brightness_shows_only_where_the_output_mode_asks_for_it(chip):
    """LEDOUT0 = 0b11_10_01_00: output 0 off, 1 full, 2 PWM, 3 PWM with group."""
    send(chip, "00 00", "a2 33 33 33 33", "14 e4")
    assert chip.led_ratio() == (0.0, 1.0, 0.2, 0.2)


@pytest.mark.parametrize(
    ("control", "first_byte_again"),
    [("80", 0x1C), ("a2", 0x10), ("d2", 0x02), ("e2", 0x12)],
)
def test_auto_increment_returns_to_the_first_register_of_its_range(chip, control, first_byte_again):
    """Ranges 00-1B, 02-11, 12-13, 02-13 (datasheet 9.5.11)."""
    chip.write(bytes.fromhex(control))
    registers = chip.read(2 * first_byte_again)
    assert registers[:first_byte_again] == registers[first_byte_again:]


def test_without_auto_increment_all_values_land_in_one_register(chip):
    chip.write(bytes.fromhex("02 11 22 33"))
    chip.write(b"\x82")
    assert chip.read(2) == b"\x33\x00"


def test_light_changes_at_the_end_of_the_transaction(chip):
    send(chip, "00 00", "14 aa")
    chip.write(bytes.fromhex("a2 ff ff ff ff"))
    assert chip.led_ratio() == DARK
    chip.stop()
    assert chip.led_ratio() == (1.0, 1.0, 1.0, 1.0)


def test_the_light_of_any_past_moment_is_known():
    now_s = iter(range(100))
    chip = Tlc59116Chip(clock=lambda: next(now_s))  # power-on is change 0
    send(chip, "00 00", "14 aa", "02 ff", "02 33")  # changes 1 to 4
    assert [chip.ratio_at(t_s)[0] for t_s in (-1.0, 2.9, 3.0, 3.9, 4.0, 50.0)] == [0.0, 0.0, 1.0, 1.0, 0.2, 0.2]


def test_the_bus_carries_genuine_messages_and_logs_the_writes(chip):
    bus = EmulatedI2cBus({0x60: chip})
    answer = i2c_msg.read(0x60, 2)
    bus.i2c_rdwr(i2c_msg.write(0x60, [0xA2, 1, 2]))
    bus.i2c_rdwr(i2c_msg.write(0x60, [0xA2]), answer)
    assert bytes(answer) == b"\x01\x02"
    assert list(bus.log) == [(0x60, b"\xa2\x01\x02"), (0x60, b"\xa2")]


def test_nobody_at_an_address_is_the_kernels_error_121(chip):
    bus = EmulatedI2cBus({0x60: chip})
    with pytest.raises(OSError, match="Remote I/O error") as caught:
        bus.i2c_rdwr(i2c_msg.write(0x61, [0]))
    assert caught.value.errno == 121


def test_an_injected_nack_happens_once_and_changes_nothing(chip):
    bus = EmulatedI2cBus({0x60: chip})
    chip.nacks_to_come = 1
    with pytest.raises(OSError, match="Remote I/O error"):
        bus.i2c_rdwr(i2c_msg.write(0x60, [0x02, 0xFF]))
    assert not bus.log
    bus.i2c_rdwr(i2c_msg.write(0x60, [0x02, 0xFF]))
    assert bus.log


@pytest.mark.parametrize(("kind", "number"), [("i2c_nack", 121), ("i2c_stuck", 110)])
def test_a_faulty_bus_answers_as_the_kernel_does_and_leaves_the_registers_alone(chip, kind, number):
    now_s = [0.0]
    faults = FaultTimeline([ScriptedFault(kind, from_s=1.0, until_s=2.0)], clock=lambda: now_s[0])
    bus = EmulatedI2cBus({0x60: chip}, faults=faults)
    send(chip, "00 00", "14 aa", "02 ff")
    now_s[0] = 1.0
    with pytest.raises(OSError, match=r".") as caught:
        bus.i2c_rdwr(i2c_msg.write(0x60, [0x02, 0]))
    assert caught.value.errno == number
    assert chip.led_ratio() == (1.0, 0.0, 0.0, 0.0)
    now_s[0] = 2.0
    bus.i2c_rdwr(i2c_msg.write(0x60, [0x02, 0]))
    assert chip.led_ratio() == (0.0, 0.0, 0.0, 0.0)


def test_a_closed_bus_carries_nothing_and_leaves_the_light_as_it_is(chip):
    bus = EmulatedI2cBus({0x60: chip})
    send(chip, "00 00", "14 aa", "02 ff")
    bus.close()
    with pytest.raises(OSError, match="Bad file descriptor"):
        bus.i2c_rdwr(i2c_msg.write(0x60, [0x02, 0]))
    assert chip.led_ratio() == (1.0, 0.0, 0.0, 0.0)


def flags(chip: Tlc59116Chip) -> int:
    chip.write(b"\x1d")
    return chip.read(1)[0]


def test_an_error_flag_is_1_where_an_output_is_on_without_pwm_and_current_flows():
    chip = Tlc59116Chip(faults=FaultTimeline([ScriptedFault("led_open", side="+y")]))
    send(chip, "14 55")
    assert flags(chip) == 0  # the oscillator is off
    send(chip, "00 00")
    assert flags(chip) == 0b1101
    send(chip, "14 64")  # 0 off, 1 full, 2 PWM, 3 full
    assert flags(chip) == 0b1000


def test_overheating_is_remembered_until_it_is_cleared():
    now_s = [0.0]
    faults = FaultTimeline([ScriptedFault("led_driver_hot", until_s=1.0)], clock=lambda: now_s[0])
    chip = Tlc59116Chip(faults=faults)
    send(chip, "00 00", "14 55")
    assert flags(chip) == 0
    now_s[0] = 2.0
    assert flags(chip) == 0
    send(chip, "01 80", "01 00")
    assert flags(chip) == 0b1111


def test_a_reset_line_that_is_low_takes_it_off_the_bus_dark_and_with_the_registers_of_a_power_on():
    chip = Tlc59116Chip()
    fresh = chip.read(32)
    chip.write(bytes([0x00, 0x00]))
    chip.write(bytes([0x14, 0b01]))
    chip.stop()
    assert max(chip.led_ratio()) == 1.0
    chip.enable(False)
    assert (max(chip.led_ratio()), chip.is_answering) == (0.0, False)
    chip.enable(True)
    chip.write(bytes([0x00]))
    assert (chip.read(32), chip.is_answering, max(chip.led_ratio())) == (fresh, True, 0.0)
