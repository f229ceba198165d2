"""`host_tools optics`: trace the light into the virtual probe's table, and verify what the light does."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from device.measurement.quantities import Bound, InvalidQuantity, require
from host_tools.commands.measured_chapters import measure_chapters, print_chapter, repeating
from host_tools.commands.output import note, progress, require_writable
from host_tools.commands.probe import ProbeOption, own_folder

DEFAULT_RAYS = 2_000_000
MOST_SEED = 2**32 - 1
"""The tracer's generator takes 32 bits of a seed, and leaves out the others without a word."""
RAYS = Bound(100_000, 1e10, "")
"""Of fewer none may reach the window through which an untouched face is seen, and no contrast is known."""
optics = typer.Typer(no_args_is_help=True, help="The light in the block: its table, and its verification.")


@optics.command(epilog="Example: host_tools optics build --out models/simulated_probe")
def build(
    out: Annotated[Path | None, typer.Option(help="Folder of the table; models/simulated_probe unless given.")] = None,
    rays: Annotated[int, typer.Option(help="Rays for the light of one LED; minutes for the default.")] = 100_000_000,
    seed: Annotated[
        int, typer.Option(min=0, max=MOST_SEED, help="Seed of the rays; the same seed gives the same table.")
    ] = 1,
    probe: ProbeOption = None,
) -> None:
    """Trace the light of the block and write the table that the virtual probe's images come from."""
    from host_tools.optics.build_lookup import STEPS, write_light_table
    from host_tools.scenes.probe_file import probe_of

    made_of, folder = probe_of(probe), own_folder(probe, out)
    with progress("parts") as bar:
        task = bar.add_task("", total=len(STEPS))
        write_light_table(
            folder,
            rays=rays,
            seed=seed,
            on_step=lambda step: bar.update(task, completed=STEPS.index(step)),
            probe=made_of,
        )
        bar.update(task, completed=len(STEPS))
    print(f"{folder}: light of {rays} rays.")


@optics.command(epilog="Example: host_tools optics verify --mitsuba --out docs/optics.md")
def verify(
    out: Annotated[Path | None, typer.Option(help="Markdown file to write; results and figures go beside it.")] = None,
    rays: Annotated[int, typer.Option(help="Rays a scene; bounds are meant for 2 million.")] = DEFAULT_RAYS,
    mitsuba: Annotated[bool, typer.Option(help="Compare with Mitsuba 3, where it is installed.")] = False,
    mitsuba_python: Annotated[
        Path | None, typer.Option(help="Interpreter that has Mitsuba; else TSIS_MITSUBA_PYTHON names it.")
    ] = None,
) -> None:
    """Check the light against answers on paper and against Mitsuba 3; exit code 1 when one misses its bound."""
    from host_tools.verification.light.chapters import optics_chapters

    require_writable(out, (".md",))
    require("rays", rays, RAYS, "trace enough rays to see anything")
    if mitsuba_python and not mitsuba:
        raise InvalidQuantity("mitsuba_python", mitsuba_python, "left out without --mitsuba", "add --mitsuba")
    measured = measure_chapters(optics_chapters(rays, mitsuba=mitsuba, mitsuba_python=mitsuba_python))
    failed = sum(print_chapter(timed) for timed in measured.values())
    if out:
        from host_tools.pages.page import Results, write_page
        from host_tools.verification.light.verdict import facts

        command = repeating(verify, {"rays": rays, "mitsuba": mitsuba, "out": out}, of="optics")
        write_page(out, Results("optics", command, measured, facts=facts(rays)))
        note.print(f"{out} written.")
    if failed:
        note.print(f"{failed} benchmarks miss their bound.")
        raise typer.Exit(1)
