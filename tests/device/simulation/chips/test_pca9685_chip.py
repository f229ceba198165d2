"""The emulated PCA9685: registers in, light out, as its datasheet says."""

from __future__ import annotations

import pytest

from device.simulation.chips.pca9685_chip import Pca9685Chip

DARK = (0.0, 0.0, 0.0, 0.0)
AWAKE = ("00 20",)


@pytest.fixture
def chip() -> Pca9685Chip:
    return Pca9685Chip()


def send(chip: Pca9685Chip, *messages: str) -> None:
    for message in messages:
        chip.write(bytes.fromhex(message))
        chip.stop()


def read(chip: Pca9685Chip, register: int, count: int) -> str:
    chip.write(bytes([register]))
    return chip.read(count).hex(" ")


def test_a_chip_just_powered_is_asleep_and_dark_and_says_who_it_is(chip):
    assert read(chip, 0x00, 2) == "11 11"  # no auto-increment yet
    assert chip.led_ratio() == DARK
    send(chip, "00 30")
    assert read(chip, 0x01, 9) == "04 e2 e4 e8 e0 00 00 00 10"
    assert read(chip, 0xFE, 1) == "1e"


def test_nothing_shines_while_the_oscillator_sleeps(chip):
    send(chip, "00 30", "06 00 10 00 00")
    assert chip.led_ratio() == DARK
    send(chip, *AWAKE)
    assert chip.led_ratio() == (1.0, 0.0, 0.0, 0.0)


def test_an_output_shines_from_its_on_count_to_its_off_count(chip):
    """Datasheet figure 9: 511 to 3071; 2047 to 767, over the end of the period; always on; equal counts are off."""
    send(chip, *AWAKE, "06 ff 01 ff 0b ff 07 ff 02 fe 13 ff 0f ff 03 ff 03")
    assert chip.led_ratio() == (2560 / 4096, (4096 - 1280) / 4096, 1.0, 0.0)


def test_always_off_wins_over_always_on(chip):
    send(chip, *AWAKE, "06 00 10 00 10")
    assert chip.led_ratio() == DARK


def test_the_registers_of_all_outputs_load_each_output_and_read_zero(chip):
    send(chip, *AWAKE, "fa 00 10 00 00")
    assert chip.led_ratio() == (1.0, 1.0, 1.0, 1.0)
    assert read(chip, 0x42, 4) == "00 10 00 00"
    assert read(chip, 0xFA, 4) == "00 00 00 00"
    send(chip, "fd 10")
    assert chip.led_ratio() == DARK


def test_the_prescaler_is_taken_only_asleep_and_not_below_3(chip):
    send(chip, *AWAKE, "fe 79")
    assert read(chip, 0xFE, 1) == "1e"
    send(chip, "00 30", "fe 79")
    assert read(chip, 0xFE, 1) == "79"
    send(chip, "fe 00")
    assert read(chip, 0xFE, 1) == "03"


@pytest.mark.parametrize("last", [0x45, 0xFE])
def test_auto_increment_returns_to_mode1_after_the_last_output_and_the_prescaler(chip, last):
    send(chip, *AWAKE)
    assert read(chip, last, 3).split()[1:] == ["20", "04"]


def test_light_changes_at_the_end_of_the_period_in_which_the_transaction_ended():
    """Prescaler 3: 655.36 us. Written at 1.5 periods, the light is there from 2 periods on."""
    period_s, now_s = 655.36e-6, [0.0]
    chip = Pca9685Chip(clock=lambda: now_s[0])
    send(chip, "00 30", "fe 03", *AWAKE)
    now_s[0] = 1.5 * period_s
    send(chip, "06 00 10 00 00")
    assert [chip.ratio_at(periods * period_s)[0] for periods in (1.0, 1.99, 2.01)] == [0.0, 0.0, 1.0]


def test_outputs_that_are_not_enabled_are_dark_and_its_registers_stay():
    now_s = [1.0]
    chip = Pca9685Chip(clock=lambda: now_s[0])
    chip.write(bytes([0x00, 0x20]))
    chip.write(bytes([0x06, 0x00, 0x10, 0x00, 0x00]))
    chip.stop()
    now_s[0] = 2.0
    chip.enable(False)
    assert (chip.ratio_at(1.9)[0], chip.ratio_at(2.0)[0], chip.is_answering) == (1.0, 0.0, True)
    now_s[0] = 3.0
    chip.enable(True)
    assert chip.ratio_at(3.0)[0] == 1.0
