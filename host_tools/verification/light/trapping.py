"""A flat face with nothing on it: how little light leaves, and how much more one sees with skin on it.

Only light scattered by the walls, and below an index of 1.414 a sliver of direct light, meets the face steeply enough
to leave. Source: Snell's law; the rest is a comparison of scenes by the ray tracer.
"""

from __future__ import annotations

from functools import lru_cache

from device.simulation.physics.skin import Skin
from host_tools.optics.traced import Traced
from host_tools.optics.tracer import trace
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least, at_most
from host_tools.scenes.light_block import LightBlock
from host_tools.verification.light.scenes import centre, face, traced, whole_face

WALL_LEAK_BOUND, SLIVER_BOUND, CONTRAST_BOUND = 0.01, 1e-3, 100.0


@lru_cache(maxsize=8)
def with_black_walls(index: float, rays: int) -> Traced:
    """Return an untouched flat face of a block of another index whose walls return nothing."""
    return trace(LightBlock(refractive_index=index, wall_reflectance=0.0), face(dark=True), Skin(), rays=rays)


def contrast(rays: int) -> float:
    """Return how much brighter the centre is with skin in complete contact than with skin across an air gap."""
    return centre(traced("flat, contact 1", rays)) / centre(traced("flat, untouched", rays))


def benchmarks(rays: int) -> tuple[Benchmark, ...]:
    """Return what leaves through an untouched face, and the contrast to a touched one."""
    leaving = "light leaving through the face"
    trapped, sliver = (with_black_walls(index, rays).ledger["through_face"] for index in (1.42, 1.41))
    walls = traced("flat, dark", rays)
    return (
        at_most("index 1.42, black walls: nothing can leave", leaving, trapped, 0.0),
        at_most("index 1.41, black walls: a sliver of 0.34 degrees", leaving, sliver, SLIVER_BOUND),
        at_most("index 1.41, walls reflect 5 %", leaving, walls.ledger["through_face"], WALL_LEAK_BOUND),
        at_most("index 1.41, walls reflect 5 %", "light straight into the aperture", walls.specular_into_aperture, 0.0),
        at_least("skin in complete contact / across air", "radiance at the centre", contrast(rays), CONTRAST_BOUND),
    )


def chapter(rays: int) -> Chapter:
    """Return the chapter."""
    rows = []
    for name in ("flat, dark", "flat, untouched", "flat, contact 0.3", "flat, contact 1"):
        found = traced(name, rays)
        shares = (found.ledger["walls"], found.bottom_loss, found.ledger["through_face"], found.ledger["skin"])
        images = (centre(found), whole_face(found))
        rows.append((name, *(f"{v:.1e}" for v in images), *(f"{v:.4f}" for v in shares), f"{found.hits_per_ray:.2f}"))
    header = ("scene", "centre", "mean of face", "walls", "bottom", "through face", "skin", "meetings with face")
    caption = "Radiance (1/(sr mm2) per unit of LED light), and where the light ended (shares); 'dark': no skin at all"
    return Chapter(
        "Untouched: the light is trapped",
        "A dry flat face lets out nothing that comes straight from an LED behind its window but the sliver below an "
        "index of 1.414.",
        "Snell's law; the rest is this model compared with itself.",
        benchmarks(rays),
        (Table(caption, header, tuple(rows)),),
    )
