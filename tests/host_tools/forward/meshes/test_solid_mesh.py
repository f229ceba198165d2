"""Meshes of the whole, half and quarter body against the volumes and areas of the drawing; all coarse."""

import math

import numpy as np
import pytest
from ngsolve import BND, CoefficientFunction, Integrate

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.forward.materials import baseline, with_inclusion
from host_tools.forward.meshes.solid_mesh import COARSE, SolidResolution, solid_mesh, solid_symmetry
from host_tools.scenes.scene import Placement, Scene, Tissue, TissueLayer, Waveguide

INCLUSION = Inclusion(10.0, 6.0, 80.0)
SKIN_AND_FAT = (TissueLayer("skin", 1.5, 20.0), TissueLayer("fat", 6.0, 3.0))
OFF_AXIS = Placement(offset_x_mm=6.0)
TALL_AND_WIDE = Placement(width_ratio_x=2.0, width_ratio_y=0.5)
FRACTION = {"quarter": 4, "half": 2, "full": 1}


def drawn(scene, symmetry=None, resolution=COARSE):
    """Volumes (mm3) by material and areas (mm2) by face, times what the symmetry left out."""
    symmetry = symmetry or solid_symmetry(scene)
    mesh = solid_mesh(scene, symmetry=symmetry, order=2, resolution=resolution)
    one, times = CoefficientFunction(1.0), FRACTION[symmetry]
    volumes = {name: times * Integrate(one, mesh, definedon=mesh.Materials(name)) for name in mesh.GetMaterials()}
    areas = {name: times * Integrate(one, mesh, BND, definedon=mesh.Boundaries(name)) for name in mesh.GetBoundaries()}
    return volumes, areas


def ellipsoid_above(scene, depth_mm):
    """Volume of the inclusion above a depth, of a sphere's cap t: pi t2 (a - t/3), stretched sideways."""
    inclusion, place = scene.inclusion, scene.placement
    t = np.clip(depth_mm - inclusion.depth_mm, 0.0, inclusion.size_mm)
    return math.pi * t**2 * (inclusion.size_mm / 2 - t / 3) * place.width_ratio_x * place.width_ratio_y


@pytest.mark.parametrize("symmetry", ["quarter", "half", "full"])
def test_every_part_of_the_body_has_the_volumes_and_areas_of_the_drawing(symmetry):
    volumes, areas = drawn(Scene(INCLUSION), symmetry)
    disc, slab, sphere = math.pi * 11.0**2, math.pi * 60.0**2, math.pi / 6 * 10.0**3
    assert volumes == pytest.approx(
        {
            "layer0": 2 * disc,
            "layer1": 3 * disc,
            "layer2": 5 * disc,
            "tissue0": 30 * slab - sphere,
            "inclusion0": sphere,
        },
        rel=1e-4,
    )
    cut = {name: areas.pop(name) for name in ("plane_x", "plane_y") if name in areas}
    assert areas == pytest.approx(
        {
            "face": disc,
            "back": disc,
            "bond": 2 * disc,
            "base": slab,
            "skin": slab - disc,
            "side": 2 * math.pi * 60.0 * 30.0,
            "wall": 2 * math.pi * 11.0 * 10.0,
            "sphere": math.pi * 10.0**2,
        },
        rel=1e-4,
    )
    plane = 60.0 * 30.0 + 11.0 * 10.0
    expected = {"quarter": {"plane_x": 4 * plane, "plane_y": 4 * plane}, "half": {"plane_y": 4 * plane}, "full": {}}
    assert cut == pytest.approx(expected[symmetry], rel=1e-6)


@pytest.mark.parametrize("symmetry", ["quarter", "half", "full"])
def test_an_ellipsoid_is_bonded_to_the_tissue_whatever_part_of_the_body_is_meshed(symmetry):
    """One surface between both: it lay loose in its hole in a quarter, and halved the inclusion field."""
    volumes, areas = drawn(Scene(INCLUSION, placement=Placement(width_ratio_x=1.5)), symmetry)
    eccentricity = math.sqrt(1 - 1 / 1.5**2)  # of a prolate spheroid: 2 pi a2 (1 + c / (a e) arcsin e)
    surface = 2 * math.pi * 5.0**2 * (1 + 1.5 / eccentricity * math.asin(eccentricity))
    assert areas["sphere"] == pytest.approx(surface, rel=1e-3)
    assert areas["side"] == pytest.approx(2 * math.pi * 60.0 * 30.0, rel=1e-4)
    assert volumes["inclusion0"] == pytest.approx(1.5 * math.pi / 6 * 10.0**3, rel=1e-3)


def test_without_an_inclusion_there_is_no_volume_of_it():
    volumes, areas = drawn(Scene(Inclusion(10.0, 6.0, 5.0)))
    assert set(volumes) == {"layer0", "layer1", "layer2", "tissue0"}
    assert "sphere" not in areas
    assert volumes["tissue0"] == pytest.approx(30 * math.pi * 60.0**2, rel=1e-4)


def test_a_square_face_has_the_area_of_the_square():
    volumes, areas = drawn(Scene(INCLUSION, waveguide=Waveguide(face="square")))
    assert areas["face"] == pytest.approx(22.0**2, rel=1e-6)
    assert areas["wall"] == pytest.approx(4 * 22.0 * 10.0, rel=1e-6)
    assert volumes["layer0"] == pytest.approx(2 * 22.0**2, rel=1e-6)


@pytest.mark.parametrize("placement", [Placement(), OFF_AXIS, TALL_AND_WIDE])
def test_an_inclusion_across_tissue_layers_is_split_at_their_interface(placement):
    scene = Scene(INCLUSION, tissue=Tissue(layers=SKIN_AND_FAT), placement=placement)
    volumes, areas = drawn(scene)
    in_fat, whole = ellipsoid_above(scene, 7.5), ellipsoid_above(scene, 30.0)
    slab = math.pi * 60.0**2
    assert volumes["inclusion1"] == pytest.approx(in_fat, rel=1e-3)
    assert volumes["inclusion2"] == pytest.approx(whole - in_fat, rel=1e-3)
    assert volumes["tissue0"] == pytest.approx(1.5 * slab, rel=1e-4)
    assert volumes["tissue1"] == pytest.approx(6.0 * slab - in_fat, rel=1e-4)
    assert volumes["tissue2"] == pytest.approx(22.5 * slab - whole + in_fat, rel=1e-4)
    assert areas["interface"] == pytest.approx(2 * slab, rel=1e-4)
    assert set(volumes) <= set(with_inclusion(scene).modulus_kpa) == set(baseline(scene).modulus_kpa)


def test_an_inclusion_that_touches_an_interface_lies_whole_in_one_layer():
    scene = Scene(Inclusion(10.0, 7.5, 80.0), tissue=Tissue(layers=SKIN_AND_FAT))
    volumes, _ = drawn(scene)
    assert "inclusion1" not in volumes
    assert volumes["inclusion2"] == pytest.approx(math.pi / 6 * 10.0**3, rel=1e-4)


def test_the_slab_ends_at_its_edge():
    """A circle cut at 15 mm of a radius of 60 mm: its segment beyond is R2 arccos(c/R) - c sqrt(R2 - c2)."""
    scene = Scene(INCLUSION, tissue=Tissue(edge_mm=15.0), placement=Placement(offset_x_mm=3.0))
    volumes, areas = drawn(scene)
    segment = 60.0**2 * math.acos(15.0 / 60.0) - 15.0 * math.sqrt(60.0**2 - 15.0**2)
    assert areas["base"] == pytest.approx(math.pi * 60.0**2 - segment, rel=1e-4)
    assert areas["face"] == pytest.approx(math.pi * 11.0**2, rel=1e-4)
    assert volumes["inclusion0"] == pytest.approx(math.pi / 6 * 10.0**3, rel=1e-3)


def test_a_shallow_wide_inclusion_keeps_its_thin_roof():
    volumes, _ = drawn(Scene(Inclusion(20.0, 0.5, 80.0)))
    assert volumes["inclusion0"] == pytest.approx(math.pi / 6 * 20.0**3, rel=1e-4)


def test_the_same_scene_gives_the_same_mesh():
    first, second = (solid_mesh(Scene(INCLUSION), symmetry="quarter", order=2, resolution=COARSE) for _ in range(2))
    assert [vertex.point for vertex in first.vertices] == [vertex.point for vertex in second.vertices]


def test_layers_around_the_rims_shrink_the_elements_there_and_not_elsewhere():
    plain = SolidResolution(15.0, 3.0, 2.0, 3.0, per_inclusion=6.0, grading=0.6, rim_layers=0)
    tetrahedra, layered = (
        solid_mesh(Scene(INCLUSION), symmetry="quarter", order=2, resolution=resolution)
        for resolution in (plain, COARSE)
    )
    assert tetrahedra.ne < layered.ne < 1.3 * tetrahedra.ne

    def nearest_to_rim_mm(mesh):
        radius = np.array([math.hypot(v.point[0], v.point[1]) for v in mesh.vertices if abs(v.point[2]) < 1e-9])
        off_rim = abs(radius - 11.0)
        return off_rim[off_rim > 1e-6].min()

    assert nearest_to_rim_mm(layered) < 0.3 * nearest_to_rim_mm(tetrahedra)


@pytest.mark.parametrize(
    ("scene", "symmetry"),
    [
        (Scene(INCLUSION), "quarter"),
        (Scene(INCLUSION, placement=TALL_AND_WIDE), "quarter"),
        (Scene(INCLUSION, placement=OFF_AXIS), "half"),
        (Scene(INCLUSION, tissue=Tissue(edge_mm=15.0)), "half"),
        (Scene(INCLUSION, placement=Placement(offset_y_mm=1.0)), "full"),
        (Scene(None, placement=Placement(offset_y_mm=1.0)), "quarter"),
    ],
)
def test_the_symmetry_is_the_largest_that_the_scene_allows(scene, symmetry):
    assert solid_symmetry(scene) == symmetry


@pytest.mark.parametrize(
    ("scene", "symmetry"),
    [
        (Scene(INCLUSION, placement=OFF_AXIS), "quarter"),
        (Scene(INCLUSION, tissue=Tissue(edge_mm=15.0)), "quarter"),
        (Scene(INCLUSION, placement=Placement(offset_y_mm=1.0)), "half"),
    ],
)
def test_a_symmetry_that_the_scene_has_not_is_refused(scene, symmetry):
    with pytest.raises(InvalidQuantity, match="or larger for this scene"):
        solid_mesh(scene, symmetry=symmetry, order=2)


def test_an_element_turned_inside_out_is_refused(monkeypatch):
    """An inclusion a tenth of an element from the slab's edge: its curved side pierces the elements between."""
    monkeypatch.setattr("host_tools.forward.meshes.solid_mesh.ATTEMPTS", 1)
    scene = Scene(INCLUSION, tissue=Tissue(edge_mm=15.0), placement=Placement(offset_x_mm=9.99))
    with pytest.raises(InvalidQuantity, match="inside out"):
        solid_mesh(scene, symmetry="half", order=3, resolution=COARSE)
