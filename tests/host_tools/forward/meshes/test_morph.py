"""One mesh for the whole training box: it never folds, it is smooth, and it agrees with a mesh made anew."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.meshes.morph import morphed_mesh, reaches, smallest_jacobian
from host_tools.forward.plan import model_plan
from host_tools.forward.solve import solve
from host_tools.scenes.scene import Press, Scene, Tissue


def test_the_map_folds_nowhere_in_the_box():
    for size_mm, depth_mm in product((2.0, 5.0, 9.0, 15.0), (4.0, 8.0, 12.0)):
        assert smallest_jacobian(Scene(Inclusion(size_mm, depth_mm, 80.0))) > 0.08


def test_the_inclusion_is_the_sphere_that_was_asked_for():
    """Volume 4/3 pi a^3 and centre at h + a, by the integral over the deformed mesh."""
    from ngsolve import Integrate, dx, pi, x, y

    mesh = morphed_mesh(Scene(Inclusion(7.0, 5.0, 80.0)), order=3)
    measure = dx("inclusion0")
    volume = Integrate(2 * pi * x * measure, mesh)
    assert volume == pytest.approx(4 / 3 * np.pi * 3.5**3, rel=1e-6)
    assert Integrate(2 * pi * x * y * measure, mesh) / volume == pytest.approx(-8.5, rel=1e-7)
    assert Integrate(2 * pi * x * dx("tissue0|inclusion0"), mesh) == pytest.approx(np.pi * 60**2 * 30, rel=1e-8)


@pytest.mark.parametrize(
    ("truth", "varied"),
    [
        ((10.0, 6.0), 0),
        pytest.param((3.0, 9.0), 0, marks=pytest.mark.long),
        pytest.param((14.8, 4.2), 1, marks=pytest.mark.long),
    ],
)
def test_features_are_smooth_in_size_and_depth_to_a_millionth(truth, varied):
    """Over a fine scan the features leave a polynomial of degree 5 by less than 1e-6; remeshing leaves 1e-5."""
    scan = np.linspace(-0.1, 0.1, 11)
    features = []
    for shift in scan:
        size_mm, depth_mm = (value + shift * (i == varied) for i, value in enumerate(truth))
        solution = solve(Scene(Inclusion(size_mm, depth_mm, 80.0), Press(force_n=0.5)))
        inclusion = solution.inclusion_field
        features.append(
            (
                inclusion.max_deformation_mm,
                inclusion.central_deformation_mm3,
                inclusion.deformation_area_mm2,
                solution.indentation_mm,
            )
        )
    for values in np.array(features).T:
        smooth = np.polynomial.Chebyshev.fit(scan, values, 5)(scan)
        assert np.abs(values - smooth).max() < 1e-6 * abs(values.mean())


def test_a_morphed_and_a_new_mesh_agree():
    scene = Scene(Inclusion(5.0, 9.0, 80.0))
    morphed, remeshed = solve(scene), solve(scene, replace(model_plan(scene), mesh="remeshed"))
    assert morphed.force_n == pytest.approx(remeshed.force_n, rel=3e-4)
    assert morphed.inclusion_field.max_deformation_mm == pytest.approx(
        remeshed.inclusion_field.max_deformation_mm, rel=1e-3
    )


@pytest.mark.parametrize("thickness_mm", [10.0, 40.0])
def test_the_map_scales_with_the_slab(thickness_mm):
    scene = Scene(Inclusion(thickness_mm / 3, thickness_mm / 5, 80.0), tissue=Tissue(thickness_mm=thickness_mm))
    assert reaches(scene)
    assert smallest_jacobian(scene) > 0.08
