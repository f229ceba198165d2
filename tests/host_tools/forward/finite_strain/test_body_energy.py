"""The energy summed in NumPy is NGSolve's, to rounding: itself, its gradient and its tangent, with slip and without."""

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.finite_strain.equilibrium_path import EquilibriumPath
from host_tools.forward.finite_strain.sliding import SlidingContact
from host_tools.forward.materials import with_inclusion
from host_tools.forward.meshes.mesh import Resolution, axisymmetric_mesh
from host_tools.scenes.scene import Scene

SCENE = Scene(Inclusion(10.0, 6.0, 80.0))
SIZES = Resolution(bulk_mm=6.0, face_mm=2.0, contact_rim_mm=1.0, back_rim_mm=1.0, per_inclusion=5.0, grading=0.6)
ROUNDING = 1e-11


@pytest.fixture(params=[0.0, 1.0], ids=["at rest", "pressed 1 mm"])
def contact(request):
    """A contact of order 3, with labels spread by its slip when it is pressed."""
    one = SlidingContact(axisymmetric_mesh(SCENE, order=3, resolution=SIZES), with_inclusion(SCENE), 3)
    if request.param:
        EquilibriumPath(one).press_to(request.param)
        assert np.abs(one.spread.vec.FV().NumPy()).max() > 0.01
    return one


def disturbed(contact, ratio):
    """A state near the contact's, in no equilibrium."""
    state = contact.u.vec.Copy()
    numbers = state.FV().NumPy()
    numbers += ratio * np.random.default_rng(1).standard_normal(len(numbers))
    return state


def test_energy_gradient_and_tangent_are_those_of_ngsolve(contact):
    slow, fast, state = contact.energy, contact.fast_energy, disturbed(contact, 1e-3)
    assert fast.Energy(state) == pytest.approx(slow.Energy(state), rel=ROUNDING)
    gradients = [state.CreateVector() for _ in range(2)]
    for form, gradient in zip((slow, fast), gradients, strict=True):
        form.Apply(state, gradient)
        form.AssembleLinearization(state)
    exact, found = (gradient.FV().NumPy() for gradient in gradients)
    assert np.abs(found - exact).max() < ROUNDING * np.abs(exact).max()
    exact, found = (form.mat.AsVector().FV().NumPy() for form in (slow, fast))
    assert np.abs(found - exact).max() < ROUNDING * np.abs(exact).max()


def test_the_energy_of_a_folded_element_is_no_number(contact):
    assert np.isnan(contact.fast_energy.Energy(disturbed(contact, 10.0)))


def test_new_labels_are_seen(contact):
    state = contact.u.vec
    before = contact.fast_energy.Energy(state)
    numbers = contact.spread.vec.FV().NumPy()
    numbers[:] = 1.5 * numbers + 1e-3
    assert contact.fast_energy.Energy(state) != before
    found, exact = contact.fast_energy.Energy(state), contact.energy.Energy(state)
    assert found == pytest.approx(exact, rel=1e-9)  # at rest a small difference of large numbers
