"""An inclusion under the real press: the forward model's face and pressure, and what each of them does to the image.

The image is corrected as the probe corrects it: divided by that of the same press without the inclusion. The
deformation is given and the pressure taken away, then the other way round. Source: the forward model
(docs/forward_model.md).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.colors import Normalize

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.skin import Skin
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve
from host_tools.optics.traced import Traced, TracedFace
from host_tools.optics.tracer import trace
from host_tools.pages.benchmark import Benchmark, Chapter, Figure, Table, at_least, at_most
from host_tools.scenes.light_block import LightBlock
from host_tools.scenes.scene import Press, Scene
from host_tools.verification.light.pictures import draw_map
from host_tools.verification.light.scenes import GRID_MM, TOUCHED, radii_mm

FORCE_N = 0.5
SCENE = Scene(Inclusion(10.0, 6.0, 80.0)).with_press(Press(force_n=FORCE_N))
CENTRE_MM, RIM_MM = 3.0, 9.0
"""The inclusion's signal is that of the centre; beyond this radius the rim decides."""
SHOWN_MM = (0.0, 3.0, 6.0, 9.0, 10.0)
RAYS_PER_SCENE = 2
"""The signal is a small difference of two images, so these get twice the rays."""
DRY, WET = Skin(), Skin(wet_ratio=1.0)
SIGNAL_BOUND, ALONE_BOUND, WET_BOUND = 0.05, 0.03, 0.03


@dataclass(frozen=True)
class Lit:
    """One cause of an image: whose deformation, whose pressure, which skin."""

    inclusion_bends: bool
    inclusion_presses: bool
    skin: Skin = DRY


CASES = {
    "inclusion": Lit(True, True),
    "deformation of the inclusion, pressure without it": Lit(True, False),
    "pressure of the inclusion, deformation without it": Lit(False, True),
    "inclusion, skin wet all over": Lit(True, True, WET),
}
REFERENCES = {name: replace(case, inclusion_bends=False, inclusion_presses=False) for name, case in CASES.items()}


@lru_cache(maxsize=1)
def solution() -> Solution:
    """Return the press of the default probe with 0.5 N, with and without the inclusion."""
    return solve(SCENE)


@lru_cache(maxsize=16)
def image(case: Lit, rays: int) -> Traced:
    """Return the traced image of one case."""
    found = solution()
    w = found.w_mm if case.inclusion_bends else found.w_baseline_mm
    p = found.p_kpa if case.inclusion_presses else found.p_baseline_kpa
    r_mm = np.hypot(GRID_MM[None, :], GRID_MM[:, None])
    pressure_kpa = np.where(TOUCHED, np.interp(r_mm, found.r_mm[:-1], np.maximum(p[:-1], 0.0)), 0.0)
    contact = np.where(TOUCHED, case.skin.contact_ratio(pressure_kpa), 0.0)
    face = TracedFace(GRID_MM, GRID_MM, np.interp(r_mm, found.r_mm, w), contact)
    return trace(LightBlock(), face, case.skin, rays=RAYS_PER_SCENE * rays)


def corrected(name: str, rays: int) -> Array:
    """Return image / reference - 1 of a case, [ny, nx]; 0 where the reference is dark."""
    pressed, reference = image(CASES[name], rays), image(REFERENCES[name], rays)
    lit = (radii_mm(reference) < RIM_MM + 2) & (reference.radiance > 0)
    return np.where(lit, pressed.radiance / np.where(lit, reference.radiance, 1.0) - 1, 0.0)


def signal(name: str, rays: int) -> float:
    """Return by how much a case changes the light of the centre."""
    pressed, reference = image(CASES[name], rays), image(REFERENCES[name], rays)
    near = radii_mm(reference) < CENTRE_MM
    return float(pressed.radiance[near].sum() / reference.radiance[near].sum() - 1)


def benchmarks(rays: int) -> tuple[Benchmark, ...]:
    """Return what inclusion, its deformation, its pressure and a wet skin do to the centre."""
    inclusion, bending, pressing, wet = CASES
    change = f"change of the light within {CENTRE_MM:g} mm"
    return (
        at_least(inclusion, change, signal(inclusion, rays), SIGNAL_BOUND),
        at_least(pressing, change, signal(pressing, rays), SIGNAL_BOUND),
        at_most(bending, change, signal(bending, rays), ALONE_BOUND),
        at_most(wet, change, signal(wet, rays), WET_BOUND),
    )


def _draw(figure: Any, rays: int) -> None:
    norm, panels = Normalize(-0.3, 0.3), figure.subplots(1, 4, sharex=True, sharey=True)
    titles = ("inclusion", "its deformation alone", "its pressure alone", "inclusion, wet skin")
    for panel, name, title in zip(panels, CASES, titles, strict=True):
        shown = draw_map(panel, title, corrected(name, rays), LightBlock().half_width_mm, norm, "PuOr_r", edge="black")
        panel.set_xlabel("x (mm)")
    panels[0].set_ylabel("y (mm)")
    figure.colorbar(shown, ax=panels, shrink=0.7).set_label("image / reference - 1", fontsize=8)


def _row(found: Solution, k: int) -> tuple[str, ...]:
    bent = (f"{w:.3f}" for w in (found.w_mm[k], found.w_baseline_mm[k]))
    pressed = (f"{p:.2f}" for p in (found.p_kpa[k], found.p_baseline_kpa[k]))
    return f"{found.r_mm[k]:.1f}", *bent, *pressed


def chapter(rays: int) -> Chapter:
    """Return the chapter."""
    found = solution()
    places = np.searchsorted(found.r_mm, SHOWN_MM).tolist()
    header = ("radius (mm)", "w (mm)", "w without inclusion", "p (kPa)", "p without inclusion")
    caption = "Simulated images of an inclusion, each over its own reference without the inclusion"
    return Chapter(
        "An inclusion under the probe's own press",
        "The inclusion's pressure makes the image; its deformation alone makes next to none.",
        "No reference: this model compared with itself.",
        benchmarks(rays),
        (Table("The press, from the forward model", header, tuple(_row(found, k) for k in places)),),
        (Figure("optics_press.svg", caption, lambda canvas: _draw(canvas, rays), size_in=(9.0, 2.8)),),
    )
