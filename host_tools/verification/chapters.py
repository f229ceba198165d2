"""The chapters of the verification by name, in the order of the document.

The last ones take long or judge the model's promises: the ends of every range, and how honest stated errors are.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import host_tools.forward.solve  # noqa: F401 - sets the number of threads before the mesher starts any
from host_tools.pages.benchmark import Chapter, Table, at_most
from host_tools.verification import (
    balance,
    eshelby,
    hayes,
    hertz,
    incompressible,
    mechanics,
    patch,
    rates,
    scene_rates,
    smoothness,
    symmetries,
)

CHAPTERS: dict[str, Callable[[bool], Chapter]] = {
    "patch": patch.chapter,
    "eshelby": eshelby.chapter,
    "hayes": hayes.chapter,
    "hertz": hertz.chapter,
    "rates": rates.chapter,
    "scene_rates": scene_rates.chapter,
    "incompressible": incompressible.chapter,
    "symmetries": symmetries.chapter,
    "balance": balance.chapter,
    "smoothness": smoothness.chapter,
    "calculix": mechanics.chapter,
}
"""Each function takes whether to be short."""


def extremes_chapter() -> Chapter:
    """Return the chapter on scenes at the ends of every range; minutes."""
    from host_tools.verification.extremes import run_extremes

    found = run_extremes()
    rows = [
        (
            case.name,
            case.outcome,
            f"{case.force_n:.4g}",
            f"{case.max_deformation_mm:.3g}",
            f"{case.stated_error:.1e}",
            case.message,
        )
        for case in found
    ]
    failures = sum(not case.passed for case in found)
    return Chapter(
        "Extremes",
        "Scenes at the ends of what can be asked, each in a process of its own: a result whose forces balance, or a "
        "refusal that names the quantity; never a hang, a crash or a number that is none.",
        "No reference.",
        (at_most(f"{len(found)} scenes", "scenes without a result or a named refusal", failures, 0.0),),
        (Table("What became of each", ("scene", "outcome", "force (N)", "O1 (mm)", "stated error", ""), tuple(rows)),),
    )


def effectivity_chapter() -> Chapter:
    """Return the chapter on stated against true errors; many minutes."""
    from host_tools.verification.effectivity import DEPARTED_SCENES, chapter_of, measure_effectivity

    return chapter_of(measure_effectivity(departed_scenes=DEPARTED_SCENES, jobs=-1))


def tolerances_chapter(scenes: int | None = None, seed: int | None = None, keep: Path | None = None) -> Chapter:
    """Return the chapter on tolerances that are asked for, of so many random scenes; a minute a scene.

    A folder to `keep` scenes in lets an interrupted run go on.
    """
    from host_tools.verification.tolerances import SCENES, SEED
    from host_tools.verification.tolerances import tolerances_chapter as measured_chapter

    return measured_chapter(SCENES if scenes is None else scenes, SEED if seed is None else seed, keep=keep)


EXTRA_CHAPTERS: dict[str, Callable[[], Chapter]] = {
    "extremes": extremes_chapter,
    "effectivity": effectivity_chapter,
    "tolerances": tolerances_chapter,
}
