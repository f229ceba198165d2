"""What the forward model's shortcuts save, each as a ratio of two times of the same minute, with the error it costs.

CalculiX stands twice, with a contact pair: as axisymmetric as ours, which alone is fair (docs/tradeoff.md), and as the
paper's way, a quarter of the body in C3D20 elements (its SOLID95). It is left out where `ccx` is not installed.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from bench_table import WALL, Figure, median_seconds, timed
from joblib import Parallel, delayed

from device.measurement.quantities import Inclusion
from host_tools.forward.face_state import Rays
from host_tools.forward.materials import with_inclusion
from host_tools.forward.plan import GRADED, model_plan
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.forward.solve import solve
from host_tools.forward.tiers import build
from host_tools.scenes.scene import Scene
from host_tools.tradeoff.forward_models import CALCULIX_SIZES as FRONT_SIZES
from host_tools.verification.cross_check.calculix import ccx_available, solve_with_calculix
from host_tools.verification.cross_check.calculix_deck import Process
from host_tools.verification.cross_check.revolved_mesh import Sector
from host_tools.verification.cross_check.section import Sizes

CHAPTER = "forward model"
SCENE = Scene(Inclusion(10.0, 6.0, 80.0))
CALCULIX_SIZES = Sizes(bulk_mm=6.0, rim_mm=0.07, growth=0.6, per_quarter_circle=8.0)
"""The coarsest mesh found whose error is within 0.2 % of w and of the force; even refinement spends more elements."""
QUARTER = Sector(90.0, 6)
"""The quarter model that the paper's SOLID95 elements imply."""
LEAST_RATIO = 4.0
"""Of the comparison that is fair; 7 were measured."""
BATCH = 24
"""Scenes of the two-process race."""


def _one_press() -> tuple[float, float]:
    """Return w in the middle (mm) and force (N) of one press, mesh and all, on elements good to 0.1 %."""
    plan = replace(model_plan(SCENE), grading="coarse")
    meshed, materials = build(SCENE, plan), with_inclusion(SCENE)
    press = LinearPress(meshed.mesh, meshed.symmetry, plan.order)
    sampler = FaceSampler(meshed.mesh, Rays.over(SCENE.waveguide), "axisymmetric")
    face = press.face_state(press.displacement(materials), materials, sampler)
    return float(face.w_mm[0, 0]), face.force_n


def figures() -> Iterator[Figure]:
    """Yield one press by our elements and by CalculiX's, and what a second process saves."""
    yield from _against_calculix()
    yield _two_processes()


def _against_calculix() -> Iterator[Figure]:
    truth = solve(SCENE, replace(model_plan(SCENE), mesh="remeshed", grading=GRADED, order=8))
    exact = truth.w_mm[0], truth.force_n
    ours_s = median_seconds(_one_press, clock=WALL)
    yield timed(CHAPTER, "one press, axisymmetric, good to 0.1 %", _one_press)
    yield from _errors("one press", _one_press(), exact)
    if not ccx_available():  # Debian: calculix-ccx
        return
    for words, sector, sizes, process, least in (
        ("axisymmetric", "axisymmetric", FRONT_SIZES["rim 0.1"], Process(reduced_integration=True), LEAST_RATIO),
        ("quarter", QUARTER, CALCULIX_SIZES, Process(), None),
    ):
        began = time.perf_counter()
        press = solve_with_calculix(SCENE, [1.0], finite_strain=False, sizes=sizes, sector=sector, process=process)[0]
        ratio = (time.perf_counter() - began) / ours_s
        name = f"CalculiX over ours, {words}, {press.elements} elements"
        yield Figure(CHAPTER, name, ratio, "x", least, at_least=True)
        yield from _errors(f"CalculiX, {words}", (press.w_at_mm(0.0), press.force_n), exact)


def _errors(name: str, found: tuple[float, float], exact: tuple[float, float]) -> Iterator[Figure]:
    for quantity, value, true in zip(("w", "the force"), found, exact, strict=True):
        yield Figure(CHAPTER, f"{name}: error of {quantity}", 100 * abs(value / true - 1), "%", bound=0.2)


def _two_processes() -> Figure:
    scenes = [replace(SCENE, inclusion=Inclusion(10.0, 6.0, float(E))) for E in np.linspace(40, 120, BATCH)]

    def race(pool: Parallel) -> float:
        pool(delayed(_force_n)(scene) for scene in scenes[:4])  # workers import and mesh before the clock starts
        began = time.perf_counter()
        pool(delayed(_force_n)(scene) for scene in scenes)
        return time.perf_counter() - began

    with Parallel(n_jobs=1) as alone, Parallel(n_jobs=2) as pair:
        return Figure(CHAPTER, f"one process over two, {BATCH} scenes", race(alone) / race(pair), "x")


def _force_n(scene: Scene) -> float:
    return solve(scene).force_n
