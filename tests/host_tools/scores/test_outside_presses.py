"""What is to be refused: the kinds, how many of each, and that a neighbour does not touch the first inclusion."""

import numpy as np

from host_tools.scores import outside
from host_tools.scores.outside import (
    GAP_MM,
    LARGE_MM,
    ORDINARY,
    PRESSES,
    SHALLOW_MM,
    SKINS_A_SOLUTION,
    SOLVED,
    kinds,
)


def test_a_neighbour_leaves_a_gap_between_the_inclusions():
    rng = np.random.default_rng(3)
    for _ in range(200):
        first = np.array([rng.uniform(5.0, 10.0), 5.0, 80.0])
        beside = outside._beside(first, rng)
        gap_mm = np.hypot(beside.x_mm, beside.y_mm) - (first[0] + beside.size_mm) / 2
        assert GAP_MM[0] <= gap_mm <= GAP_MM[1]


def test_every_kind_is_recorded_as_often_as_it_says_and_as_what_it_is(tables, monkeypatch):
    """Solves and recordings are written down instead of done."""
    solved, recorded = [], []
    monkeypatch.setattr(outside, "in_parallel", lambda work, count, jobs: [work(i) for i in range(count)])
    monkeypatch.setattr(outside, "press_ramps", lambda scene: solved.append(scene) or len(solved))
    monkeypatch.setattr(outside, "recorded_press", lambda *given, **named: recorded.append((given, named)))
    found = kinds(tables, seed=1)
    assert [kind.count for kind in found] == [ORDINARY, PRESSES, PRESSES, PRESSES, *[SOLVED * SKINS_A_SOLUTION] * 2]
    assert found[0].name == "ordinary"
    for kind in found:
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
