"""The chapters of the light's verification by name, each to be measured."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from host_tools.pages.benchmark import Chapter
from host_tools.verification.light import angles as optics_angles
from host_tools.verification.light import construction as optics_construction
from host_tools.verification.light import contact as optics_contact
from host_tools.verification.light import cross_check
from host_tools.verification.light import dimple as optics_dimple
from host_tools.verification.light import lookup as optics_lookup
from host_tools.verification.light import on_paper as optics_on_paper
from host_tools.verification.light import press as optics_press
from host_tools.verification.light import statistics as optics_statistics
from host_tools.verification.light import trapping as optics_trapping


def optics_chapters(
    rays: int, *, mitsuba: bool = False, mitsuba_python: Path | None = None
) -> dict[str, Callable[[], Chapter]]:
    """Return the chapters by name, each to be measured with `rays` a scene."""
    rooms = {
        "angles": optics_angles,
        "on_paper": optics_on_paper,
        "trapping": optics_trapping,
        "dimple": optics_dimple,
        "contact": optics_contact,
        "press": optics_press,
        "construction": optics_construction,
        "statistics": optics_statistics,
        "lookup": optics_lookup,
    }
    rendered = partial(cross_check.chapter, rays, wanted=mitsuba, python=mitsuba_python)
    return {**{name: partial(room.chapter, rays) for name, room in rooms.items()}, "mitsuba": rendered}
