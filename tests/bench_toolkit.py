"""What a researcher waits for, in processor's time: a ramp of forces with its baseline, and how commands start.

A start is a ratio to that of an interpreter that does as much as nothing, or imports what is not ours.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from functools import partial

from bench_table import Figure, timed
from cpu_time import ended_cpu_s

from device.measurement.quantities import Inclusion
from host_tools.forward.plan import model_plan
from host_tools.forward.solve import solve_ramp
from host_tools.probe_tables.out_of_range_table import (
    ASIDE_POINTS,
    POINTS,
    SIZES_MM,
    SMALLEST_ASIDE_MM,
    _aside,
    _centred,
    axes,
)
from host_tools.scenes.scene import Press, Scene

SCENE, FORCES_N = Scene(Inclusion(10.0, 6.0, 80.0)), (0.15, 0.3, 0.5, 0.8)
CHAPTER = "toolkit"
ROUNDS = 3
TRACED = """
import numpy as np
from device.simulation.physics.skin import Skin
from host_tools.scenes.light_block import LightBlock
from host_tools.optics.traced import TracedFace
from host_tools.optics.tracer import trace
x = np.linspace(-11.0, 11.0, 45)
trace(LightBlock(), TracedFace(x, x, np.zeros((45, 45)), np.zeros((45, 45))), Skin(), rays=2000)
"""


def figures() -> Iterator[Figure]:
    """Yield the ramp and the starts, each the least of some rounds over the least of what it is compared with."""
    yield timed(CHAPTER, "finite strain: four forces with baseline", _ramp, bound=12_000.0, repeats=ROUNDS)
    yield from _wide_table()
    _started_s("-c", TRACED)  # compiled, if it was not
    starts = {
        "host_tools --help": (("-m", "host_tools", "--help"), "pass", 14.0),
        "a process that traces": (("-c", TRACED), "import numba", 4.0),
    }
    for name, (words, other, bound) in starts.items():
        seconds, others_s = (min(times) for times in zip(
            *((_started_s(*words), _started_s("-c", other)) for _ in range(ROUNDS)), strict=True))  # fmt: skip
        yield Figure(CHAPTER, name, seconds / others_s, f'"{other}"', bound, here=f"{seconds:.2f} s here")


def _wide_table() -> Iterator[Figure]:
    """Yield what one inclusion of `table --part wide` takes, in the middle of its axes; how many there are is named."""
    on_axis, beside = axes(POINTS, SIZES_MM[0]), axes(ASIDE_POINTS, SMALLEST_ASIDE_MM)
    for words, of_axes, solve in (("on the axis", on_axis, _centred), ("beside it", beside, _aside)):
        sizes_mm, shares, mismatches = of_axes
        size_mm, share = sizes_mm[len(sizes_mm) // 2], shares[len(shares) // 2]
        name = f"wide table: one of {len(sizes_mm) * len(shares)} inclusions {words}"
        yield timed(CHAPTER, name, partial(solve, size_mm, share, mismatches))


def _ramp() -> None:
    presses = [Press(force_n=force) for force in FORCES_N]
    solve_ramp(SCENE, presses, model_plan(SCENE.with_press(presses[-1]), strain="finite"))


def _started_s(*words: str) -> float:
    return ended_cpu_s(subprocess.Popen([sys.executable, *words], stdout=subprocess.DEVNULL))
