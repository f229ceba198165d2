"""Skin in contact with the face: what bright means, and what a dimple adds once the contact is given.

Where skin wets the face, light enters it at almost any angle, is scattered, and comes back in all directions, also
into the camera (frustrated total internal reflection). Source: Han, UIST 2005; the law of contact is assumed.
"""

from __future__ import annotations

import numpy as np

from device.simulation.physics.skin import Skin
from host_tools.pages.benchmark import Benchmark, Chapter, Figure, Table, at_least, at_most
from host_tools.verification.light.pictures import draw_maps, draw_profiles
from host_tools.verification.light.scenes import (
    DEPTHS_MM,
    INCLUSION_KPA,
    PRESS_KPA,
    PRESSES,
    centre,
    traced,
    whole_face,
)

SEEN = {
    "flat, untouched": "untouched",
    "dimple 0.8, skin across air": "dimple, skin across air",
    "flat, even press x 1": "flat, even press",
    "dimple 0.8, contact 1": "dimple, complete contact",
    "flat, contact by pressure": "flat, pressure of an inclusion",
    "dimple 0.8, contact by pressure": "dimple, pressure of an inclusion",
}
"""Scenes of the figures with their labels."""
INCLUSION_BOUND, NOT_BRIGHTER, SUBLINEAR_BOUND = 1.05, 1.0, 0.9


def brightening(name: str, reference: str, rays: int) -> float:
    """Return the radiance at the centre of one scene over that of another."""
    return centre(traced(name, rays)) / centre(traced(reference, rays))


def gain_of_doubling(rays: int) -> float:
    """Return by how much the face brightens when the even pressure of a usual press is doubled."""
    return whole_face(traced("flat, even press x 2", rays)) / whole_face(traced("flat, even press x 1", rays))


def benchmarks(rays: int) -> tuple[Benchmark, ...]:
    """Return what contact, dimple and pressure do to the centre."""
    ratio = "radiance at the centre"
    dimples = (
        at_most(
            f"dimple {depth:g} mm / flat, both in complete contact: not brighter",
            ratio,
            brightening(f"dimple {depth:g}, contact 1", "flat, contact 1", rays),
            NOT_BRIGHTER,
        )
        for depth in DEPTHS_MM[1:]
    )
    inclusion = "pressure of an inclusion / even press"
    flat = brightening("flat, contact by pressure", "flat, even press x 1", rays)
    bent = brightening("dimple 0.8, contact by pressure", "flat, even press x 1", rays)
    doubled = gain_of_doubling(rays)
    return (
        *dimples,
        at_least(f"flat, {inclusion}", ratio, flat, INCLUSION_BOUND),
        at_least(f"dimple 0.8 mm, {inclusion}", ratio, bent, INCLUSION_BOUND),
        at_most("twice the pressure gives less than twice the light", "gain / 2", doubled / 2, SUBLINEAR_BOUND),
    )


def _by_pressure(rays: int) -> Table:
    one = whole_face(traced("flat, even press x 1", rays))
    rows = []
    for presses in PRESSES:
        pressure_kpa = PRESS_KPA * presses
        ratio = float(Skin().contact_ratio(np.array(pressure_kpa)))
        light = whole_face(traced(f"flat, even press x {presses:g}", rays)) / one
        rows.append((f"{pressure_kpa:.2f}", f"{ratio:.2f}", f"{light:.2f}", f"{light / presses:.2f}"))
    header = ("pressure (kPa)", "contact ratio", "light of the face", "light per pressure")
    return Table("An even press on a flat face, over that of 1.3 kPa", header, tuple(rows))


def _by_scene(rays: int) -> Table:
    names = ("flat, contact 0.3", "flat, contact 1", *(f"dimple {d:g}, contact 1" for d in DEPTHS_MM))
    names += (
        "flat, even press x 1",
        "flat, contact by pressure",
        *(f"dimple {d:g}, contact by pressure" for d in DEPTHS_MM),
    )
    rows = [(name, f"{centre(traced(name, rays)):.2e}", f"{whole_face(traced(name, rays)):.2e}") for name in names]
    return Table("Radiance, 1/(sr mm2) per unit of LED light", ("scene", "centre", "mean of face"), tuple(rows))


def chapter(rays: int) -> Chapter:
    """Return the chapter."""
    shown = {label: traced(name, rays) for name, label in SEEN.items()}
    maps = Figure(
        "optics_mechanisms.svg",
        "Simulated radiance of six scenes, on one logarithmic scale; dimples are 0.8 mm deep",
        lambda canvas: draw_maps(canvas, shown, columns=3),
        size_in=(8.5, 5.6),
    )
    profiles = Figure(
        "optics_profiles.svg",
        "The same scenes through the middle of the face, mean of a band 2 mm high",
        lambda canvas: draw_profiles(canvas, shown),
    )
    return Chapter(
        "Contact makes the image, pressure its contrast",
        "Skin in contact shines, and pressure brings more of it into contact.",
        "Han, UIST 2005, for the mechanism; the rest is this model compared with itself.",
        benchmarks(rays),
        (_by_scene(rays), _by_pressure(rays)),
        (maps, profiles),
        facts={"inclusion_kpa": INCLUSION_KPA, "press_kpa": PRESS_KPA},
    )
