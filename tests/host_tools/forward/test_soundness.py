"""No number leaves the solver that no press could have: each law is broken in turn."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.press_model import PressFailed
from host_tools.forward.solve import solve
from host_tools.forward.soundness import require_sound
from host_tools.scenes.scene import Press, Scene, Waveguide


@pytest.fixture(scope="module")
def sound():
    return solve(Scene(Inclusion(10.0, 6.0, 80.0)))


def _with(solution, **changes):
    return replace(solution, pressed=replace(solution.pressed, **changes))


def test_a_sound_solution_is_returned_as_it_is(sound):
    assert require_sound(sound) is sound


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"indentation_mm": 487.0}, "thickness of 30 mm"),
        ({"force_n": -0.2}, "above 0"),
        ({"contact_force_n": 0.21}, "must carry the same"),
        ({"total_mm3": np.nan}, "not finite"),
        ({"indentation_mm": np.inf}, "not finite"),
    ],
)
def test_what_breaks_a_law_is_refused_by_its_name(sound, changes, words):
    with pytest.raises(PressFailed, match=words):
        require_sound(_with(sound, **changes))


def test_a_face_that_pulls_is_refused(sound):
    pulled = np.where(sound.rays.r_mm < 3.0, -1.0, sound.pressed.p_kpa)
    with pytest.raises(PressFailed, match="pulls"):
        require_sound(_with(sound, p_kpa=pulled))


def test_a_dome_that_touches_over_less_than_can_be_sampled_is_refused():
    with pytest.raises(PressFailed, match="touches over a radius below"):
        solve(Scene(Inclusion(10.0, 6.0, 80.0), Press(indentation_mm=1e-5), Waveguide(dome_mm=1.0)))


def test_a_dome_that_just_touches_has_elements_as_small_as_its_contact():
    """A dome of 60.5 mm radius, 0.01 mm deep: Hertz with the tissue's own modulus, stiffer by layers and lower slab."""
    found = solve(Scene(None, Press(indentation_mm=0.01), Waveguide(dome_mm=1.0)))
    hertz_n = 4 / 3 * 5.0 / (1 - 0.49**2) * 60.5**0.5 * 0.01**1.5 / 1e3
    assert found.force_n == pytest.approx(hertz_n, rel=0.12)
