"""The default mesh holds 0.15 % on force, O1 and O2 over the paper's box, against order 7 with layers at the rims."""

from dataclasses import replace

import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.plan import GRADED, model_plan
from host_tools.forward.solve import solve
from host_tools.scenes.scene import Scene


def finest(scene):
    """Solve at order 7 on a mesh with layers around the rims, made anew for the scene."""
    return solve(scene, replace(model_plan(scene), mesh="remeshed", grading=GRADED, order=7))


@pytest.mark.parametrize(
    "truth",
    [
        (10.0, 6.0, 80.0),
        (2.0, 4.0, 80.0),
        *(
            pytest.param(one, marks=pytest.mark.long)
            for one in ((15.0, 12.0, 40.0), (15.0, 4.0, 120.0), (6.0, 9.0, 60.0))
        ),
    ],
)
def test_the_default_mesh_is_accurate(truth):
    scene = Scene(Inclusion(*truth))
    default, fine = solve(scene), finest(scene)
    assert default.force_n == pytest.approx(fine.force_n, rel=1.5e-3)
    assert default.inclusion_field.max_deformation_mm == pytest.approx(
        fine.inclusion_field.max_deformation_mm, rel=1.5e-3
    )
    assert default.inclusion_field.central_deformation_mm3 == pytest.approx(
        fine.inclusion_field.central_deformation_mm3, rel=1.5e-3
    )


def test_the_same_mesh_baseline_keeps_a_tiny_inclusion():
    """An inclusion of half an element, its field a millionth of the press: separate meshes would lose it whole."""
    scene = Scene(Inclusion(0.5, 8.0, 80.0))
    default, fine = solve(scene), finest(scene)
    assert default.inclusion_field.max_deformation_mm == pytest.approx(
        fine.inclusion_field.max_deformation_mm, rel=0.01
    )
