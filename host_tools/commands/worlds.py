"""`host_tools worlds`: scenes of probes that differ from what the models believe."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from device.measurement.quantities import Bound, require
from host_tools.commands.output import note


def worlds(
    out: Annotated[Path, typer.Option(help="Folder of the scenario files.")],
    count: Annotated[int, typer.Option(help="How many, up to 99.")] = 20,
    seed: Annotated[int, typer.Option(help="Seed of all tolerances.")] = 1,
) -> None:
    """Write scenes of probes of random tolerances, all of it at once: layers, camera, contact law, LEDs, load cell, and
    what differs between the lesion's press and the reference's.

    The same seed gives the same files. `make run SCENE=FILE` runs one; scores/foreign_probes.py has the tolerances.
    """
    from host_tools.scores.foreign_probes import write_worlds

    require("count", count, Bound(1, 99, "worlds"), "ask for at least one")
    require("seed", seed, Bound(0, 2**63, ""), "give a whole number from 0")
    out.mkdir(parents=True, exist_ok=True)
    written = write_worlds(count, seed, out)
    note.print(f"{written[0]} to {written[-1].name}", soft_wrap=True)
