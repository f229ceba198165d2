"""The reduced basis in Young's modulus against solving every modulus."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from device.measurement.quantities import Inclusion
from host_tools.forward.reduced_basis import ReducedBasis
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_most
from host_tools.scenes.scene import Scene

SCENE = Scene(Inclusion(10.0, 6.0, 80.0))
LOW_KPA, HIGH_KPA = 40.0, 120.0
MODULI_KPA = (40.0, 50.0, 65.0, 80.0, 95.0, 110.0, 120.0)


def _features(solution: Solution) -> tuple[float, ...]:
    return (
        solution.force_n,
        solution.inclusion_field.max_deformation_mm,
        solution.inclusion_field.central_deformation_mm3,
    )


def largest_error(basis: ReducedBasis, moduli_kpa: tuple[float, ...] = MODULI_KPA) -> float:
    """Return the largest relative error of force, O1 and central O2."""
    assert SCENE.inclusion is not None
    scenes = (replace(SCENE, inclusion=replace(SCENE.inclusion, youngs_modulus_kpa=E)) for E in moduli_kpa)
    direct = [_features(solve(scene, basis.plan)) for scene in scenes]
    reduced = [_features(basis.solution(E)) for E in moduli_kpa]
    return float(np.abs(np.divide(reduced, direct) - 1).max())


def benchmarks() -> tuple[Benchmark, ...]:
    """Return the error of the basis as it is used."""
    basis = ReducedBasis(SCENE, LOW_KPA, HIGH_KPA)
    return (at_most(f"{LOW_KPA:g} to {HIGH_KPA:g} kPa", "largest relative error", largest_error(basis), 1e-6),)


def _table() -> Table:
    rows = []
    for snapshots in (2, 3, 4):
        basis = ReducedBasis(SCENE, LOW_KPA, HIGH_KPA, snapshots=snapshots)
        began = time.perf_counter()
        for E in MODULI_KPA:
            basis.face(E)
        seconds = (time.perf_counter() - began) / len(MODULI_KPA)
        rows.append((str(snapshots), f"{largest_error(basis):.1e}", f"{1e3 * seconds:.2f}"))
    return Table("Error and cost by the number of snapshots", ("snapshots", "largest error", "ms a face"), tuple(rows))


def chapter(quick: bool) -> Chapter:
    """Return the chapter: without the table when quick."""
    return Chapter(
        "Reduced basis in Young's modulus",
        "One geometry, any modulus of the inclusion from a few solved ones: force, O1 and central O2 against a direct "
        "solution of each modulus.",
        "Quarteroni, Manzoni & Negri, Reduced Basis Methods for PDEs (2016), chapter 3.",
        benchmarks(),
        () if quick else (_table(),),
    )
