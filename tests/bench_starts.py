"""Times what a person at the probe types, each as a ratio to an interpreter that does nothing: `faults`, `config`, and
`led-off` until the LED chip is dark.

The verbs count in processor's time. From `led-off` to darkness is the wall's: the command runs on a bus of the kernel's
kind (tests/rig/i2c_shim.c), whose chip was left lit by a process that was killed, as the daemon's would be.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parent / "rig"))

from bench_table import Figure
from cpu_time import ended_cpu_s
from i2c_over_socket import served
from rig import build_shim

from device.hardware.tlc59116 import Tlc59116
from device.simulation.chips.i2c_bus import EmulatedI2cBus
from device.simulation.chips.tlc59116_chip import Tlc59116Chip

CHAPTER = "starts of the probe's commands"
ROUNDS = 7
VERBS = {"faults": 4.5, "config check": 14.0}
"""With its bound, half as much again as measured: 2.9 and 9.2 interpreters."""
DARK_BOUND = 6.0
"""0.15 s where the interpreter takes 0.025."""
STEP_S = 0.0005
LIT = (0.6, 0.6, 0.6, 0.6)
NOTHING = ("-c", "pass")


def figures() -> Iterator[Figure]:
    """Yield the starts, then the darkness, each the least of some rounds over the least of an interpreter's."""
    with TemporaryDirectory(prefix="tsis-") as folder:
        for verb, bound in VERBS.items():
            words = ("-m", "device", "--root", folder, *verb.split())
            seconds, others_s = _least(partial(_cpu_s, words), partial(_cpu_s, NOTHING))
            yield _figure(f"device {verb}", seconds, others_s, bound)
        with LitBoard(Path(folder)) as board:
            seconds, others_s = _least(board.dark_s, partial(_wall_s, NOTHING))
        yield _figure("device led-off, until the chip is dark", seconds, others_s, DARK_BOUND)


def _least(*works: Callable[[], float]) -> list[float]:
    """Return the least seconds of each work, done in turns."""
    return [min(times) for times in zip(*([work() for work in works] for _ in range(ROUNDS)), strict=True)]


def _figure(name: str, seconds: float, others_s: float, bound: float) -> Figure:
    return Figure(CHAPTER, name, seconds / others_s, '"pass"', bound, here=f"{1e3 * seconds:.0f} ms here")


def _cpu_s(words: tuple[str, ...]) -> float:
    return ended_cpu_s(subprocess.Popen([sys.executable, *words], stdout=subprocess.DEVNULL))


def _wall_s(words: tuple[str, ...]) -> float:
    begun_s = time.perf_counter()
    subprocess.run([sys.executable, *words], check=True)
    return time.perf_counter() - begun_s


class LitBoard:
    """A board whose LEDs are on, with a bus that outlives every process on it."""

    def __init__(self, folder: Path) -> None:
        self._chip = Tlc59116Chip()
        self._bus = EmulatedI2cBus({0x60: self._chip})
        self._serving = served(self._bus, folder / "i2c")
        (folder / "etc" / "tsis").mkdir(parents=True)
        (folder / "etc" / "tsis" / "config.toml").write_text(f'serial = "P-1"\ndata = "{folder}"\n[light]\nbus = 1\n')
        self._words = [sys.executable, "-m", "device", "led-off", "--root", str(folder)]
        shim = {"LD_PRELOAD": str(build_shim(folder)), "TSIS_RIG_I2C": str(folder / "i2c")}
        self._environment = {**os.environ, **shim}

    def __enter__(self) -> LitBoard:
        self._serving.__enter__()
        return self

    def __exit__(self, *raised: object) -> None:
        self._serving.__exit__(None, None, None)

    def dark_s(self) -> float:
        """Light all sides, run the command, and return the time from its start until none shines."""
        Tlc59116(self._bus).set_ratio(LIT)
        assert min(self._chip.led_ratio()) > 0.5
        begun_s = time.perf_counter()
        with subprocess.Popen(self._words, env=self._environment) as process:
            while any(self._chip.led_ratio()) and process.poll() is None:
                time.sleep(STEP_S)
            took_s = time.perf_counter() - begun_s
            assert process.wait() == 0
        assert not any(self._chip.led_ratio())
        return took_s
