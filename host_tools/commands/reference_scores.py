"""What `host_tools evaluate` prints with --noise-free and --posterior: modes standard and precise beside the best.

The chapters are those of `host_tools modes`, on presses of another seed.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.console import Console

from device.measurement.mode import Mode
from device.measurement.profile_model import RAMP_MODES, ProfileModel
from device.measurement.quantities import InvalidQuantity
from device.simulation.virtual_probe import ProbeTables
from host_tools.commands.measured_chapters import measure_chapters, print_chapter, print_tables

if TYPE_CHECKING:
    from host_tools.study.benchmark import Chapter


def print_reference(
    model: Path, table: Path, mode: Mode | None, *, noise_free: bool, posterior: bool, scenes: int | None, seed: int
) -> None:
    """Print the chapters that are asked for, on `scenes` presses or as many as `host_tools modes` takes.

    Both modes unless one is given. Raises `InvalidQuantity` for one that fits no forward model; exits with code 1 when
    a figure misses its bound.
    """
    from host_tools.study.mode_noise_free import PRESSES, noise_free_chapter
    from host_tools.study.mode_posterior import SCENES, posterior_chapter

    modes = _ramp_modes(mode)
    trained, tables = ProfileModel.load(model), ProbeTables.load(table)
    chapters: dict[str, Callable[[], Chapter]] = {}
    if noise_free:
        presses = PRESSES if scenes is None else scenes
        chapters["noise-free"] = lambda: noise_free_chapter(trained.answers, tables, presses=presses, seed=seed)
    if posterior:
        count = SCENES if scenes is None else scenes
        chapters["posterior"] = lambda: posterior_chapter(trained, modes=modes, scenes=count, seed=seed)
    missed, out = 0, Console(width=160, highlight=False)
    for timed in measure_chapters(chapters).values():
        missed += print_chapter(timed)
        out.print(timed.chapter.claim, markup=False)
        print_tables(timed.chapter)
    if missed:
        raise typer.Exit(1)


def _ramp_modes(mode: Mode | None) -> tuple[Mode, ...]:
    if mode is None:
        return RAMP_MODES
    if mode not in RAMP_MODES:
        raise InvalidQuantity("mode", mode, " or ".join(RAMP_MODES), "only they have a forward model to compare with")
    return (mode,)
