"""A mesh to the text of a CalculiX input deck: press to each indentation, settle, print.

CalculiX pairs contact points only at the start of an increment, so after a press the tissue has slipped away from its
partners by one increment's slip, an error of first order. In finite strain every press is therefore followed by a
step without motion that pairs anew. Units are mm, kPa and mN. Source: CalculiX CrunchiX 2.20 user's manual.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from host_tools.scenes.scene import Scene
from host_tools.verification.cross_check.revolved_mesh import ContactMesh
from host_tools.verification.cross_check.section import INCLUSION, TISSUE

MOST_INCREMENTS = 1000
OUTPUT = (
    f"*NODE PRINT, NSET=RAY, FREQUENCY={MOST_INCREMENTS}, GLOBAL=YES",
    "U",
    f"*NODE PRINT, NSET=BACK, FREQUENCY={MOST_INCREMENTS}, TOTALS=ONLY, GLOBAL=YES",
    "RF",
)
"""Printed at the end of a step only: the frequency is never reached before."""


@dataclass(frozen=True)
class Process:
    """How the solution is reached. Penalty: 1e4 kPa of pressure per mm of overlap, so 5 kPa overlap by 0.5 um.

    `increment_mm` is the longest load increment and `repairings` the number of motionless ones after each press; both
    serve finite strain only. One repairing leaves 0.1 % on w and force at 1 mm, as measured against three; three are
    safe at 1 mm only, for at 3 mm the second one may not converge.
    """

    penalty_kpa_per_mm: float = 1e4
    increment_mm: float = 0.25
    repairings: int = 1
    reduced_integration: bool = False


@dataclass(frozen=True)
class Elastic:
    """An isotropic material: Young's modulus in kPa and Poisson's ratio."""

    youngs_modulus_kpa: float
    poisson_ratio: float

    def lines(self, *, finite_strain: bool) -> list[str]:
        """Return the material's cards; in finite strain W = mu/2 (J^-2/3 I1 - 3) + K/2 (J - 1)^2."""
        E, nu = self.youngs_modulus_kpa, self.poisson_ratio
        if not finite_strain:
            return ["*ELASTIC", f"{E:.12g}, {nu:.12g}"]
        mu, K = E / (2 * (1 + nu)), E / (3 * (1 - 2 * nu))
        return ["*HYPERELASTIC, NEO HOOKE", f"{mu / 2:.12g}, {2 / K:.12g}"]


def materials(scene: Scene, *, homogeneous: bool) -> dict[str, Elastic]:
    """Return the materials by name; `homogeneous` fills the inclusion with tissue."""
    tissue = Elastic(scene.tissue.youngs_modulus_kpa, scene.tissue.poisson_ratio)
    inclusion = tissue
    if scene.inclusion is not None and not homogeneous:
        inclusion = Elastic(scene.inclusion.youngs_modulus_kpa, scene.tissue.poisson_ratio)
    layers = {
        f"LAYER{i}": Elastic(modulus, scene.waveguide.poisson_ratio)
        for i, modulus in enumerate(scene.waveguide.layer_moduli_kpa)
    }
    return {TISSUE: tissue, INCLUSION: inclusion, **layers}


def deck(
    mesh: ContactMesh,
    stuff: dict[str, Elastic],
    indentations_mm: Sequence[float],
    process: Process,
    *,
    finite_strain: bool,
) -> str:
    """Write the deck for rising indentations, all above 0. In small strain give one: a second would pair anew."""
    lines = [*_mesh_lines(mesh, reduced=process.reduced_integration), *_material_lines(stuff, finite_strain)]
    lines += [*_contact_lines(process), *mesh.supports()]
    axis = mesh.axis + 1
    if not finite_strain:
        return "\n".join([*lines, *_linear_step(axis, indentations_mm[-1])]) + "\n"
    for before_mm, after_mm in pairwise([0.0, *indentations_mm]):
        lines += [*_press_step(axis, before_mm, after_mm, process), *_settle_step(axis, after_mm, process)]
    return "\n".join(lines) + "\n"


def _mesh_lines(mesh: ContactMesh, *, reduced: bool) -> list[str]:
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{i}, {x:.12g}, {y:.12g}, {z:.12g}" for i, (x, y, z) in enumerate(mesh.nodes_mm, start=1)]
    first = 1
    for kind, elements in mesh.element_blocks(reduced=reduced):
        names = np.array(mesh.materials[first - 1 : first - 1 + len(elements)])
        for name in dict.fromkeys(names):
            lines += [f"*ELEMENT, TYPE={kind}, ELSET={name}"]
            for k in np.flatnonzero(names == name):
                lines += _wrapped([first + int(k), *(elements[k] + 1).tolist()])
        first += len(elements)
    for name, nodes in mesh.node_sets.items():
        lines += [f"*NSET, NSET={name}", *(f"{node + 1}," for node in nodes)]
    for name, faces in mesh.face_sets.items():
        lines += [f"*SURFACE, NAME={name}, TYPE=ELEMENT", *(f"{element + 1}, S{face}" for element, face in faces)]
    return lines


def _wrapped(numbers: Iterable[int]) -> list[str]:
    """Break a long list after ten numbers; a comma at the end continues it."""
    words = [str(number) for number in numbers]
    return [", ".join(words[k : k + 10]) + ("," if k + 10 < len(words) else "") for k in range(0, len(words), 10)]


def _material_lines(stuff: dict[str, Elastic], finite_strain: bool) -> list[str]:
    lines = []
    for name, elastic in stuff.items():
        lines += [f"*MATERIAL, NAME={name}", *elastic.lines(finite_strain=finite_strain)]
        lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL={name}"]
    return lines


def _contact_lines(process: Process) -> list[str]:
    # The tissue is the slave. With the face as slave, its corner catches in the tissue element that rises beyond the
    # rim, and the slip under the whole face halves.
    return [
        "*SURFACE INTERACTION, NAME=SLIDING",
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
        f"{process.penalty_kpa_per_mm:g}",
        "*CONTACT PAIR, INTERACTION=SLIDING, TYPE=SURFACE TO SURFACE",
        "SKIN, FACE",
    ]


def _linear_step(axis: int, indentation_mm: float) -> list[str]:
    """Press in a single increment, so that contact points keep the partners of the undeformed bodies."""
    return ["*STEP", "*STATIC", "1, 1", *_back_lines(axis, indentation_mm), *OUTPUT, "*END STEP"]


def _press_step(axis: int, before_mm: float, after_mm: float, process: Process) -> list[str]:
    """Move the back on to the next indentation without printing; step time is indentation in mm."""
    length_mm = after_mm - before_mm
    longest_mm = min(process.increment_mm, length_mm)
    return [
        f"*STEP, NLGEOM, INC={MOST_INCREMENTS}",
        "*STATIC",
        f"{longest_mm:.9g}, {length_mm:.9g}, {longest_mm / 1000:.9g}, {longest_mm:.9g}",
        *_back_lines(axis, after_mm),
        # An output request lives on in later steps until it is withdrawn.
        "*NODE PRINT, NSET=RAY, FREQUENCY=0",
        "*END STEP",
    ]


def _settle_step(axis: int, indentation_mm: float, process: Process) -> list[str]:
    """Hold the back still while contact points are paired anew, once in each increment; print the last."""
    return [
        f"*STEP, NLGEOM, INC={MOST_INCREMENTS}",
        "*STATIC",
        f"1, {process.repairings}, 1e-3, 1",
        *_back_lines(axis, indentation_mm),
        *OUTPUT,
        "*END STEP",
    ]


def _back_lines(axis: int, indentation_mm: float) -> list[str]:
    return ["*BOUNDARY", f"BACK, {axis}, {axis}, {-indentation_mm:.9g}"]
