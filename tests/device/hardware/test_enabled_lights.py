"""LED chips behind an enable line: what shines, when the line falls, and a chip that does not obey it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from device.config import LightSection
from device.errors import LightCutError, LightError, LightLineError
from device.hardware.led_driver import led_driver
from device.simulation.chips.i2c_bus import EmulatedI2cBus, EmulatedLedChip
from device.simulation.chips.pca9685_chip import Pca9685Chip
from device.simulation.chips.tlc59116_chip import Tlc59116Chip

LIT, DARK = (0.6, 0.6, 0.6, 0.6), (0.0, 0.0, 0.0, 0.0)
KINDS: dict[str, Callable[[], EmulatedLedChip]] = {"tlc59116": Tlc59116Chip, "pca9685": Pca9685Chip}


class Line:
    """The line above its keeper: falls when a test lets it."""

    def __init__(self, chip: EmulatedLedChip) -> None:
        self._chip, self.is_up, self.is_wired, self.ups, self.is_closed = chip, False, True, 0, False
        self._switch(False)

    def _switch(self, is_up: bool) -> None:
        self.is_up = is_up
        if self.is_wired:
            self._chip.enable(is_up)

    def up(self) -> bool:
        was_up, self.ups = self.is_up, self.ups + 1
        if not was_up:
            self._switch(True)
        return was_up

    def hold(self) -> None:
        if not self.is_up:
            raise LightCutError("It fell.", "Press again.")

    def down(self) -> None:
        self._switch(False)

    def close(self) -> None:
        self.down()
        self.is_closed = True


class Board:
    """A chip with its line, and the driver on both."""

    def __init__(self, kind: str) -> None:
        settings = LightSection(chip=kind)
        self.chip = KINDS[kind]()
        self.bus = EmulatedI2cBus({settings.chip_address: self.chip})
        self.line = Line(self.chip)
        self.lights = led_driver(settings, self.bus, self.line)


@pytest.fixture(params=KINDS)
def board(request: pytest.FixtureRequest) -> Board:
    return Board(request.param)


@pytest.fixture
def tlc59116() -> Board:
    return Board("tlc59116")


def shown(board: Board) -> float:
    """Return the light after the PWM period in which it was set."""
    return max(board.chip.ratio_at(float("inf")))


def test_the_line_is_up_only_while_there_is_light(board):
    assert not board.line.is_up
    for _ in range(2):
        board.lights.set_ratio(LIT)
        assert board.line.is_up
        assert shown(board) == pytest.approx(0.6, abs=0.01)
        board.lights.set_ratio((0.0, 0.3, 0.0, 0.0))
        assert board.line.is_up
        board.lights.set_ratio(DARK)
        assert not board.line.is_up
        assert shown(board) == 0.0


def test_a_line_that_falls_takes_the_light_and_the_loop_hears_of_it(board):
    board.lights.set_ratio(LIT)
    board.lights.go_on()
    board.line.down()
    assert shown(board) == 0.0
    with pytest.raises(LightCutError):
        board.lights.go_on()
    board.lights.set_ratio(LIT)
    board.lights.go_on()
    assert shown(board) > 0.5


def test_an_error_of_the_chip_takes_the_light_away(board):
    board.lights.set_ratio(LIT)
    board.chip.nacks_to_come = 1
    with pytest.raises(LightError, match="does not answer"):
        board.lights.set_ratio((0.1, 0.1, 0.1, 0.1))
    assert not board.line.is_up
    assert shown(board) == 0.0


def test_currents_are_looked_at_with_the_line_up_and_it_is_dark_after_that(board):
    board.lights.check_outputs()
    assert not board.line.is_up
    assert shown(board) == 0.0


def test_it_ends_dark_with_bus_and_line_let_go(board):
    board.lights.set_ratio(LIT)
    board.lights.close()
    assert (board.line.is_closed, board.bus.is_closed, shown(board)) == (True, True, 0.0)


@pytest.mark.parametrize(("kind", "is_shown"), [("tlc59116", True), ("pca9685", False)])
def test_only_a_chip_that_is_reset_by_the_line_shows_that_it_obeys(kind, is_shown):
    assert Board(kind).lights.check_line() is is_shown


def test_a_chip_that_is_wired_to_no_line_is_refused_at_the_start_and_dark(monkeypatch):
    monkeypatch.setattr(Line, "is_wired", False, raising=False)
    monkeypatch.setattr(Line, "_switch", lambda self, is_up: setattr(self, "is_up", is_up))
    chip = Tlc59116Chip()
    with pytest.raises(LightLineError, match="has not been reset by it") as refusal:
        led_driver(LightSection(), EmulatedI2cBus({0x60: chip}), Line(chip))
    assert refusal.value.code == "E213"
    assert chip.led_ratio() == DARK


def test_a_wire_that_comes_off_later_is_told_before_anything_shines(tlc59116):
    tlc59116.line.is_wired = False
    tlc59116.chip.enable(True)
    tlc59116.lights.set_ratio(DARK)  # sets the chip up, which has been reset until now
    with pytest.raises(LightLineError):
        tlc59116.lights.set_ratio(LIT)
    assert tlc59116.chip.led_ratio() == DARK
    tlc59116.lights.close()
    assert tlc59116.bus.is_closed


def test_a_line_that_fell_in_the_middle_of_a_transaction_is_at_fault_and_not_the_chip(tlc59116, monkeypatch):
    """As after a bus that hung: the chip is off the bus by then, or has lost its set-up."""
    tlc59116.lights.set_ratio(LIT)
    carry = tlc59116.bus.i2c_rdwr

    def hangs(*messages: object) -> None:
        tlc59116.line.down()
        carry(*messages)

    monkeypatch.setattr(tlc59116.bus, "i2c_rdwr", hangs)
    with pytest.raises(LightCutError):
        tlc59116.lights.set_ratio((0.5, 0.5, 0.5, 0.5))


def test_a_keeper_that_is_gone_is_told_and_the_line_asked_low(tlc59116, monkeypatch):
    def gone() -> bool:
        raise LightCutError("Its keeper has ended.", "Press again.")

    tlc59116.lights.set_ratio(LIT)
    monkeypatch.setattr(tlc59116.line, "up", gone)
    with pytest.raises(LightCutError):
        tlc59116.lights.set_ratio(LIT)
    assert not tlc59116.line.is_up
