"""A half section to a solid sector: hexahedra C3D20, wedges C3D15 at the axis, and the node and face sets of the model.

The default is a narrow sector, not a quarter: a round, centred scene varies only in r and z, so every element spent
around the axis is wasted. Node and face numbering follow the CalculiX manual, sections "C3D20" and "C3D15".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from device.measurement.arrays import Array
from host_tools.verification.cross_check.blocks import Indices, Mask, QuadSection

ON_AXIS_MM = 1e-7


@dataclass(frozen=True)
class Sector:
    """The slice that is solved: its angle (above 0, at most 90 degrees) and its number of elements around the axis."""

    angle_deg: float = 15.0
    elements: int = 1

    @property
    def per_circle(self) -> float:
        """How many such sectors make the full circle."""
        return 360 / self.angle_deg


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

    @property
    def elements(self) -> int:
        """Number of elements."""
        return len(self.materials)


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
