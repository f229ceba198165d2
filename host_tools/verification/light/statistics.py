"""How far a traced image can be trusted: energy that adds up, noise that is as large as stated and falls as it should.

Source: the standard error of a mean falls as 1 / sqrt(rays) (Pharr, Jakob & Humphreys, Physically Based Rendering,
3rd ed., section 2.2); a square block with four equal LEDs looks the same after a quarter turn.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.ticker import NullLocator

from host_tools.pages.benchmark import Benchmark, Chapter, Figure, absolute, at_most
from host_tools.verification.light.pictures import LINES
from host_tools.verification.light.scenes import MECHANISMS, traced

SCENE = "flat, even press x 1"
FEWER = (64, 16, 4, 1)
LEDGER_BOUND, ROULETTE_BOUND, ALBEDO_BOUND, RATE_BOUND, NOISE_BOUND = 1e-9, 1e-3, 0.002, 0.05, 0.1


def noise_by_rays(rays: int) -> dict[int, float]:
    """Return the stated noise of a cell by number of rays, over the brightest cell of the image with most rays."""
    peak = traced(SCENE, rays).radiance.max()
    images = {rays // part: traced(SCENE, rays // part) for part in FEWER}
    return {count: float(found.noise_ratio * found.radiance.max() / peak) for count, found in images.items()}


def noise_found(rays: int) -> tuple[float, float]:
    """Return the true over the stated noise: from another seed, and from the image's own quarter turn."""
    one, other = traced(SCENE, rays), traced(SCENE, rays, seed=2)
    stated = np.sqrt(2) * one.noise_ratio * one.radiance.max()
    differences = (one.radiance - other.radiance, one.radiance - np.rot90(one.radiance))
    between_seeds, turned = (float(np.sqrt(np.mean(d**2)) / stated) for d in differences)
    return between_seeds, turned


def benchmarks(rays: int) -> tuple[Benchmark, ...]:
    """Return energy balance, share given back by the skin, rate and size of the noise."""
    images = {name: traced(name, rays) for name in MECHANISMS}
    unbalanced = max(abs(sum(found.ledger.values()) - 1) for found in images.values())
    roulette = max(abs(found.ledger["roulette"] + found.ledger["cut"]) for found in images.values())
    touched = images["flat, contact 1"]
    albedo = touched.reemitted / (touched.reemitted + touched.ledger["skin"])
    noise = noise_by_rays(rays)
    rate = float(np.polyfit(np.log(list(noise)), np.log(list(noise.values())), 1)[0])
    seeds, turned = noise_found(rays)
    stated = "true noise over the stated one"
    return (
        at_most(f"{len(images)} scenes", "energy unaccounted for, per emitted", unbalanced, LEDGER_BOUND),
        at_most(f"{len(images)} scenes", "energy made or lost by ending faint rays", roulette, ROULETTE_BOUND),
        absolute("flat, contact 1", "share of the light in the skin that comes back", albedo, 0.5, ALBEDO_BOUND),
        absolute(SCENE, "power of the rays that the noise goes with", rate, -0.5, RATE_BOUND),
        absolute(f"{SCENE}, two seeds", stated, seeds, 1.0, NOISE_BOUND),
        absolute(f"{SCENE}, against its own quarter turn", stated, turned, 1.0, NOISE_BOUND),
    )


def _draw(figure: Any, rays: int) -> None:
    noise, axes = noise_by_rays(rays), figure.subplots()
    counts = np.array(list(noise), dtype=float)
    axes.loglog(
        counts, 100 * np.array(list(noise.values())), "o", color=LINES[1], label="stated noise of a 0.5 mm cell"
    )
    law = 100 * noise[rays] * np.sqrt(rays / counts)
    axes.loglog(counts, law, "--", color=LINES[0], label="1 / sqrt(rays)")
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_yticks(law, [f"{percent:.2g}" for percent in law])
    axes.set_xlabel("rays")
    axes.set_ylabel("noise (% of the brightest cell)")
    axes.grid(alpha=0.3, which="both")
    axes.legend()


def chapter(rays: int) -> Chapter:
    """Return the chapter."""
    caption = "Noise of a simulated image against the number of rays"
    return Chapter(
        "Energy and noise",
        "All light is accounted for, and the noise that is stated beside an image is the noise it has.",
        "Conservation of energy; the law of large numbers; the block's symmetry.",
        benchmarks(rays),
        figures=(Figure("optics_noise.svg", caption, lambda canvas: _draw(canvas, rays), size_in=(6.0, 3.2)),),
    )
