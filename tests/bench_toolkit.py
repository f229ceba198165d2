"""What a researcher waits for, each as a ratio of processor's time to something run in the same minute.

Fails where a ratio misses its bound. A ramp of forces with its baseline stands beside the exp and sum of one image, a
command's start beside an empty Python.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from cpu_time import ended_cpu_s

from device.measurement.quantities import Inclusion
from host_tools.forward.plan import model_plan
from host_tools.forward.solve import solve_ramp
from host_tools.scenes.scene import Press, Scene

SCENE, FORCES_N = Scene(Inclusion(10.0, 6.0, 80.0)), (0.15, 0.3, 0.5, 0.8)
ROUNDS = 3
TRACED = """
import numpy as np
from device.simulation.physics.skin import Skin
from host_tools.optics.light_block import LightBlock
from host_tools.optics.traced import TracedFace
from host_tools.optics.tracer import trace
x = np.linspace(-11.0, 11.0, 45)
trace(LightBlock(), TracedFace(x, x, np.zeros((45, 45)), np.zeros((45, 45))), Skin(), rays=2000)
"""


def _image() -> None:
    picture = np.random.default_rng(1).random((492, 768), dtype=np.float32)
    for _ in range(100):
        np.exp(picture).sum()


def _ramp() -> None:
    presses = [Press(force_n=force) for force in FORCES_N]
    solve_ramp(SCENE, presses, model_plan(SCENE.with_press(presses[-1]), tolerance=0.01, strain="finite"))


def _here(work: Callable[[], None], divided_by: int = 1) -> float:
    began = time.process_time()
    work()
    return (time.process_time() - began) / divided_by


def _started(*words: str) -> float:
    return ended_cpu_s(subprocess.Popen([sys.executable, *words], stdout=subprocess.DEVNULL))


def main() -> None:
    """Print the ratios, each the least of some rounds over the least yardstick; exit code 1 when one is missed."""
    _ramp()  # NGSolve is loaded and the levels' tables are read
    _started("-c", TRACED)  # compiled, if it was not
    works: dict[str, tuple[Callable[[], float], Callable[[], float], float]] = {
        "finite strain: four forces with baseline": (lambda: _here(_ramp), lambda: _here(_image, 100), RAMP),
        "host_tools --help": (lambda: _started("-m", "host_tools", "--help"), lambda: _started("-c", "pass"), HELP),
        "a process that traces": (lambda: _started("-c", TRACED), lambda: _started("-c", "import numba"), TRACER),
    }
    missed = 0
    for name, (work, yardstick, bound) in works.items():
        seconds, of_yardstick = np.min([(work(), yardstick()) for _ in range(ROUNDS)], axis=0)
        ratio = seconds / of_yardstick
        missed += ratio > bound
        word = "holds" if ratio <= bound else "MISSED"
        print(f"{name:44} {ratio:10.1f} x of at most {bound:g}   ({seconds:6.2f} s of a processor here) {word}")
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB")
    sys.exit(bool(missed))


RAMP, HELP, TRACER = 16_000.0, 14.0, 4.0
"""At most so many yardsticks: an image of 492 x 768, an empty Python, one that imports numba."""

if __name__ == "__main__":
    main()
