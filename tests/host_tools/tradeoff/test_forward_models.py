"""The front of the forward models: levels that commands choose, timed with and without their stated error."""

import os

import pytest

from host_tools.forward.ladder import FINITE_RUNGS
from host_tools.forward.plan import BLUNT, GRADED, STANDARD
from host_tools.tradeoff.forward_models import (
    CALCULIX,
    FULL,
    SHORT,
    STATING,
    WITHOUT,
    calculix_choices,
    cases,
    equal_errors,
    measured,
)
from host_tools.tradeoff.fronts import Panel
from host_tools.tradeoff.pareto import Choice
from host_tools.verification.cross_check.calculix import ccx_available
from host_tools.verification.truths import true_numbers


def test_every_level_is_one_that_a_command_can_choose():
    for case in cases():
        for strain, level in case.levels:
            climbed = level in FINITE_RUNGS if strain == "finite" else level.grading == GRADED
            assert climbed or level in (STANDARD, BLUNT)
            assert level not in case.truths


def test_a_level_errs_the_same_with_its_stated_error_and_without():
    panel, benchmark = measured(SHORT[0], repeats=1)
    by_way = {(one.name, one.family): one.error for one in panel.choices}
    names = {name for name, _ in by_way}
    assert len(names) == len(SHORT[0].levels)
    for name in names:
        assert by_way[name, STATING] == pytest.approx(by_way[name, WITHOUT], rel=1e-6)
    assert by_way["graded 4", STATING] < by_way["graded 3", STATING]
    assert benchmark.passed


def test_calculix_is_compared_with_ours_where_neither_states_an_error():
    choices = (
        Choice("graded 3", STATING, 1.0, 0.004),
        Choice("graded 3", WITHOUT, 2.0, 0.004),
        Choice("rim 0.3", CALCULIX, 5.0, 0.02),
        Choice("rim 0.1", CALCULIX, 8.0, 0.004),
    )
    found = equal_errors([Panel("a scene", "error", choices)])
    assert found == [("a scene", 0.02, 2.0, 5.0), ("a scene", 0.01, 2.0, 8.0), ("a scene", 0.005, 2.0, 8.0)]


@pytest.mark.long
@pytest.mark.skipif(
    not ccx_available() and "TSIS_REQUIRE_PEERS" not in os.environ,  # there its absence is a failure
    reason="CalculiX (Debian: calculix-ccx) is not installed",
)
def test_calculix_is_given_the_elements_that_serve_it_best():
    """Reduced integration errs less and takes less; finer rims err less."""
    case = cases()[0]
    points = {
        (one.name, one.family): one for one in calculix_choices(case, true_numbers(case.scene, case.truths, "small")[1])
    }
    full, reduced, finest = points["rim 0.3, in full", FULL], points["rim 0.3", CALCULIX], points["rim 0.02", CALCULIX]
    assert reduced.error < full.error
    assert finest.error < reduced.error < 0.1
