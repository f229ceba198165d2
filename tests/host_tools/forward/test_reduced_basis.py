"""A reduced basis gives what a direct solve gives, at any modulus between its bounds and nowhere else."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.forward.reduced_basis import ReducedBasis
from host_tools.forward.solve import solve
from host_tools.scenes.scene import Placement, Press, Scene, Waveguide

SCENE = Scene(Inclusion(10.0, 6.0, 80.0), Press(indentation_mm=1.0))


@pytest.fixture(scope="module")
def basis():
    return ReducedBasis(SCENE, 40.0, 120.0)


def numbers(solution):
    return np.array([solution.force_n, *asdict(solution.inclusion_field).values(), *asdict(solution.raw).values()])


@pytest.mark.parametrize("modulus_kpa", [40.0, 57.3, 120.0])
def test_four_snapshots_hold_a_millionth_of_every_feature(basis, modulus_kpa):
    direct = solve(replace(SCENE, inclusion=Inclusion(10.0, 6.0, modulus_kpa)))
    np.testing.assert_allclose(numbers(basis.solution(modulus_kpa)), numbers(direct), rtol=1e-6)
    np.testing.assert_allclose(basis.solution(modulus_kpa).p_kpa[:-1], direct.p_kpa[:-1], rtol=1e-6)


def test_the_error_falls_with_every_snapshot():
    """Exponential convergence: from one snapshot more, at least ten times less error."""
    direct = solve(replace(SCENE, inclusion=Inclusion(10.0, 6.0, 57.3))).inclusion_field.max_deformation_mm
    found = [
        ReducedBasis(SCENE, 40.0, 120.0, snapshots=n).solution(57.3).inclusion_field.max_deformation_mm
        for n in (1, 2, 3)
    ]
    errors = np.abs(np.array(found) / direct - 1)
    assert (errors[1:] < errors[:-1] / 10).all()


def test_nine_decades_of_modulus_take_twelve_snapshots():
    wide = ReducedBasis(SCENE, 1e-3, 1e6, snapshots=12)
    for modulus_kpa in (1e-3, 1.0, 1e6):
        direct = solve(replace(SCENE, inclusion=Inclusion(10.0, 6.0, modulus_kpa)))
        assert wide.solution(modulus_kpa).raw.max_deformation_mm == pytest.approx(
            direct.raw.max_deformation_mm, rel=1e-6
        )


def test_the_inclusion_keeps_its_own_poisson_ratio():
    scene = replace(SCENE, placement=Placement(poisson_ratio=0.3))
    direct = solve(scene).inclusion_field.max_deformation_mm
    assert ReducedBasis(scene, 40.0, 120.0).solution(80.0).inclusion_field.max_deformation_mm == pytest.approx(
        direct, rel=1e-6
    )


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: ReducedBasis(Scene(), 40.0, 120.0), "inclusion"),
        (lambda: ReducedBasis(SCENE, 120.0, 40.0), "high_kpa"),
        (lambda: ReducedBasis(replace(SCENE, waveguide=Waveguide(dome_mm=0.5)), 40.0, 120.0), "linear"),
    ],
)
def test_what_is_not_affine_in_the_modulus_is_refused(build, words):
    with pytest.raises(InvalidQuantity, match=words):
        build()


def test_a_modulus_outside_the_bounds_is_refused(basis):
    with pytest.raises(InvalidQuantity, match="wider range"):
        basis.solution(30.0)
