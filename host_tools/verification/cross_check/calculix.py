"""A scene to its solution by CalculiX (`ccx`), another program with other elements and another contact law.

An optional check of the forward model, started as a separate process; nothing else needs it. In finite strain the
tissue truly slides: contact points are paired anew on the deformed bodies until they no longer move. Finite strain
costs minutes. Source: Dhondt, CalculiX CrunchiX user's manual 2.20; mesh as in Lee & Won, IEEE JBHI 17(2), 2013.

Of the .dat file, what `calculix_deck` asks for is read and nothing else: displacements and total forces of every
printed state. Node numbers count from one, as in the deck.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Bound, InvalidQuantity, require
from host_tools.scenes.scene import Scene
from host_tools.verification.cross_check.calculix_deck import Process, deck, materials
from host_tools.verification.cross_check.revolved_mesh import ContactMesh, Sector, axisymmetric, revolve
from host_tools.verification.cross_check.section import Sizes, half_section

HEADING = re.compile(r"^ *(displacements|total force) \([^)]*\) for set (\w+) and time +(\S+) *$", re.MULTILINE)
PROGRAM = "ccx"
NEWTONS_PER_MN = 1e-3
"""kPa times mm2 is mN."""


class UnreadableOutput(ValueError):  # noqa: N818 - reads as what it says
    """A .dat file that does not hold what the deck asked for."""


@dataclass(frozen=True)
class Printed:
    """One printed state: displacement (x, y, z) in mm by node, and the force (x, y, z) on the back in mN."""

    displacement_mm: dict[int, tuple[float, float, float]]
    force_mn: tuple[float, float, float]


def parse_dat(text: str) -> list[Printed]:
    """Return the printed states in order. Raises `UnreadableOutput` where blocks or numbers are missing."""
    headings = list(HEADING.finditer(text))
    ends = [*(heading.start() for heading in headings[1:]), len(text)]
    blocks = [(heading[1], text[heading.end() : end]) for heading, end in zip(headings, ends, strict=False)]
    names = [name for name, _ in blocks]
    if names != ["displacements", "total force"] * (len(names) // 2):
        raise UnreadableOutput(
            f"the .dat file holds the blocks {names}, but must alternate displacements and total force: "
            "check the deck's *NODE PRINT cards"
        )
    bodies = [body for _, body in blocks]
    return [
        Printed({int(row[0]): _vector(row[1:]) for row in _rows(displacements)}, _vector(_rows(force)[0]))
        for displacements, force in zip(bodies[::2], bodies[1::2], strict=True)
    ]


def _rows(body: str) -> list[list[str]]:
    rows = [line.split() for line in body.splitlines() if line.strip()]
    if not rows:
        raise UnreadableOutput("a block of the .dat file has 0 rows, but must have at least 1: was the run cut short?")
    return rows


def _vector(words: list[str]) -> tuple[float, float, float]:
    if len(words) != 3:
        raise UnreadableOutput(f"a row of the .dat file holds {len(words)} components, but must hold 3: {words}")
    x, y, z = (float(word) for word in words)
    return x, y, z


class CalculixFailed(RuntimeError):  # noqa: N818 - reads as what it says
    """CalculiX is absent, ran too long, or gave no solution; says which, and what to do."""


@dataclass(frozen=True)
class CalculixSolution:
    """One indentation. `w_mm` is the face's vertical displacement relative to the back, at the undeformed `r_mm`.

    The radii are those of the nodes from the axis to the rim: ends and middles of quadratic elements in turn.
    `force_n` is the reaction of the full circle; `seconds` is the time of the whole run, mesh included.
    """

    indentation_mm: float
    r_mm: Array
    w_mm: Array
    force_n: float
    finite_strain: bool
    elements: int
    nodes: int
    seconds: float
    version: str

    def w_at_mm(self, r_mm: float) -> float:
        """Return w at any radius from 0 to the rim, by the element's own quadratic."""
        require("r_mm", r_mm, Bound(0.0, float(self.r_mm[-1]), "mm"), "stay on the face")
        first = min(2 * int(np.searchsorted(self.r_mm[2::2], r_mm)), len(self.r_mm) - 3)
        r, w = self.r_mm[first : first + 3], self.w_mm[first : first + 3]
        return float(np.polyval(np.polyfit(r - r[1], w, 2), r_mm - r[1]))


def ccx_available() -> bool:
    """Return whether the program is on the search path."""
    return shutil.which(PROGRAM) is not None


def solve_with_calculix(
    scene: Scene,
    indentations_mm: Sequence[float],
    *,
    finite_strain: bool,
    homogeneous: bool = False,
    refinement: float = 1.0,
    sizes: Sizes | None = None,
    sector: Sector | Literal["axisymmetric"] | None = None,
    process: Process | None = None,
    threads: int = 1,
    timeout_s: float = 1800.0,
) -> tuple[CalculixSolution, ...]:
    """Press a round, flat, centred probe to each of the rising indentations, in mm.

    `homogeneous` fills the inclusion of the same mesh with tissue, for the inclusion field. `sector` is the slice that
    is solved, a narrow one by default; "axisymmetric" elements need none, and take the least time. Refinements 1, 1.5
    and 2 have about 600, 1200 and 2000 elements and an inclusion field in small strain within 3.3 %, 0.4 % and 0.2 %.
    Raises `InvalidQuantity` for bad input, `CalculixFailed` when there is no solution.
    """
    _require_rising(indentations_mm, scene)
    require("refinement", refinement, Bound(0.2, 20.0, ""), "use 1 for a check and 2 for a reference")
    started = time.monotonic()
    section = half_section(scene, (sizes or Sizes()).refined(refinement))
    mesh: ContactMesh = axisymmetric(section) if sector == "axisymmetric" else revolve(section, sector or Sector())
    # Small strain is linear in the indentation as long as contact points keep their first partners: one step, scaled.
    steps_mm = tuple(indentations_mm) if finite_strain else (indentations_mm[-1],)
    stuff = materials(scene, homogeneous=homogeneous)
    text = deck(mesh, stuff, steps_mm, process or Process(), finite_strain=finite_strain)
    states = _run(text, expected=len(steps_mm), threads=threads, timeout_s=timeout_s)
    if not finite_strain:
        states *= len(indentations_mm)
    seconds, version = time.monotonic() - started, ccx_version()

    def solution(indentation_mm: float, state: Printed) -> CalculixSolution:
        scale = 1.0 if finite_strain else indentation_mm / steps_mm[-1]
        ray = mesh.node_sets["RAY"]
        return CalculixSolution(
            indentation_mm=indentation_mm,
            r_mm=mesh.nodes_mm[ray, 0],
            w_mm=indentation_mm + scale * np.array([state.displacement_mm[int(node) + 1][mesh.axis] for node in ray]),
            force_n=-scale * state.force_mn[mesh.axis] * mesh.per_circle * NEWTONS_PER_MN,
            finite_strain=finite_strain,
            elements=len(mesh.materials),
            nodes=len(mesh.nodes_mm),
            seconds=seconds,
            version=version,
        )

    return tuple(map(solution, indentations_mm, states))


def _require_rising(indentations_mm: Sequence[float], scene: Scene) -> None:
    if not indentations_mm:
        raise InvalidQuantity("indentations_mm", "empty", "at least one value", "ask for an indentation")
    limit_mm = scene.tissue.thickness_mm
    for value in indentations_mm:
        require("indentations_mm", value, Bound(0.0, limit_mm, "mm", low_included=False), "press less deep")
    if any(after <= before for before, after in pairwise(indentations_mm)):
        raise InvalidQuantity("indentations_mm", list(indentations_mm), "strictly rising", "sort the values")


def _run(text: str, *, expected: int, threads: int, timeout_s: float) -> list[Printed]:
    """Run the deck in a temporary folder and return the printed states."""
    if not ccx_available():
        raise CalculixFailed(f"{PROGRAM} is not on the search path: install the package calculix-ccx")
    with tempfile.TemporaryDirectory(prefix="tsis-ccx-") as folder:
        Path(folder, "scene.inp").write_text(text)
        environment = {**os.environ, "OMP_NUM_THREADS": str(threads)}
        try:
            ended = subprocess.run(
                [PROGRAM, "scene"], cwd=folder, env=environment, timeout=timeout_s, capture_output=True, text=True
            )
        except subprocess.TimeoutExpired as error:
            raise CalculixFailed(
                f"{PROGRAM} ran longer than {timeout_s:g} s: allow more time or lower the refinement"
            ) from error
        dat = Path(folder, "scene.dat")
        states = parse_dat(dat.read_text()) if dat.exists() else []
    if len(states) < expected:
        raise CalculixFailed(
            f"{PROGRAM} reached {len(states)} of {expected} indentations ({_complaint(ended.stdout + ended.stderr)}): "
            "use a shorter increment_mm, a larger rim_mm or a smaller indentation"
        )
    return states


def _complaint(log: str) -> str:
    """Return the program's first complaint, which names the cause; later ones only follow from it."""
    found = re.search(r"\*ERROR:? *(.+)", log)
    return found[1].strip() if found else "no error was reported"


def ccx_version() -> str:
    """Return the installed program's version, such as "2.20"; "unknown" when it does not say."""
    said = subprocess.run([PROGRAM, "-v"], capture_output=True, text=True, timeout=30).stdout
    found = re.search(r"Version (\S+)", said)
    return found[1] if found else "unknown"
