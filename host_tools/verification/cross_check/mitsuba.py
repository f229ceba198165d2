"""A scene to its image by Mitsuba 3, another program that follows light backwards, from the camera to the LEDs.

An optional check of the ray tracer; nothing else needs it. It runs as a separate process of an interpreter of its
own, since it is large and its compiled variants may abort. Source: Jakob et al., Mitsuba 3 renderer, 2022.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from device.simulation.physics.skin import Skin
from host_tools.optics.traced import TracedFace
from host_tools.scenes.light_block import LightBlock
from host_tools.verification.cross_check.mitsuba_scene import MitsubaCamera, write_mitsuba_scene

RENDERER = Path(__file__).with_name("mitsuba_render.py")
INTERPRETER_VARIABLE = "TSIS_MITSUBA_PYTHON"
VARIANT = "scalar_rgb"
"""It needs no LLVM: with one older than 15.0 the compiled variants end the process, and here they are no faster."""


class MitsubaFailed(RuntimeError):  # noqa: N818 - reads as what it says
    """Mitsuba is absent, ran too long, or gave no image; says which, and what to do."""


@dataclass(frozen=True)
class Rendered:
    """An image in 1/(sr mm2) per unit flux of all LEDs; `noise` of each pixel is the standard error of its mean.

    x and y are the centres of its square pixels in mm; arrays are [y, x].
    """

    x_mm: NDArray[np.float64]
    y_mm: NDArray[np.float64]
    radiance: NDArray[np.float64]
    noise: NDArray[np.float64]
    version: str


def mitsuba_python(chosen: Path | None = None) -> Path:
    """Return the interpreter to render with: the chosen one, the environment's, or this one."""
    return chosen or Path(os.environ.get(INTERPRETER_VARIABLE) or sys.executable)


def mitsuba_version(python: Path) -> str | None:
    """Return the version of an interpreter's Mitsuba, such as "3.9.1"; None where there is none."""
    asking = "from importlib.metadata import version; print(version('mitsuba'))"
    try:
        said = subprocess.run([str(python), "-I", "-c", asking], capture_output=True, text=True, timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return said.stdout.strip() if said.returncode == 0 else None


def render_with_mitsuba(
    python: Path,
    block: LightBlock,
    face: TracedFace,
    skin: Skin,
    *,
    led_ratio: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0),
    camera: MitsubaCamera | None = None,
    passes: int = 8,
    samples: int = 256,
    timeout_s: float = 600.0,
) -> Rendered:
    """Render `passes` images of `samples` paths a pixel each, and average them.

    Raises `InvalidQuantity` for a scene that Mitsuba's cannot hold, `MitsubaFailed` when there is no image.
    """
    version = mitsuba_version(python)
    if version is None:
        raise MitsubaFailed(f"{python} has no Mitsuba: install the package mitsuba, or name another interpreter")
    camera = camera or MitsubaCamera()
    with tempfile.TemporaryDirectory(prefix="tsis-mitsuba-") as folder:
        scene = write_mitsuba_scene(Path(folder), block, face, skin, led_ratio=led_ratio, camera=camera)
        images = _run(python, scene, (str(passes), str(samples)), timeout_s)
    pixel_mm = 2 * block.half_width_mm / camera.pixels
    centres_mm = np.asarray((np.arange(camera.pixels) + 0.5) * pixel_mm - block.half_width_mm, dtype=np.float64)
    noise = images.std(axis=0, ddof=1) / np.sqrt(passes) if passes > 1 else np.full(images.shape[1:], np.nan)
    return Rendered(centres_mm, centres_mm, images.mean(axis=0), noise, version)


def _run(python: Path, scene: Path, variant_and_rays: tuple[str, str], timeout_s: float) -> NDArray[np.float64]:
    """Return the images [pass, y, x] of a scene."""
    out = scene.with_name("images.npy")
    # Isolated (-I), or `import mitsuba` would find the module beside the renderer.
    command = [str(python), "-I", str(RENDERER), str(scene), str(out), VARIANT, *variant_and_rays]
    try:
        ended = subprocess.run(command, timeout=timeout_s, capture_output=True, text=True)
    except subprocess.TimeoutExpired as error:
        raise MitsubaFailed(f"Mitsuba ran longer than {timeout_s:g} s: allow more time or fewer samples") from error
    if not out.exists():
        said = (ended.stderr.strip().splitlines() or ["no error was reported"])[-1]
        raise MitsubaFailed(f"Mitsuba gave no image (exit code {ended.returncode}, {said}): try the scene by hand")
    return np.asarray(np.load(out), dtype=np.float64)
