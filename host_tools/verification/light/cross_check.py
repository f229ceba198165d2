"""The same block in another program: Mitsuba 3 against the ray tracer, image against image.

The scene is the one both can hold: LEDs cast into the block, contact as a diffuse reflector of the block's own index,
darkness behind dry places. LEDs and dimple break every symmetry. Source: Mitsuba 3, Jakob et al. (2022).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.simulation.physics.skin import Skin
from host_tools.optics.traced import TracedFace
from host_tools.optics.tracer import trace
from host_tools.pages.benchmark import Benchmark, Chapter, Figure, Table, at_least, at_most, relative
from host_tools.scenes.light_block import LightBlock
from host_tools.verification.cross_check.mitsuba import (
    MitsubaFailed,
    mitsuba_python,
    mitsuba_version,
    render_with_mitsuba,
)
from host_tools.verification.cross_check.mitsuba_scene import MitsubaCamera
from host_tools.verification.light.pictures import LINES, draw_map
from host_tools.verification.light.scenes import FACE_RADIUS_MM, GRID_MM, TOUCHED, bump

TITLE = "Another program: Mitsuba 3"
CLAIM = "Mitsuba follows light from the camera to the LEDs, the tracer from the LEDs to the camera."
SOURCE = "Mitsuba 3, variant scalar_rgb, integrator `path`: another code, another direction, another mesh of the face."
BLOCK = LightBlock(led_coupling="embedded", led_radius_mm=2.0, glass_refractive_index=1.41, glass_thickness_mm=0.0)
SKIN = Skin(refractive_index=BLOCK.refractive_index, spread_mm=0.0)
LED_RATIO = (1.0, 1.0, 1.0, 0.5)
CAMERA = MitsubaCamera(pixels=96)
CELLS = 48
RAYS_PER_SCENE = 4
"""Times as many rays as for other scenes: the noise must not hide a per cent."""
RATIO_BOUND, CORRELATION_BOUND, DIFFERENCE_BOUND = 0.01, 0.99, 0.03


@dataclass(frozen=True)
class ImagePair:
    """Both images [y, x] at 0.5 mm cells, 1/(sr mm2) per unit of LED light, and the noise of each over the peak."""

    x_mm: Array
    ours: Array
    theirs: Array
    our_noise_ratio: float
    their_noise_ratio: float
    version: str

    @property
    def inside(self) -> NDArray[np.bool_]:
        """The cells of the round face: outside it Mitsuba also sees the edges of the LEDs."""
        return np.asarray(np.hypot(self.x_mm[None, :], self.x_mm[:, None]) < FACE_RADIUS_MM)


def scene() -> TracedFace:
    """Return the face both programs get."""
    inclusion = bump(3.0, (2.0, 1.0))
    return TracedFace(
        GRID_MM, GRID_MM, 0.8 * inclusion, np.where(TOUCHED, 0.2 + 0.7 * inclusion, 0.0), skin_behind=False
    )


def measure(python: Path, rays: int, samples: int = 256) -> ImagePair:
    """Trace and render the scene; raises `MitsubaFailed`."""
    rendered = render_with_mitsuba(python, BLOCK, scene(), SKIN, led_ratio=LED_RATIO, camera=CAMERA, samples=samples)
    traced = trace(BLOCK, scene(), SKIN, led_ratio=LED_RATIO, rays=RAYS_PER_SCENE * rays)
    noise = np.sqrt(_binned(rendered.noise**2).mean()) / (CAMERA.pixels / CELLS)
    theirs = _binned(rendered.radiance)
    return ImagePair(
        traced.x_mm, traced.radiance, theirs, traced.noise_ratio, float(noise / traced.radiance.max()), rendered.version
    )


def _binned(pixels: Array) -> Array:
    """Return the means of pixels over cells."""
    step = CAMERA.pixels // CELLS
    return np.asarray(pixels.reshape(CELLS, step, CELLS, step).mean(axis=(1, 3)))


def benchmarks(pair: ImagePair) -> tuple[Benchmark, ...]:
    """Return the tracer against Mitsuba over the round face."""
    ours, theirs = pair.ours[pair.inside], pair.theirs[pair.inside]
    rms = float(np.sqrt(np.mean((ours - theirs) ** 2)) / pair.ours.max())
    correlation = float(np.corrcoef(ours, theirs)[0, 1])
    case = "face, 0.5 mm cells"
    return (
        relative(case, "mean radiance", float(ours.mean()), float(theirs.mean()), RATIO_BOUND),
        at_least(case, "correlation", correlation, CORRELATION_BOUND),
        at_most(case, "rms difference / peak, noise of both included", rms, DIFFERENCE_BOUND),
    )


def _draw(figure: Any, pair: ImagePair) -> None:
    panels = figure.subplots(1, 3, width_ratios=(1, 1, 1.3))
    norm = Normalize(0, 1e5 * float(np.quantile(pair.ours, 0.999)))
    for panel, title, image in ((panels[0], "tracer", pair.ours), (panels[1], "Mitsuba 3", pair.theirs)):
        shown = draw_map(panel, title, 1e5 * image, BLOCK.half_width_mm, norm)
        panel.set_xlabel("x (mm)")
    panels[0].set_ylabel("y (mm)")
    figure.colorbar(shown, ax=panels[:2], shrink=0.6).set_label("10⁻⁵ / (sr mm²) per LED light", fontsize=8)
    band = np.abs(pair.x_mm - 1.0) < 1.0
    panels[2].plot(pair.x_mm, 1e5 * pair.ours[band].mean(axis=0), "-", color=LINES[1], label="tracer")
    panels[2].plot(pair.x_mm, 1e5 * pair.theirs[band].mean(axis=0), ".", color=LINES[2], label="Mitsuba 3")
    panels[2].set_title("profile through the dimple, y = 1 mm", fontsize=9)
    panels[2].set_xlabel("x (mm)")
    panels[2].grid(alpha=0.3)
    panels[2].legend(fontsize=8)


def chapter(rays: int, *, wanted: bool, python: Path | None = None) -> Chapter:
    """Return the chapter; skipped with the reason where it was not asked for or Mitsuba is not installed."""
    chosen = mitsuba_python(python)
    if not wanted:
        return Chapter(TITLE, CLAIM, SOURCE, skipped="not asked for; `host_tools optics verify --mitsuba` measures it")
    if mitsuba_version(chosen) is None:
        missing = "the chosen interpreter has no package mitsuba; `--mitsuba-python` names another"
        return Chapter(TITLE, CLAIM, SOURCE, skipped=missing)
    try:
        pair = measure(chosen, rays)
    except MitsubaFailed as failed:
        return Chapter(TITLE, CLAIM, SOURCE, (at_most("Mitsuba", str(failed), float("nan"), 0.0),))
    noise = (f"{100 * pair.our_noise_ratio:.1f}", f"{100 * pair.their_noise_ratio:.1f}")
    table = Table("Noise of a cell over the brightest one (%)", ("tracer", f"Mitsuba {pair.version}"), (noise,))
    figure = Figure("optics_mitsuba.svg", "The same simulated scene by both programs", lambda c: _draw(c, pair))
    return Chapter(TITLE, CLAIM, SOURCE, benchmarks(pair), (table,), (figure,))
