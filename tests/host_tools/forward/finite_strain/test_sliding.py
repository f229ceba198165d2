"""Sliding is a relabelling of the tissue: labels are no physics inside it, and are physics on the face only."""

import pickle

import pytest
from ngsolve import GridFunction, exp, x, y

from device.measurement.quantities import Inclusion
from host_tools.forward.finite_strain.closed_contact import AXIAL, RADIAL
from host_tools.forward.finite_strain.equilibrium_path import EquilibriumPath, PathEnded
from host_tools.forward.finite_strain.newton import NewtonStatus
from host_tools.forward.finite_strain.sliding import SLIP, SlidingContact
from host_tools.forward.materials import baseline, with_inclusion
from host_tools.forward.meshes.mesh import Resolution, axisymmetric_mesh
from host_tools.scenes.scene import Scene

SCENE = Scene(Inclusion(10, 6, 120))


def _contact(order=3, element_mm=1.0):
    size = Resolution(4 * element_mm, 2 * element_mm, element_mm, element_mm, per_inclusion=4, grading=0.6)
    return SlidingContact(axisymmetric_mesh(SCENE, order=order, resolution=size), with_inclusion(SCENE), order)


@pytest.fixture(scope="module")
def pressed():
    path = EquilibriumPath(_contact())
    path.press_to(1.0)
    return path


def _set_slip(contact, slip):
    contact.u.components[SLIP].Set(slip, definedon=contact.mesh.Boundaries("face"))


def test_the_slip_is_what_was_put_on_the_face():
    contact = _contact()
    _set_slip(contact, 0.01 * x)
    assert contact.slip_mm()(contact.mesh(7.0, 1e-9)) == pytest.approx(0.07, rel=1e-9)
    contact.relabel()
    assert contact.slip_mm()(contact.mesh(7.0, 1e-9)) == pytest.approx(0.07, rel=1e-9)


def test_labels_are_spread_without_overshoot_and_spare_inclusion_and_base():
    contact = _contact()
    _set_slip(contact, 0.01 * x)
    assert contact.relabel()
    m, mesh = contact.spread, contact.mesh
    assert all(m(mesh(r, z)) == 0 for r, z in ((3, -11), (4.5, -11), (0, -3), (8, -30)))
    assert 0 < m(mesh(7, -3)) < 0.07
    assert 0 < m(mesh(11.5, -0.01)) < 0.11 * 1.01


def test_labels_out_of_order_are_noticed():
    contact = _contact()
    _set_slip(contact, -0.1 * x**2)
    assert not contact.relabel()


def test_relabelling_moves_the_displacement_along():
    """Where y = 0.9 z and labels move radially, only u_r has to follow: by the change of the label."""
    contact = _contact()
    contact.u.components[AXIAL].Set(-0.1 * y)
    _set_slip(contact, 0.01 * x)
    contact.relabel()
    point = contact.mesh(14.0, -2.0)
    assert contact.u.components[RADIAL](point) == pytest.approx(contact.spread(point), rel=1e-6)
    assert contact.u.components[AXIAL](point) == pytest.approx(0.2, rel=1e-6)


def test_spreading_the_labels_again_does_not_move_the_answer(pressed):
    contact = pressed.contact
    before = pressed.force_n, contact.slip_mm()(contact.mesh(6, 1e-9))
    assert contact.relabel()
    pressed.newton.descend()
    after = pressed.force_n, contact.slip_mm()(contact.mesh(6, 1e-9))
    assert after == pytest.approx(before, rel=1e-5)


def _change_by_other_labels(element_mm):
    """Press 0.5 mm, bulge the labels inside the tissue by 0.5 mm; return the relative change of force and energy."""
    size = Resolution(4 * element_mm, 2 * element_mm, element_mm, element_mm, grading=0.6)
    contact = SlidingContact(axisymmetric_mesh(Scene(), order=3, resolution=size), baseline(Scene()), 3)
    path = EquilibriumPath(contact)
    path.press_to(0.5)
    force, energy = path.force_n, contact.energy.Energy(contact.u.vec)
    bulge = GridFunction(contact.labels)
    bulge.Set(0.075 * x * exp(-((x - 10) ** 2) / 100 - (y + 10) ** 2 / 50) * (y / 10) ** 2 * (1 + y / 30))
    assert bulge(contact.mesh(10, -10)) > 0.49
    contact.spread.vec.data += bulge.vec
    assert path.newton.descend().status is NewtonStatus.CONVERGED
    return abs(path.force_n / force - 1), abs(contact.energy.Energy(contact.u.vec) / energy - 1)


def test_other_labels_inside_change_force_and_energy_only_by_the_error_of_the_mesh():
    coarse, fine = _change_by_other_labels(1.5), _change_by_other_labels(0.75)
    assert max(fine) < 1e-5
    assert min(a / b for a, b in zip(coarse, fine, strict=True)) > 8  # order 3 loses at least h^3


def test_without_the_force_of_the_edge_the_rim_slips_in_proportion_and_more_force_is_needed():
    """To first order in the press the edge's force does nothing: it is of second order."""
    forces, rims = {}, {}
    for edge_force in (True, False):
        contact = SlidingContact(_contact().mesh, with_inclusion(SCENE), 3, edge_force=edge_force)
        path = EquilibriumPath(contact)
        for indentation_mm in (0.01, 1.0):
            path.press_to(indentation_mm)
            forces[edge_force, indentation_mm] = path.force_n
            rims[edge_force, indentation_mm] = contact.slip_mm()(contact.mesh(11.0 - 1e-9, 1e-9))
    assert rims[False, 1.0] == pytest.approx(100 * rims[False, 0.01], rel=1e-9)
    assert rims[True, 1.0] < rims[False, 1.0]
    assert forces[True, 0.01] == pytest.approx(forces[False, 0.01], rel=1e-4)
    assert 1.001 * forces[True, 1.0] < forces[False, 1.0] < 1.02 * forces[True, 1.0]


def test_a_load_out_of_reach_tells_another_process_how_far_the_press_got():
    """Joblib carries errors so; one that could not be carried ended a table with words about pickles."""
    ended = PathEnded("0.55 N are asked for", 4.875, 0.549, "Newton's method: stalled")
    carried = pickle.loads(pickle.dumps(ended))
    assert str(carried) == str(ended)
    assert (carried.reached_mm, carried.reached_n) == (4.875, 0.549)
