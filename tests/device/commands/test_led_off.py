"""No light is left on by a daemon that was killed: its process is gone, and another one darkens the chip."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from cpu_time import ended_cpu_s
from daemon_process import ROOT, wait_for
from i2c_over_socket import served
from supervisor import DARK_WITHIN_S

from device.__main__ import main as daemon_main
from device.commands import led_off as led_off_module
from device.commands.led_off import HANGS_AFTER_S, PAUSE_S, darken, main
from device.config import LightSection
from device.files.plain_settings import LAST_GOOD
from device.hardware.led_driver import led_driver
from device.simulation.chips.i2c_bus import EmulatedI2cBus, EmulatedLedChip
from device.simulation.chips.pca9685_chip import Pca9685Chip
from device.simulation.chips.remote_line import LineServer, RemoteLine
from device.simulation.chips.tlc59116_chip import Tlc59116Chip
from device.simulation.faults import FaultTimeline, ScriptedFault

DARK = (0.0, 0.0, 0.0, 0.0)
SETTINGS = {"tlc59116": "", "pca9685": '[camera]\nexposure_us = 3932\n[light]\nchip = "pca9685"\n'}
LINES = {"tlc59116": "[light]\nenable_line = 17\n", "pca9685": "enable_line = 17\n"}
CHIPS: dict[str, tuple[int, Callable[[], EmulatedLedChip]]] = {
    "tlc59116": (0x60, Tlc59116Chip),
    "pca9685": (0x40, Pca9685Chip),
}


class HangingBus(EmulatedI2cBus):
    """A bus on which no transaction returns while it hangs."""

    def __init__(self, *chips: Any, **settings: Any) -> None:
        super().__init__(*chips, **settings)
        self.goes_on = threading.Event()
        self.goes_on.set()

    def i2c_rdwr(self, *messages: Any) -> None:
        self.goes_on.wait()
        super().i2c_rdwr(*messages)


class Board:
    """An LED board on a bus of its own, and programs that are run on it one after the other."""

    def __init__(self, folder: Path, kind: str, *faults: ScriptedFault) -> None:
        self.folder, address = folder, CHIPS[kind][0]
        self.chip, self.kind = CHIPS[kind][1](), kind
        self.line: LineServer | None = None
        self.is_wired = False
        self.bus = HangingBus({address: self.chip}, faults=FaultTimeline(faults))
        (folder / "probe.toml").write_text(SETTINGS[kind])

    def wire(self) -> None:
        """Wire the chip's enable line to a GPIO of the board that the programs run on, as it was left."""
        self.line = LineServer(lambda level: self.is_wired and self.chip.enable(level))
        self.is_wired = True  # what is up already stays so: a line that was let go keeps its level on some boards
        with (self.folder / "probe.toml").open("a") as settings:
            settings.write(LINES[self.kind])

    def start(self, *program: str) -> subprocess.Popen[str]:
        path = os.pathsep.join([str(ROOT), str(ROOT / "tests")])
        below = [str(ROOT / "tests" / "i2c_over_socket.py"), str(self.folder / "i2c")]
        if self.line:
            below = [str(ROOT / "tests" / "gpiod_over_socket.py"), self.line.address, *below]
        return subprocess.Popen(
            [sys.executable, *below, *program],
            cwd=self.folder, env={**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"},
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip

    def kill_while_lit(self) -> None:
        process = self.start("lit_process", "probe.toml")
        assert process.stdout is not None
        assert process.stdout.readline() == "lit\n"
        assert min(self.chip.led_ratio()) > 0.5
        process.kill()
        process.communicate(timeout=60)
        assert min(self.chip.led_ratio()) > 0.5, "a killed process switches nothing off"

    def run(self, *program: str) -> tuple[int, str]:
        process = self.start(*program)
        _, errors = process.communicate(timeout=60)
        return process.returncode, errors


@pytest.fixture
def board_of(tmp_path: Path) -> Iterator[Callable[..., Board]]:
    with ExitStack() as serving:

        def board(kind: str, *faults: ScriptedFault) -> Board:
            made = Board(tmp_path, kind, *faults)
            serving.enter_context(served(made.bus, tmp_path / "i2c"))
            return made

        yield board


@pytest.mark.parametrize("program", [("device.commands.led_off", "--config"), ("device", "--config")])
@pytest.mark.parametrize("kind", ["tlc59116", "pca9685"])
def test_the_light_that_a_killed_daemon_left_on_goes_off(board_of, kind, program):
    board = board_of(kind)
    board.kill_while_lit()
    command = ("led-off",) if program[0] == "device" else ()
    assert board.run(*program, "probe.toml", *command) == (0, "")
    assert board.chip.led_ratio() == DARK


@pytest.mark.parametrize("kind", ["tlc59116", "pca9685"])
def test_the_light_of_a_killed_daemon_is_off_within_a_second_of_the_processors_time(board_of, kind):
    """The second counts on an idle probe; here other programs run, so the child's CPU time stands for the wall's.

    What is left of the wall's time is the machine's, and the program's own pauses, which the next test adds up.
    `make bench` takes the time on the wall, from the kill to the chip's darkness (tests/bench_darkness.py).
    """
    board = board_of(kind)
    board.kill_while_lit()
    with board.start("device.commands.led_off", "--config", "probe.toml") as process:
        cpu_s = ended_cpu_s(process)
    assert cpu_s < DARK_WITHIN_S
    assert board.chip.led_ratio() == DARK


def test_it_loads_no_numpy_which_would_be_half_of_its_time():
    program = "import sys, device.commands.led_off; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=False).returncode == 0


@pytest.mark.parametrize("kind", ["tlc59116", "pca9685"])
@pytest.mark.parametrize("nacks", [0, 2])
def test_it_pauses_only_for_the_chips_oscillator_and_before_it_asks_again(board_of, monkeypatch, kind, nacks):
    board, pauses_s = board_of(kind), list[float]()
    board.chip.nacks_to_come = nacks
    monkeypatch.setattr(time, "sleep", pauses_s.append)
    monkeypatch.setattr(led_off_module, "open_led_driver", lambda light: led_driver(light, board.bus))
    darken(LightSection(chip=kind))
    assert sum(pauses_s) <= nacks * PAUSE_S + 0.01
    assert board.chip.led_ratio() == DARK


def test_settings_that_have_gone_bad_since_the_start_leave_no_light_on(board_of, tmp_path):
    board = board_of("pca9685")
    board.kill_while_lit()
    (tmp_path / LAST_GOOD).write_text(SETTINGS["pca9685"])
    (tmp_path / "probe.toml").write_text('data = "."\n[light]\nchip = "pca9686"\n')
    code, _ = board.run("device.commands.led_off", "--config", "probe.toml")
    assert code == 0
    assert board.chip.led_ratio() == DARK


@pytest.mark.parametrize(
    ("program", "bad"),
    [
        (("device.commands.led_off", "--config"), "no = [toml"),
        (("device", "--config"), 'data = "."\n[light]\nchip = "pca9686"\n'),
    ],
)
@pytest.mark.parametrize("kind", ["tlc59116", "pca9685"])
def test_settings_that_never_were_good_leave_no_light_on_whichever_chip_it_is(board_of, tmp_path, kind, program, bad):
    board = board_of(kind)
    board.kill_while_lit()
    (tmp_path / "probe.toml").write_text(bad)
    command = ("led-off",) if program[0] == "device" else ()
    code, errors = board.run(*program, "probe.toml", *command)
    assert code == 1
    assert "probe.toml" in errors, "what is wrong with the settings is told"
    assert board.chip.led_ratio() == DARK


def test_settings_that_are_not_there_leave_no_light_on(board_of):
    board = board_of("pca9685")
    board.kill_while_lit()
    assert board.run("device.commands.led_off", "--config", "none.toml")[0] == 1
    assert board.chip.led_ratio() == DARK


def test_settings_that_name_another_chip_since_the_start_leave_no_light_on(board_of, tmp_path):
    """The files hold, but the daemon that was killed had started with others: both places are asked."""
    board = board_of("pca9685")
    board.kill_while_lit()
    (tmp_path / LAST_GOOD).write_text(SETTINGS["pca9685"])
    (tmp_path / "probe.toml").write_text('data = "."\n')
    code, errors = board.run("device.commands.led_off", "--config", "probe.toml")
    assert (code, errors.count("\n")) == (1, 1)
    assert "LED chip 0x60 does not answer" in errors
    assert board.chip.led_ratio() == DARK


@pytest.mark.parametrize("kind", ["tlc59116", "pca9685"])
def test_the_bytes_on_the_bus_are_those_of_a_driver_that_is_opened_and_closed(board_of, kind):
    """With settings that hold nothing else is asked, of no other address."""
    board, again = board_of(kind), CHIPS[kind][1]()
    bus = EmulatedI2cBus({CHIPS[kind][0]: again})
    led_driver(LightSection(chip=kind), bus).close()
    assert board.run("device.commands.led_off", "--config", "probe.toml") == (0, "")
    assert list(board.bus.log) == list(bus.log)
    assert {address for address, _ in bus.log} == {CHIPS[kind][0]}


@pytest.mark.parametrize("program", ["device.commands.led_off", "device"])
def test_what_checks_settings_is_loaded_only_after_darkness_and_where_they_are_bad(program, tmp_path):
    """pydantic alone takes longer than all that darkens."""
    (tmp_path / "probe.toml").write_text("[light]\nbus = 254\n")
    line = ["--config", str(tmp_path / "probe.toml"), *(["led-off"] if program == "device" else [])]
    module = "device.__main__" if program == "device" else program
    source = f"import sys, {module} as program; program.main({line}); sys.exit('pydantic' in sys.modules)"
    ended = subprocess.run([sys.executable, "-c", source], cwd=ROOT, capture_output=True, text=True, check=False)
    assert "I2C bus 254 cannot be opened" in ended.stderr
    assert ended.returncode == 0


def test_where_nothing_is_lit_it_is_dark_again(board_of):
    board = board_of("tlc59116")
    assert board.run("device.commands.led_off") == (0, "")
    assert board.chip.led_ratio() == DARK


def test_a_chip_that_does_not_acknowledge_at_first_is_asked_again(board_of):
    board = board_of("tlc59116")
    board.kill_while_lit()
    board.chip.nacks_to_come = 2
    assert board.run("device.commands.led_off") == (0, "")
    assert board.chip.led_ratio() == DARK


@pytest.mark.parametrize(
    ("kind", "words"), [("i2c_nack", "LED chip 0x60 does not answer"), ("i2c_stuck", "bus of the LED chip is stuck")]
)
def test_a_chip_or_bus_that_does_not_answer_is_one_sentence_and_exit_1(board_of, kind, words):
    board = board_of("tlc59116", ScriptedFault(kind))
    code, errors = board.run("device.commands.led_off")
    assert code == 1
    [line] = errors.splitlines()
    assert words in line


def test_a_bus_that_is_not_there_is_one_sentence_and_exit_1(capsys, tmp_path):
    (tmp_path / "probe.toml").write_text("[light]\nbus = 254\n")
    assert main(["--config", str(tmp_path / "probe.toml")]) == 1
    [line] = capsys.readouterr().err.splitlines()
    assert "I2C bus 254 cannot be opened" in line


def test_the_emulated_probe_has_no_light_to_darken(capsys):
    with pytest.raises(SystemExit) as usage:
        daemon_main(["--simulate", "led-off"])
    assert usage.value.code == 2
    assert "leave out --simulate" in capsys.readouterr().err


@pytest.mark.parametrize("program", [("device.commands.led_off", "--config"), ("device", "--config")])
def test_a_bus_that_hangs_is_not_waited_for(board_of, program):
    """The transaction never returns, as on a bus that a broken chip holds: the command says so and ends."""
    board = board_of("tlc59116")
    board.kill_while_lit()
    board.bus.goes_on.clear()
    command = ("led-off",) if program[0] == "device" else ()
    code, errors = board.run(*program, "probe.toml", *command)
    assert code == 1
    [line] = errors.splitlines()
    assert line.startswith(f"The I2C bus of the LED chip hangs: no answer for {HANGS_AFTER_S:g} s.")
    assert "enables" not in line
    board.bus.goes_on.set()


@pytest.mark.parametrize("kind", ["tlc59116", "pca9685"])
def test_with_an_enable_line_a_chip_on_a_bus_that_hangs_is_dark_all_the_same(board_of, kind):
    board = board_of(kind)
    board.kill_while_lit()
    board.wire()
    assert min(board.chip.led_ratio()) > 0.5
    board.bus.goes_on.clear()
    code, errors = board.run("device.commands.led_off", "--config", "probe.toml")
    assert code == 1
    assert "hangs" in errors
    assert "The line that enables the LEDs is low." in errors
    assert board.chip.led_ratio() == DARK
    board.bus.goes_on.set()


@pytest.mark.parametrize("kind", ["tlc59116", "pca9685"])
def test_with_an_enable_line_the_chip_is_darkened_by_both_and_read_back(board_of, kind):
    board = board_of(kind)
    board.kill_while_lit()
    board.wire()
    assert board.run("device.commands.led_off", "--config", "probe.toml") == (0, "")
    board.chip.enable(True)
    assert board.chip.led_ratio() == DARK


def test_a_line_that_another_program_has_keeps_it_from_nothing_but_the_line(board_of):
    board = board_of("tlc59116")
    board.kill_while_lit()
    board.wire()
    owner = RemoteLine(board.line.address)
    owner.switch(True)
    assert board.run("device.commands.led_off", "--config", "probe.toml")[0] == 0
    assert board.chip.led_ratio() == DARK
    owner.switch(False)
    wait_for(lambda: board.chip.is_answering, lambda is_answering: not is_answering)
    code, errors = board.run("device.commands.led_off", "--config", "probe.toml")
    assert code == 1
    assert "The line that enables the LEDs cannot be had: Device or resource busy." in errors
    owner.close()
