"""The mesh of a climb: its rims are as fine as they were asked to be, in every slab."""

import math
from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.plan import GRADED, model_plan
from host_tools.forward.tiers import AXISYMMETRIC_SIZES, build
from host_tools.scenes.scene import Scene, Tissue

SCENES = {
    "slab of 12 mm": Scene(Inclusion(5.0, 3.0, 80.0), tissue=Tissue(thickness_mm=12.0)),
    "slab of 19.2 mm": Scene(Inclusion(9.79, 1.93, 80.0), tissue=Tissue(thickness_mm=19.2)),
    "the default slab": Scene(Inclusion(10.0, 6.0, 80.0)),
    "slab of 40 mm": Scene(Inclusion(10.0, 6.0, 80.0), tissue=Tissue(thickness_mm=40.0)),
    "slab of 42.2 mm": Scene(Inclusion(10.0, 6.0, 80.0), tissue=Tissue(thickness_mm=42.2)),
}


def shortest_edge_mm(mesh, place):
    """Return the length of the shortest edge that ends at a place (r, z)."""
    ends = [[np.array(mesh[vertex].point) for vertex in edge.vertices] for edge in mesh.edges]
    return min(math.dist(a, b) for a, b in ends if min(math.dist(a, place), math.dist(b, place)) < 1e-9)


@pytest.mark.parametrize("name", SCENES)
def test_both_rims_are_as_fine_as_asked(name):
    """A level of ungraded rims made 0.04-0.85 mm of 0.005 mm in three of these slabs, and no word of it."""
    scene = SCENES[name]
    plan = replace(model_plan(scene), mesh="remeshed", grading=GRADED, order=8)
    size, mesh = AXISYMMETRIC_SIZES[plan.grading], build(scene, plan).mesh
    probe = scene.waveguide
    for height_mm, rim_mm in ((0.0, size.contact_rim_mm), (sum(probe.layer_thicknesses_mm), size.back_rim_mm)):
        asked_mm = rim_mm * size.rim_ratio**size.rim_layers
        assert shortest_edge_mm(mesh, (probe.radius_mm, height_mm)) < 2 * asked_mm
