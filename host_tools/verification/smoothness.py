"""How smooth the features are in size and depth: what a mesh of fixed topology gains over meshing every scene anew.

The noise of a scan is its largest departure from the polynomial fitted to it, over the feature.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any, Literal

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from host_tools.forward.meshes.morph import DEPTH_RATIO, SIZE_RATIO, smallest_jacobian
from host_tools.forward.plan import model_plan
from host_tools.forward.solve import solve
from host_tools.pages.benchmark import Benchmark, Chapter, Figure, Table, at_least, at_most
from host_tools.scenes.scene import Scene

Meshing = Literal["morphed", "remeshed"]
FEATURES = ("O1", "O2, central", "O3", "force")
NOISE_BOUND = 1e-6
JUMP_BOUND = 1e-3
MIDDLE = Inclusion(10.0, 6.0, 80.0)
REACH_MM, POINTS, DEGREE = 0.2, 17, 5


def features(inclusion: Inclusion, meshing: Meshing) -> Array:
    """Return O1 (mm), central O2 (mm3), O3 (mm2) and force (N) at 1 mm of indentation."""
    scene = Scene(inclusion)
    solution = solve(scene, replace(model_plan(scene), mesh=meshing))
    inclusion_field = solution.inclusion_field
    return np.array(
        [
            inclusion_field.max_deformation_mm,
            inclusion_field.central_deformation_mm3,
            inclusion_field.deformation_area_mm2,
            solution.force_n,
        ]
    )


def scan(quantity: str, meshing: Meshing, points: int = POINTS) -> Array:
    """Return the features [points, 4] over +- 0.2 mm of a size or depth."""
    offsets = REACH_MM * np.linspace(-1, 1, points)
    middle = getattr(MIDDLE, quantity)
    return np.array([features(replace(MIDDLE, **{quantity: middle + float(o)}), meshing) for o in offsets])


def noise(scanned: Array) -> Array:
    """Return the noise [points, 4] of a scan: its departure from a fitted polynomial, over the mean."""
    x = np.linspace(-1, 1, len(scanned))
    fit = np.polynomial.chebyshev.chebval(x, np.polynomial.chebyshev.chebfit(x, scanned, DEGREE))
    return np.asarray((scanned - fit.T) / scanned.mean(axis=0))


Scans = dict[tuple[str, str], Array]


def measurements(points: int = POINTS) -> Scans:
    """Return the noise of both scans on both kinds of mesh."""
    kinds: tuple[Meshing, ...] = ("morphed", "remeshed")
    return {(q, kind): noise(scan(q, kind, points)) for q in ("size_mm", "depth_mm") for kind in kinds}


def noise_benchmarks(found: Scans) -> tuple[Benchmark, ...]:
    """Return the noise on the fixed topology."""
    return tuple(
        at_most(f"fixed topology, {quantity} +- {REACH_MM:g} mm", f"noise of {name} / {name}", value, NOISE_BOUND)
        for (quantity, kind), scanned in found.items()
        if kind == "morphed"
        for name, value in zip(FEATURES, np.abs(scanned).max(axis=0).tolist(), strict=True)
    )


def corners() -> list[Inclusion]:
    """Return the corners of the box that the fixed topology reaches."""
    T = Scene().tissue.thickness_mm
    return [Inclusion(size * T, depth * T, 80.0) for size, depth in product(SIZE_RATIO, DEPTH_RATIO)]


def least_jacobian() -> float:
    """Return the least local volume ratio of the map, over the corners, edges' middles and centre of the box."""
    T = Scene().tissue.thickness_mm
    places = product(np.linspace(*SIZE_RATIO, 3) * T, np.linspace(*DEPTH_RATIO, 3) * T)
    return min(smallest_jacobian(Scene(Inclusion(float(size), float(depth), 80.0))) for size, depth in places)


def jump(inclusion: Inclusion) -> Array:
    """Return by how much [4] the features change, relative, where the fixed topology hands over to remeshing."""
    return np.asarray(features(inclusion, "remeshed") / features(inclusion, "morphed") - 1)


def _figure(found: Scans) -> Figure:
    def draw(figure: Any) -> None:
        scanned = {kind: found["size_mm", kind] for kind in ("remeshed", "morphed")}
        size_mm = MIDDLE.size_mm + REACH_MM * np.linspace(-1, 1, len(scanned["morphed"]))
        axes = figure.subplots()
        for kind, values in scanned.items():
            axes.plot(size_mm, 1e6 * values[:, 0], "o-", label=kind)
        axes.set_xlabel("size (mm)")
        axes.set_ylabel("O1 off its polynomial (millionths)")
        axes.grid(alpha=0.3)
        axes.legend()

    return Figure("verification_smoothness.svg", "Noise of O1 over a fine scan of the size", draw)


def chapter(short: bool) -> Chapter:
    """Return the chapter: fewer points and corners when short."""
    found = measurements(9 if short else POINTS)
    edge = corners()[:1] if short else corners()
    jumps = {str(place.as_tuple()[:2]): jump(place) for place in edge}
    hand_over = tuple(
        at_most(
            f"border of the box, size and depth {where} mm", "largest jump of O1, O2, force", float(value), JUMP_BOUND
        )
        for where, value in ((w, np.abs(j[[0, 1, 3]]).max()) for w, j in jumps.items())
    )
    folding = at_least("whole box", "smallest Jacobian of the map", least_jacobian(), 0.05)
    rows = [(q, kind, *(f"{v:.1e}" for v in np.abs(s).max(axis=0))) for (q, kind), s in found.items()]
    steps = [(where, *(f"{v:+.1e}" for v in j)) for where, j in jumps.items()]
    return Chapter(
        "Smoothness in size and depth",
        f"Scans of {len(found['size_mm', 'morphed'])} points about an inclusion of 10 mm, 6 mm deep; noise is the "
        f"largest departure from a polynomial of degree {DEGREE}.",
        "No reference: this is the forward model against itself.",
        (*noise_benchmarks(found), folding, *hand_over),
        (
            Table("Noise of a scan, relative", ("scan", "mesh", *FEATURES), tuple(rows)),
            Table("Jump at the border: remeshed over morphed - 1", ("size, depth (mm)", *FEATURES), tuple(steps)),
        ),
        (_figure(found),),
    )
