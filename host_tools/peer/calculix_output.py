"""The text of a CalculiX .dat file to displacements and total forces, one of each for every printed state.

Reads what `calculix_deck` asks for and nothing else. Node numbers count from one, as in the deck.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

HEADING = re.compile(r"^ *(displacements|total force) \([^)]*\) for set (\w+) and time +(\S+) *$", re.MULTILINE)


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
