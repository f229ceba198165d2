"""What is to be refused: the kinds, how many of each, and that a neighbour does not touch the first inclusion."""

from dataclasses import dataclass

import numpy as np

from host_tools.scores import outside
from host_tools.scores.outside import (
    GAP_MM,
    LARGE_MM,
    ORDINARY,
    ORDINARY_KIND,
    PRESSES,
    SHALLOW_MM,
    SKINS_A_SOLUTION,
    SOLVED,
    SUNK_MM,
    kinds,
)


@dataclass(frozen=True)
class Shot:
    """A frame that says what was under it."""

    role: str
    ramp: int
    depth_mm: float


@dataclass(frozen=True)
class Taken:
    """A recording of such frames."""

    frames: tuple[Shot, ...]


def test_a_neighbour_leaves_a_gap_between_the_inclusions():
    rng = np.random.default_rng(3)
    for _ in range(200):
        first = np.array([rng.uniform(5.0, 10.0), 5.0, 80.0])
        beside = outside.neighbour_beside(first, rng)
        gap_mm = np.hypot(beside.x_mm, beside.y_mm) - (first[0] + beside.size_mm) / 2
        assert GAP_MM[0] <= gap_mm <= GAP_MM[1]


def test_every_kind_is_recorded_as_often_as_it_says_and_as_what_it_is(tables, monkeypatch):
    """Solves and recordings are written down instead of done."""
    solved, recorded = [], []
    monkeypatch.setattr(outside, "in_parallel", lambda work, count, jobs: [work(i) for i in range(count)])
    monkeypatch.setattr(outside, "press_ramps", lambda scene: solved.append(scene) or len(solved))
    monkeypatch.setattr(outside, "recorded_press", lambda *given, **named: recorded.append((given, named)))
    found = kinds(tables, seed=1)
    assert [kind.count for kind in found if "standard" in kind.modes] == [
        ORDINARY, PRESSES, PRESSES, PRESSES, *[SOLVED * SKINS_A_SOLUTION] * 2
    ]  # fmt: skip
    assert [kind.count for kind in found if "precise" in kind.modes] == [ORDINARY, *[PRESSES] * 4]
    assert (found[0].name, found[1].name) == (ORDINARY_KIND, "no inclusion")
    for kind in found:
        if "standard" not in kind.modes:
            continue
        kind.record("standard", 0)
        kind.record("standard", kind.count - 1)
    ordinary, none, two, wet, large, shallow = recorded[::2]
    assert ordinary[0][1][0] >= 2.0
    assert none[0][1][0] == 0.0
    assert two[1]["neighbour"] is not None
    assert wet[1]["wet_ratio"] > 0
    assert LARGE_MM[0] <= large[0][1][0] <= LARGE_MM[1]
    assert SHALLOW_MM[0] <= shallow[0][1][1] <= SHALLOW_MM[1]
    assert len(solved) == 2 * SOLVED


def test_scans_have_further_ramps_and_an_inclusion_that_gives_way_is_deeper_in_them(tables, monkeypatch):
    recorded = []

    def record(tables, parameters, mode, seed, **named):
        recorded.append((parameters, named))
        return Taken((Shot("reference", 0, 0.0), *(Shot("press", ramp, parameters[1]) for ramp in range(3))))

    monkeypatch.setattr(outside, "in_parallel", lambda work, count, jobs: [work(i) for i in range(count)])
    monkeypatch.setattr(outside, "press_ramps", lambda scene: 1)
    monkeypatch.setattr(outside, "recorded_press", record)
    of_scans = [kind for kind in kinds(tables, seed=1) if "precise" in kind.modes]
    given = of_scans[-1].record("precise", 3)
    firm, sunk = (parameters for parameters, _ in recorded)
    assert SUNK_MM[0] <= sunk[1] - firm[1] <= SUNK_MM[1]
    assert [shot.depth_mm for shot in given.frames if shot.role == "press"] == [firm[1], sunk[1], sunk[1]]
    for kind in of_scans:
        recorded.clear()
        kind.record("precise", 3)
        assert all(len(named["further_mm"]) == 4 for _, named in recorded)
