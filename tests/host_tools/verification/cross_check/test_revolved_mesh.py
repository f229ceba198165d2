"""The mesh for CalculiX fills exactly its bodies, with sound elements. Shape functions: CalculiX manual."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.scenes.scene import Scene
from host_tools.verification.cross_check.revolved_mesh import RevolvedMesh, Sector, revolve
from host_tools.verification.cross_check.section import Sizes, half_section

SCENE = Scene(Inclusion(10.0, 6.0, 100.0))
CORNERS = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
HEXAHEDRON_FACES = {3: (0, 1, 5, 4), 4: (1, 2, 6, 5), 5: (2, 3, 7, 6), 6: (3, 0, 4, 7)}
WEDGE_FACES = {1: (0, 1, 2), 2: (3, 4, 5), 4: (1, 2, 5, 4)}


def hexahedron(x: Array) -> Array:
    """Return the 20 shape functions at x in (-1, 1)^3; nodes are at the corners and the middles of the edges."""
    middles = np.array([(CORNERS[i] + CORNERS[j]) / 2 for i, j in EDGES])
    at_corners = np.prod(1 + CORNERS * x, axis=1) * (CORNERS @ x - 2) / 8
    factors = np.where(middles == 0, 1 - x**2, 1 + middles * x)
    return np.concatenate([at_corners, np.prod(factors, axis=1) / 4])


def wedge(x: Array) -> Array:
    """Return the 15 shape functions at (xi, eta) in the unit triangle and zeta in (-1, 1)."""
    zeta, L = x[2], np.array([1 - x[0] - x[1], x[0], x[1]])
    low, high = (L * (1 + s * zeta) * (2 * L - 2 + s * zeta) / 2 for s in (-1, 1))
    pairs = 2 * L * np.roll(L, -1)
    return np.concatenate([low, high, pairs * (1 - zeta), pairs * (1 + zeta), L * (1 - zeta**2)])


g = np.sqrt(0.6)
LINE = [(-g, 5 / 9), (0.0, 8 / 9), (g, 5 / 9)]
CUBE = [(np.array([x, y, z]), p * q * r) for x, p in LINE for y, q in LINE for z, r in LINE]
TRIANGLE = [(1 / 6, 1 / 6), (2 / 3, 1 / 6), (1 / 6, 2 / 3)]
PRISM = [(np.array([x, y, z]), w / 6) for x, y in TRIANGLE for z, w in LINE]


def jacobians(nodes_mm: Array, shape: Callable[[Array], Array], rule: list[tuple[Array, float]]) -> Array:
    """Return the determinants (elements, points); the derivatives come from a complex step, exact for polynomials."""
    columns = []
    for x, _ in rule:
        gradient = np.stack([shape(x + 1e-30j * axis).imag / 1e-30 for axis in np.eye(3)])
        columns.append(np.linalg.det(np.einsum("dn,enc->edc", gradient, nodes_mm)))
    return np.stack(columns, axis=1)


def volumes_mm3(mesh: RevolvedMesh) -> dict[str, float]:
    """Return the volume of each material over the full circle; fails where an element is turned inside out."""
    parts = []
    for elements, shape, rule in ((mesh.hexahedra, hexahedron, CUBE), (mesh.wedges, wedge, PRISM)):
        determinants = jacobians(mesh.nodes_mm[elements], shape, rule)
        assert determinants.min() > 0
        parts.append(determinants @ np.array([weight for _, weight in rule]))
    materials = np.array(mesh.materials)
    volume = np.concatenate(parts) * mesh.sector.per_circle
    return {str(name): float(volume[materials == name].sum()) for name in np.unique(materials)}


@pytest.mark.parametrize("sector", [Sector(), Sector(90.0, 6)])
def test_every_body_has_its_exact_volume_and_no_element_is_turned_inside_out(sector: Sector) -> None:
    """Cylinders and a sphere; parabolas in place of arcs cost a few parts in 1e5."""
    volumes = volumes_mm3(revolve(half_section(SCENE, Sizes()), sector))
    sphere = np.pi / 6 * 10.0**3
    exact = {f"LAYER{i}": np.pi * 11.0**2 * t for i, t in enumerate((2.0, 3.0, 5.0))}
    exact |= {"INCLUSION": sphere, "TISSUE": np.pi * 60.0**2 * 30.0 - sphere}
    assert volumes == pytest.approx(exact, rel=5e-5)


@pytest.mark.parametrize(("size_mm", "depth_mm"), [(1.0, 12.0), (2.0, 4.0), (15.0, 4.0), (15.0, 12.0)])
def test_the_corners_of_the_papers_box_are_meshed_with_sound_elements(size_mm: float, depth_mm: float) -> None:
    mesh = revolve(half_section(Scene(Inclusion(size_mm, depth_mm, 40.0)), Sizes()), Sector())
    assert volumes_mm3(mesh)["INCLUSION"] == pytest.approx(np.pi / 6 * size_mm**3, rel=1e-4)


def test_nodes_between_inclusion_and_tissue_lie_on_the_sphere_middles_included() -> None:
    section = half_section(SCENE, Sizes())
    inside, outside = (
        set(section.quadrilaterals[[name == wanted for name in section.materials]].ravel())
        for wanted in ("INCLUSION", "TISSUE")
    )
    on_sphere = section.points_mm[sorted(inside & outside)]
    assert len(on_sphere) > 40
    assert np.hypot(on_sphere[:, 0], on_sphere[:, 1] + 11.0) == pytest.approx(5.0, abs=1e-7)


def test_probe_and_tissue_touch_without_sharing_a_node() -> None:
    section = half_section(SCENE, Sizes())
    of_probe = np.array([name.startswith("LAYER") for name in section.materials])
    probe, tissue = section.quadrilaterals[of_probe], section.quadrilaterals[~of_probe]
    assert not set(probe.ravel()) & set(tissue.ravel())
    assert section.points_mm[probe.ravel(), 1].min() == 0 == section.points_mm[tissue.ravel(), 1].max()


def test_the_contact_faces_named_to_the_solver_lie_in_the_plane_of_contact() -> None:
    mesh = revolve(half_section(SCENE, Sizes()), Sector(30.0, 2))
    widest_mm = {}
    for name, faces in mesh.face_sets.items():
        nodes = []
        for element, face in faces:
            past = element - len(mesh.hexahedra)
            row, table = (mesh.hexahedra[element], HEXAHEDRON_FACES) if past < 0 else (mesh.wedges[past], WEDGE_FACES)
            nodes += list(row[list(table[face])])
        assert np.all(mesh.nodes_mm[nodes, 2] == 0)
        widest_mm[name] = np.hypot(*mesh.nodes_mm[nodes, :2].T).max()
    assert widest_mm == pytest.approx({"FACE": 11.0, "SKIN": 60.0})


def test_the_ray_runs_along_the_face_from_the_axis_to_the_rim() -> None:
    mesh = revolve(half_section(SCENE, Sizes()), Sector())
    ray = mesh.nodes_mm[mesh.node_sets["RAY"]]
    assert (ray[0, 0], ray[-1, 0]) == (0.0, 11.0)
    assert np.all(np.diff(ray[:, 0]) > 0)
    assert np.all(ray[:, 1:] == 0)


def test_a_sphere_wider_than_the_face_can_cover_is_refused() -> None:
    with pytest.raises(InvalidQuantity, match="size_mm is 20.0, but must be at most 19.8 mm"):
        half_section(Scene(Inclusion(20.0, 4.0, 40.0)), Sizes())
