"""CalculiX solves scenes whose answers are known, and names its failures."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.scenes.scene import Scene, Tissue, Waveguide
from host_tools.verification.cross_check.calculix import (
    CalculixFailed,
    CalculixSolution,
    ccx_available,
    solve_with_calculix,
)
from host_tools.verification.cross_check.calculix_deck import Process
from host_tools.verification.cross_check.section import Sizes

REFERENCE = Scene(
    Inclusion(10.0, 6.0, 100.0),
    waveguide=Waveguide(layer_thicknesses_mm=(5.0, 3.0, 2.0), layer_moduli_kpa=(20.0, 40.0, 60.0)),
    tissue=Tissue(half_width_mm=40.0),
)
needs_ccx = pytest.mark.skipif(
    not ccx_available() and "TSIS_REQUIRE_PEERS" not in os.environ,  # there its absence is a failure
    reason="CalculiX is absent: install the package calculix-ccx",
)


@needs_ccx
def test_the_reference_problem_is_reproduced_and_scales_with_the_indentation() -> None:
    """Converged by NGSolve at order 6: 3 mm give w(0) = 0.34664 mm and F = 0.56850 N. This mesh has 559 elements."""
    half, full = solve_with_calculix(REFERENCE, [1.5, 3.0], finite_strain=False, timeout_s=120)
    assert full.w_mm[0] == pytest.approx(0.34664, rel=0.005)
    assert full.force_n == pytest.approx(0.56850, rel=0.01)
    assert half.w_mm == pytest.approx(full.w_mm / 2)
    assert half.force_n == pytest.approx(full.force_n / 2)


@needs_ccx
@pytest.mark.parametrize("reduced_integration", [False, True])
def test_axisymmetric_elements_reproduce_it_too(reduced_integration: bool) -> None:
    """The same reference; CalculiX's own wedge has 2 degrees, so a force that is not of the full circle shows."""
    process = Process(reduced_integration=reduced_integration)
    (found,) = solve_with_calculix(REFERENCE, [3.0], finite_strain=False, sector="axisymmetric", process=process)
    assert found.w_mm[0] == pytest.approx(0.34664, rel=0.005)
    assert found.force_n == pytest.approx(0.56850, rel=0.01)
    assert found.w_mm[0] == pytest.approx(found.w_mm[1], rel=0.005)  # also in the element at the axis


@needs_ccx
def test_finite_strain_with_true_sliding_tends_to_small_strain_as_the_press_vanishes() -> None:
    settings = {"refinement": 0.4, "timeout_s": 120.0, "process": Process(repairings=1)}
    (small,) = solve_with_calculix(REFERENCE, [0.01], finite_strain=False, **settings)
    (finite,) = solve_with_calculix(REFERENCE, [0.01], finite_strain=True, **settings)
    assert finite.w_mm == pytest.approx(small.w_mm, rel=1e-3)
    assert finite.force_n == pytest.approx(small.force_n, rel=1e-3)


@needs_ccx
def test_a_run_over_its_time_limit_is_a_failure_that_says_so() -> None:
    with pytest.raises(CalculixFailed, match="longer than 0.01 s: allow more time or lower the refinement"):
        solve_with_calculix(REFERENCE, [1.0], finite_strain=False, timeout_s=0.01)


def test_an_absent_program_is_a_failure_that_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    assert not ccx_available()
    with pytest.raises(CalculixFailed, match="install the package calculix-ccx"):
        solve_with_calculix(REFERENCE, [1.0], finite_strain=False)


@pytest.mark.parametrize(
    ("indentations_mm", "sentence"),
    [([], "at least one value"), ([0.0], "above 0"), ([2.0, 1.0], "strictly rising"), ([31.0], "at most 30 mm")],
)
def test_indentations_that_cannot_be_pressed_are_refused(indentations_mm: list[float], sentence: str) -> None:
    with pytest.raises(InvalidQuantity, match=sentence):
        solve_with_calculix(REFERENCE, indentations_mm, finite_strain=False)


def test_between_nodes_w_follows_the_elements_own_quadratic() -> None:
    r_mm = np.array([0.0, 1.0, 2.0, 2.5, 3.0])
    quadratics = np.where(r_mm <= 2, 1 + r_mm**2, 5 + (r_mm - 2))
    solution = CalculixSolution(1.0, r_mm, quadratics, 0.2, False, 2, 20, 1.0, "2.20")
    assert [solution.w_at_mm(r) for r in (0.0, 0.5, 2.0, 2.9, 3.0)] == pytest.approx([1.0, 1.25, 5.0, 5.9, 6.0])
    with pytest.raises(InvalidQuantity, match="r_mm is 3.1"):
        replace(solution, w_mm=quadratics).w_at_mm(3.1)


def test_twice_the_refinement_halves_every_size() -> None:
    assert Sizes().refined(2.0) == Sizes(2.0, 0.75, 0.25, 0.4, 10.0)
