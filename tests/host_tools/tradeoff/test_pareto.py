"""The front of known points, and which of them nobody needs."""

from __future__ import annotations

import math

import pytest
from matplotlib.figure import Figure

from device.measurement.quantities import InvalidQuantity
from host_tools.tradeoff.fronts import Panel, front_figure, front_table
from host_tools.tradeoff.pareto import Choice, beats, front, needless, needless_everywhere

FAST = Choice("fast", "a", 1.0, 8.0)
MIDDLE = Choice("middle", "a", 2.0, 4.0, chosen=True)
NEAR = Choice("near", "a", 2.1, 4.1)
SLOW = Choice("slow", "b", 4.0, 1.0)
WASTEFUL = Choice("wasteful", "b", 8.0, 1.0)
POOR = Choice("poor", "b", 3.0, 5.0)
ALL = (WASTEFUL, POOR, SLOW, NEAR, FAST, MIDDLE)


def test_the_front_is_what_no_other_point_beats_in_both_by_rising_cost() -> None:
    assert front(ALL) == [FAST, MIDDLE, SLOW]


def test_a_point_of_equal_cost_or_equal_error_is_dominated_by_the_better_one() -> None:
    assert front([Choice("dear", "", 2.0, 1.0), Choice("cheap", "", 1.0, 1.0)]) == [Choice("cheap", "", 1.0, 1.0)]
    assert front([Choice("bad", "", 1.0, 2.0), Choice("good", "", 1.0, 1.0)]) == [Choice("good", "", 1.0, 1.0)]
    assert front([FAST, Choice("again", "", FAST.cost, FAST.error)]) == [FAST]
    assert front([]) == []


def test_only_what_is_worse_by_the_margin_is_needless() -> None:
    assert [one.name for one in needless(ALL)] == ["wasteful", "poor"]
    assert not beats(MIDDLE, NEAR)
    assert beats(MIDDLE, NEAR, margin=1.02)
    assert not beats(FAST, FAST, margin=1.01)


def test_a_choice_is_needless_everywhere_only_where_every_panel_that_holds_it_says_so() -> None:
    better_here = Choice("poor", "b", 3.0, 0.5)
    assert needless_everywhere([ALL, (SLOW, better_here)]) == ["wasteful"]
    assert needless_everywhere([ALL, (SLOW,)]) == ["wasteful", "poor"]


@pytest.mark.parametrize(("cost", "error"), [(math.nan, 1.0), (1.0, math.inf), (-1.0, 1.0)])
def test_a_point_that_is_no_number_is_refused_by_name(cost: float, error: float) -> None:
    with pytest.raises(InvalidQuantity, match="of broken is"):
        Choice("broken", "", cost, error)


def test_the_table_says_of_every_point_whether_it_is_on_the_front_near_it_or_beaten() -> None:
    table = front_table("All", [Panel("size", "error (%)", ALL)])
    assert [(row[2], row[5]) for row in table.rows] == [
        ("fast", "front"),
        ("**middle**", "front"),
        ("near", "near"),
        ("poor", "beaten"),
        ("slow", "front"),
        ("wasteful", "beaten"),
    ]


def test_the_figure_has_logarithmic_axes_with_units_the_front_and_the_chosen_point() -> None:
    canvas = Figure()
    front_figure("x.svg", "All", [Panel("size", "error (%)", ALL), Panel("depth", "error (%)", ALL[:2])], 2).draw(
        canvas
    )
    axes = canvas.axes[0]
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time (yardsticks)", "error (%)")
    lines = {line.get_label(): line.get_xydata().tolist() for line in axes.get_lines()}
    assert lines["front"] == [[1.0, 8.0], [2.0, 4.0], [4.0, 1.0]]
    assert lines["chosen"] == [[2.0, 4.0]]
    assert {text.get_text() for text in axes.texts} == {"fast", "middle", "slow"}
