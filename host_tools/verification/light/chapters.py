"""The chapters of the light's verification in the order of docs/optics.md, and what the page says around them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from host_tools.pages.benchmark import Chapter
from host_tools.pages.document import Cover
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
from host_tools.verification.light.verdict import findings

OPENING = (
    "How an image comes about in the probe's block of silicone, in simulation. Light of four LEDs enters through the",
    "side walls and is kept in by total internal reflection. Where skin touches the face closely enough to be in",
    "optical contact, light enters it, is scattered, and some of it comes down to the camera. A ray tracer",
    "(`host_tools/optics/tracer.py`) follows the light; the virtual probe looks it up in a table made from it",
    "(`device/simulation/physics/lookup_optics.py`). **Everything here is simulated**: no image of a real probe was compared.",
    "",
    "What Lee & Won (2013) say about their image, and what the simulated light does:",
    "",
    "| statement | measured here | verdict |",
    "|---|---|---|",
)
LIMITS = (
    "**The law of contact is assumed.** Contact ratio = 1 - exp(-p / p0) with p0 = 2 kPa is a guess of the right "
    "shape: it saturates. Real skin also creeps, sweats and differs from person to person; p0 must be calibrated. "
    "How strongly an inclusion shows, and how much the light falls behind the pressure, follow from it.",
    "**The camera is telecentric**: it looks straight up at every place. A real lens sees the rim of the face at an "
    "angle, and catches mirror images at slopes a little smaller than these.",
    "**The skin has no texture**: no ridges, hairs or pores, no speckle; one albedo, one spread, nothing below.",
    "**The block's construction is ours.** The paper gives neither size nor walls nor the LEDs' place; a square block "
    "of 24 mm, walls that reflect 5 % and LEDs at mid-height are assumed.",
    "**Comparisons of the model with itself** show what the model says, not that it is right. Only the chapters on "
    "angles, on the LEDs' light on paper and on Mitsuba have answers from elsewhere.",
    "**Mitsuba shares the idealisation** (geometric optics, one index, Lambertian skin) and holds only the simpler "
    "scene: no air-coupled LEDs, no skin across an air gap, no spread, no haze.",
    "**Bounds are not predictions.** They mark what would overturn a sentence on this page. That of the index was "
    "widened after a first measurement.",
)


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
    peer = partial(cross_check.chapter, rays, wanted=mitsuba, python=mitsuba_python)
    return {**{name: partial(room.chapter, rays) for name, room in rooms.items()}, "mitsuba": peer}


def cover(rays: int) -> Cover:
    """Return title, verdicts and limits; the verdicts use the scenes of the chapters."""
    return Cover("The light: how the image comes about", (*OPENING, *(f.row() for f in findings(rays))), LIMITS)
