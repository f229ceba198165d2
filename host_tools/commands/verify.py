"""`host_tools verify`: the forward model against known answers, on the screen and in docs/verification.md."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from device.measurement.quantities import InvalidQuantity
from host_tools.commands.measured_chapters import judge, measure_page, repeating
from host_tools.commands.output import Scheduler, require_writable
from host_tools.workers import workers

if TYPE_CHECKING:
    from host_tools.pages.benchmark import Chapter


def verify(
    only: Annotated[list[str] | None, typer.Option(help="A chapter, such as hayes; repeat it for several.")] = None,
    out: Annotated[Path | None, typer.Option(help="Markdown file to write; results and figures go beside it.")] = None,
    short: Annotated[bool, typer.Option(help="Fewer cases, and nothing that takes minutes.")] = False,
    extremes: Annotated[bool, typer.Option(help="Add scenes at the ends of every range.")] = False,
    effectivity: Annotated[bool, typer.Option(help="Add how often stated errors hold the true ones.")] = False,
    tolerances: Annotated[bool, typer.Option(help="Add whether tolerances that are asked for are held.")] = False,
    scenes: Annotated[int | None, typer.Option(min=1, help="How many random scenes of tolerances.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the scenes of tolerances.")] = None,
    keep: Annotated[
        Path | None,
        typer.Option(
            help="Folder that keeps true numbers of the scenes of tolerances, so that an interrupted run goes on. "
            "Empty it when what solves a scene changes; what states errors may."
        ),
    ] = None,
    scheduler: Scheduler = None,
) -> None:
    """Check the forward model against answers known on paper; exit code 1 when one misses its bound.

    A page keeps the chapters that were not measured this time, and says of each how it was measured. It has
    each one as soon as it is measured.
    """
    require_writable(out, (".md",))
    longer = {"extremes": extremes, "effectivity": effectivity, "tolerances": tolerances}
    extra = [name for name, wanted in longer.items() if wanted]
    drawn = {name: value for name, value in (("scenes", scenes), ("seed", seed), ("keep", keep)) if value is not None}
    if drawn and not tolerances and "tolerances" not in (only or []):
        raise InvalidQuantity(f"--{next(iter(drawn))}", drawn, "given with --tolerances", "ask for that chapter")
    chapters = _chapters(only or [], extra, short=short, drawn=drawn)
    given = {"only": only, **longer, "short": short, "scenes": scenes, "seed": seed, "out": out}
    with workers(scheduler):
        measured = measure_page("verification", repeating(verify, given), chapters, out, _order())
    judge(measured)


def _chapters(
    only: list[str], extra: list[str], *, short: bool, drawn: Mapping[str, int | Path]
) -> dict[str, Callable[[], Chapter]]:
    """Return the chapters asked for, all short ones without a name; refuse a name that is none.

    `drawn` is how many scenes of tolerances to draw, by which seed, and where they are kept.
    """
    from host_tools.verification.chapters import CHAPTERS, EXTRA_CHAPTERS

    unknown = [name for name in only if name not in _order()]
    if unknown:
        raise InvalidQuantity("only", ", ".join(unknown), "a chapter", f"choose from {', '.join(_order())}")
    chosen = {name: partial(chapter, short) for name, chapter in CHAPTERS.items() if not only or name in only}
    longer = EXTRA_CHAPTERS | {"tolerances": partial(EXTRA_CHAPTERS["tolerances"], **drawn)}
    return {**chosen, **{name: chapter for name, chapter in longer.items() if name in (*only, *extra)}}


def _order() -> list[str]:
    """Return the chapters in the order of the page."""
    from host_tools.verification.chapters import CHAPTERS, EXTRA_CHAPTERS

    return [*CHAPTERS, *EXTRA_CHAPTERS]
