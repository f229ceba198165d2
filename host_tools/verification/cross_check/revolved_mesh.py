"""A half section to the mesh of a whole model: a solid sector, or the half section itself with axisymmetric elements.

A sector has hexahedra C3D20 and wedges C3D15 at the axis; it is narrow by default, not a quarter: a round, centred
scene varies only in r and z, so every element spent around the axis is wasted. Axisymmetric elements CAX8 spend none.
Node and face numbering follow the CalculiX manual, sections "C3D20", "C3D15" and "CAX8".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from device.measurement.arrays import Array
from host_tools.verification.cross_check.blocks import Indices, Mask, QuadSection

ON_AXIS_MM = 1e-7
BORE_MM = 1e-5
"""CalculiX integrates contact wrongly on the collapsed faces of axisymmetric elements at the axis (8 % in w there), so
the axis is a bore of this radius, which may not close.
"""


@dataclass(frozen=True)
class Sector:
    """The slice that is solved: its angle (above 0, at most 90 degrees) and its number of elements around the axis."""

    angle_deg: float = 15.0
    elements: int = 1

    @property
    def per_circle(self) -> float:
        """How many such sectors make the full circle."""
        return 360 / self.angle_deg


class ContactMesh(Protocol):
    """What a deck says of a mesh: nodes (n, 3) in mm, materials by element, and its sets, zero-based.

    Node sets: BACK, BASE, AXIS, RAY (the face from the axis to the rim) and those that `supports` names. Face sets
    FACE and SKIN: pairs of element and face number in CalculiX's own count.
    """

    @property
    def nodes_mm(self) -> Array:
        """Coordinates (n, 3)."""

    @property
    def materials(self) -> tuple[str, ...]:
        """The material of each element."""

    @property
    def node_sets(self) -> dict[str, Indices]:
        """Node sets by name."""

    @property
    def face_sets(self) -> dict[str, list[tuple[int, int]]]:
        """Face sets by name."""

    @property
    def axis(self) -> int:
        """Which coordinate, 0 to 2, runs along the axis of the probe."""

    @property
    def per_circle(self) -> float:
        """How many such bodies make the full circle."""

    def element_blocks(self, *, reduced: bool) -> tuple[tuple[str, Indices], ...]:
        """Return the elements by type, in the order of `materials`; `reduced` integration where there is a choice."""

    def supports(self) -> list[str]:
        """Return the cards that hold base and axis, and the body in its planes of symmetry."""


@dataclass(frozen=True)
class RevolvedMesh:
    """Nodes (n, 3) in mm; elements (m, 20) and (m, 15) with their materials, hexahedra first; sets of nodes and faces.

    Node sets (zero-based): BACK, BASE, AXIS, NEAR and FAR (the sector's two planes), RAY (the face along NEAR, by r).
    Face sets FACE and SKIN: pairs of zero-based element and face number in CalculiX's own count (1 to 6).
    """

    nodes_mm: Array
    hexahedra: Indices
    wedges: Indices
    materials: tuple[str, ...]
    node_sets: dict[str, Indices]
    face_sets: dict[str, list[tuple[int, int]]]
    sector: Sector
    axis = 2

    @property
    def per_circle(self) -> float:
        """How many such sectors make the full circle."""
        return self.sector.per_circle

    def element_blocks(self, *, reduced: bool) -> tuple[tuple[str, Indices], ...]:
        """Return hexahedra and wedges; wedges know no reduced integration."""
        return ("C3D20R" if reduced else "C3D20", self.hexahedra), ("C3D15", self.wedges)

    def supports(self) -> list[str]:
        """Hold base, axis and back; keep the two planes of the sector in their planes. The slab's side is free."""
        angle = np.radians(self.sector.angle_deg)
        c, s = np.cos(angle), np.sin(angle)
        return [
            "*TRANSFORM, NSET=FAR, TYPE=R",
            f"{c:.12g}, {s:.12g}, 0, {-s:.12g}, {c:.12g}, 0",
            "*BOUNDARY",
            "BASE, 1, 3",
            "AXIS, 1, 2",
            "NEAR, 2, 2",
            "FAR, 2, 2",
            "BACK, 1, 2",
        ]


@dataclass(frozen=True)
class AxisymmetricMesh:
    """Nodes (n, 3) as (r, z, 0) in mm; quadrilaterals (m, 8) with their materials, and the sets of `ContactMesh`."""

    nodes_mm: Array
    quadrilaterals: Indices
    materials: tuple[str, ...]
    node_sets: dict[str, Indices]
    face_sets: dict[str, list[tuple[int, int]]]
    axis = 1
    per_circle = 180.0
    """CalculiX solves a wedge of 2 degrees, and its reactions are those of the wedge."""

    def element_blocks(self, *, reduced: bool) -> tuple[tuple[str, Indices], ...]:
        """Return the quadrilaterals."""
        return (("CAX8R" if reduced else "CAX8", self.quadrilaterals),)

    def supports(self) -> list[str]:
        """Hold base, axis and back. The slab's side is free."""
        return ["*BOUNDARY", "BASE, 1, 2", "AXIS, 1, 1", "BACK, 1, 1"]


def axisymmetric(section: QuadSection) -> AxisymmetricMesh:
    """Return the half section as a body of revolution."""
    used, elements = np.unique(section.quadrilaterals, return_inverse=True)
    section = QuadSection(section.points_mm[used], elements.reshape(-1, 8), section.materials)
    r, z = section.points_mm.T
    probe, ids = _of_probe(section), np.arange(len(r))
    ray = np.flatnonzero(probe & (z == 0))
    sets = {"BACK": ids[z == z.max()], "BASE": ids[z == z.min()], "AXIS": ids[r < ON_AXIS_MM]}
    sets["RAY"] = ray[np.argsort(r[ray])]
    faces: dict[str, list[tuple[int, int]]] = {"FACE": [], "SKIN": []}
    for q, side in zip(*np.nonzero((z == 0)[section.quadrilaterals[:, 4:]]), strict=True):
        faces["FACE" if probe[section.quadrilaterals[q, 0]] else "SKIN"].append((int(q), int(side) + 1))
    flat = np.column_stack([np.maximum(r, BORE_MM), z, np.zeros(len(r))])
    return AxisymmetricMesh(flat, section.quadrilaterals, section.materials, sets, faces)


def revolve(section: QuadSection, sector: Sector) -> RevolvedMesh:
    """Revolve the section about the z axis, counter-clockwise from the plane y = 0."""
    at_axis = section.points_mm[:, 0] < ON_AXIS_MM
    ids, nodes_mm = _numbered(section, sector, at_axis)
    quadrilaterals, touches = _axis_edge_last(section.quadrilaterals, at_axis)
    order = np.concatenate([np.flatnonzero(~touches), np.flatnonzero(touches)])
    hexahedra = [_hexahedra(quadrilaterals[~touches], ids, k) for k in range(sector.elements)]
    wedges = [_wedges(quadrilaterals[touches], ids, k) for k in range(sector.elements)]
    solid, slim = int((~touches).sum()), int(touches.sum())
    names = [section.materials[k] for k in order]
    return RevolvedMesh(
        nodes_mm=nodes_mm,
        hexahedra=np.vstack(hexahedra),
        wedges=np.vstack(wedges),
        materials=tuple(names[:solid] * sector.elements + names[solid:] * sector.elements),
        node_sets=_node_sets(section, ids, at_axis),
        face_sets=_face_sets(section, quadrilaterals[order], (solid, slim), sector.elements),
        sector=sector,
    )


def _numbered(section: QuadSection, sector: Sector, at_axis: Mask) -> tuple[Indices, Array]:
    """Return node numbers (points, 2 * elements + 1), -1 where no node is, and the coordinates.

    Only corners of the section have nodes half way around an element; a point on the axis has one node for all angles.
    """
    planes = 2 * sector.elements + 1
    corner = np.zeros(len(at_axis), dtype=bool)
    corner[section.quadrilaterals[:, :4]] = True
    exists = np.ones((len(at_axis), planes), dtype=bool)
    exists[~corner, 1::2] = False
    exists[at_axis, 1:] = False
    ids = np.where(exists, np.cumsum(exists).reshape(exists.shape) - 1, -1)
    ids[at_axis] = ids[at_axis, :1]
    angle = np.radians(np.linspace(0, sector.angle_deg, planes))
    r, z = (np.broadcast_to(section.points_mm[:, k, None], exists.shape) for k in (0, 1))
    return ids, np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1)[exists]


def _axis_edge_last(quadrilaterals: Indices, at_axis: Mask) -> tuple[Indices, Mask]:
    """Turn each quadrilateral that touches the axis until its fourth side lies on it; say which ones do."""
    turned = quadrilaterals.copy()
    touches: Mask = np.any(at_axis[turned[:, 4:]], axis=1)
    for k in np.flatnonzero(touches):
        shift = int(np.flatnonzero(at_axis[turned[k, 4:]])[0]) + 1
        turned[k] = np.concatenate([np.roll(turned[k, :4], -shift), np.roll(turned[k, 4:], -shift)])
    return turned, touches


def _hexahedra(quadrilaterals: Indices, ids: Indices, k: int) -> Indices:
    """Bottom is the later plane, so that a counter-clockwise section gives a positive volume."""
    corners, middles = quadrilaterals[:, :4], quadrilaterals[:, 4:]
    first, half, last = 2 * k, 2 * k + 1, 2 * k + 2
    parts = [(corners, last), (corners, first), (middles, last), (middles, first), (corners, half)]
    return np.hstack([ids[points, plane] for points, plane in parts])


def _wedges(quadrilaterals: Indices, ids: Indices, k: int) -> Indices:
    """Bottom is the lower triangle: a point on the axis, then the outer corner on either plane."""
    A, B, C, D, AB, BC, CD, DA = quadrilaterals.T
    first, half, last = 2 * k, 2 * k + 1, 2 * k + 2
    corners = [(A, first), (B, first), (B, last), (D, first), (C, first), (C, last)]
    triangles = [(AB, first), (B, half), (AB, last), (CD, first), (C, half), (CD, last)]
    uprights = [(DA, first), (BC, first), (BC, last)]
    return np.stack([ids[points, plane] for points, plane in corners + triangles + uprights], axis=-1)


def _node_sets(section: QuadSection, ids: Indices, at_axis: Mask) -> dict[str, Indices]:
    r, z = section.points_mm.T
    probe = _of_probe(section)
    back, base = z == z.max(), z == z.min()
    ray = np.flatnonzero(probe & (z == 0))
    return {
        "BACK": _present(ids[back]),
        "BASE": _present(ids[base]),
        "AXIS": _present(ids[at_axis]),
        "NEAR": _present(ids[~at_axis, 0]),
        "FAR": _present(ids[~at_axis, -1]),
        "RAY": ids[ray[np.argsort(r[ray])], 0],
    }


def _of_probe(section: QuadSection) -> Mask:
    """Say which points belong to the probe: those of the layers."""
    of_probe = np.zeros(len(section.points_mm), dtype=bool)
    of_probe[section.quadrilaterals[[name.startswith("LAYER") for name in section.materials]]] = True
    return of_probe


def _present(ids: Indices) -> Indices:
    return np.unique(ids[ids >= 0])


def _face_sets(
    section: QuadSection, quadrilaterals: Indices, counts: tuple[int, int], around: int
) -> dict[str, list[tuple[int, int]]]:
    """Collect the elements' faces at z = 0; quadrilaterals are in element order, `counts` solid ones then slim ones."""
    solid, slim = counts
    probe = _of_probe(section)
    level = section.points_mm[:, 1] == 0
    sets: dict[str, list[tuple[int, int]]] = {"FACE": [], "SKIN": []}
    for q, side in zip(*np.nonzero(level[quadrilaterals[:, 4:]]), strict=True):
        if q < solid:
            start, stride, number = q, solid, side + 3
        else:
            start, stride, number = around * solid + q - solid, slim, {0: 1, 1: 4, 2: 2}[int(side)]
        name = "FACE" if probe[quadrilaterals[q, 0]] else "SKIN"
        sets[name] += [(int(start + k * stride), int(number)) for k in range(around)]
    return sets
