"""The deck says what the scene means, card by card."""

from __future__ import annotations

import pytest

from device.measurement.quantities import Inclusion
from host_tools.scenes.scene import Scene
from host_tools.verification.cross_check.calculix_deck import Elastic, Process, deck, materials
from host_tools.verification.cross_check.revolved_mesh import Sector, axisymmetric, revolve
from host_tools.verification.cross_check.section import Sizes, half_section

SCENE = Scene(Inclusion(10.0, 6.0, 120.0))


def written(*, finite_strain: bool, process: Process | None = None) -> str:
    mesh = revolve(half_section(SCENE, Sizes().refined(0.5)), Sector())
    stuff = materials(SCENE, homogeneous=False)
    return deck(mesh, stuff, [1.0, 2.5], process or Process(), finite_strain=finite_strain)


def test_small_strain_is_one_increment_so_that_contact_points_keep_their_partners() -> None:
    steps = written(finite_strain=False).split("*STEP\n")
    assert len(steps) == 2
    assert steps[1].startswith("*STATIC\n1, 1\n*BOUNDARY\nBACK, 3, 3, -2.5\n*NODE PRINT, NSET=RAY")


def test_finite_strain_presses_in_increments_and_then_pairs_contact_points_anew() -> None:
    text = written(finite_strain=True, process=Process(increment_mm=0.25, repairings=2))
    press = "*STATIC\n0.25, 1.5, 0.00025, 0.25\n*BOUNDARY\nBACK, 3, 3, -2.5\n*NODE PRINT, NSET=RAY, FREQUENCY=0\n"
    settle = "*STATIC\n1, 2, 1e-3, 1\n*BOUNDARY\nBACK, 3, 3, -2.5\n*NODE PRINT, NSET=RAY, FREQUENCY=1000"
    assert text.count("*STEP, NLGEOM") == 4
    assert press in text
    assert settle in text
    assert text.index(press) < text.index(settle)


def test_the_contact_is_frictionless_between_two_surfaces_with_the_penalty_asked_for() -> None:
    text = written(finite_strain=True, process=Process(penalty_kpa_per_mm=5e3))
    assert "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n5000\n" in text
    assert "*CONTACT PAIR, INTERACTION=SLIDING, TYPE=SURFACE TO SURFACE\nSKIN, FACE\n" in text
    assert "*FRICTION" not in text


def test_elements_are_fully_integrated_unless_asked_otherwise() -> None:
    assert "TYPE=C3D20," in written(finite_strain=False)
    assert "TYPE=C3D20R," in written(finite_strain=False, process=Process(reduced_integration=True))


def test_the_neo_hookean_constants_are_those_of_the_same_small_strain_moduli() -> None:
    """E = 5 kPa and nu = 0.25 give mu = 2 and K = 10/3 kPa, so C10 = mu/2 = 1 and D1 = 2/K = 0.6."""
    elastic = Elastic(5.0, 0.25)
    assert elastic.lines(finite_strain=False) == ["*ELASTIC", "5, 0.25"]
    assert elastic.lines(finite_strain=True) == ["*HYPERELASTIC, NEO HOOKE", "1, 0.6"]


def test_homogeneous_fills_the_inclusion_with_tissue_and_leaves_the_rest() -> None:
    inclusion_materials, without = (materials(SCENE, homogeneous=homogeneous) for homogeneous in (False, True))
    assert inclusion_materials["INCLUSION"].youngs_modulus_kpa == 120.0
    assert without["INCLUSION"] == without["TISSUE"] == inclusion_materials["TISSUE"]
    assert [without[f"LAYER{i}"].youngs_modulus_kpa for i in range(3)] == [60.0, 40.0, 20.0]


@pytest.mark.parametrize("finite_strain", [False, True])
def test_no_line_is_longer_than_the_solver_reads(finite_strain: bool) -> None:
    """CalculiX reads lines of up to 1320 characters, and at most 16 entries on a data line."""
    lines = written(finite_strain=finite_strain).splitlines()
    assert max(map(len, lines)) < 200
    assert max(line.count(",") for line in lines) <= 16


def test_axisymmetric_elements_are_held_and_pressed_along_the_second_coordinate() -> None:
    mesh = axisymmetric(half_section(SCENE, Sizes().refined(0.5)))
    stuff = materials(SCENE, homogeneous=False)
    text = deck(mesh, stuff, [1.0], Process(reduced_integration=True), finite_strain=False)
    assert "TYPE=CAX8R," in text
    assert "*BOUNDARY\nBASE, 1, 2\nAXIS, 1, 1\nBACK, 1, 1\n" in text
    assert "*BOUNDARY\nBACK, 2, 2, -1\n" in text
    assert "*TRANSFORM" not in text
