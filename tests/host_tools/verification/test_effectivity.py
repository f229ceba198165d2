"""What counts as a statement that holds, and what a chapter says of many; the kinds run in `verify --effectivity`."""

import numpy as np
import pytest

from host_tools.forward.ladder import DOMED_ORDERS, FINITE_RUNGS, FLAT_ORDERS, SOLID_ORDERS, WIDEST_RIM
from host_tools.forward.plan import Level
from host_tools.verification.effectivity import (
    KINDS,
    ErrorStatement,
    ModelKind,
    box_scene,
    chapter_of,
    measure_effectivity,
)

GOOD = ErrorStatement("kind", "graded 4", "max_deformation_mm", 0.02, 0.01)
WRONG = ErrorStatement("kind", "graded 3", "max_deformation_mm", 0.01, 0.02)
UNRESOLVED = ErrorStatement("kind", "graded 4", "force_n", 1e-9, 1e-6)


def test_a_statement_holds_where_the_true_error_is_within_or_not_resolved():
    assert (GOOD.is_held, WRONG.is_held, UNRESOLVED.is_held) == (True, False, True)
    assert GOOD.ratio == pytest.approx(2.0)


def test_a_chapter_judges_what_held_level_by_level_and_names_what_is_overstated():
    found = chapter_of([*[GOOD] * 99, UNRESOLVED, WRONG, GOOD._replace(level="graded 5", stated=0.06)])
    assert [one.passed for one in found.benchmarks] == [True, True, False, True, True, False]
    assert [one.quantity for one in found.benchmarks[-2:]] == [
        "share of 1 statements held (at least)",
        "median of stated over true error",
    ]
    assert found.tables[0].rows[0][1:6] == ("graded 4", "100", "1.000", "2.0", "2")
    assert found.facts == {"statements": 102, "held": 101, "overstated": ["kind: graded 5, 6.0"]}


def test_a_level_that_errs_by_less_than_is_resolved_has_no_median():
    found = chapter_of([UNRESOLVED] * 3)
    assert [one.quantity for one in found.benchmarks] == ["share of 3 statements held (at least)"]
    assert found.tables[0].rows[0][3:6] == ("1.000", "", "")


def test_what_small_strain_departs_by_is_a_kind_of_its_own():
    found = measure_effectivity([], seed=2, departed_scenes=1)
    assert {(one.kind, one.level) for one in found} == {("small strain against finite", "light press")}
    assert all(one.is_held for one in found)


def test_every_level_of_a_climb_is_measured_but_for_the_finest_of_finite_strain_and_of_3d():
    of_finite = {level for kind in KINDS if kind.is_finite for level in kind.levels}
    assert {*FINITE_RUNGS, *WIDEST_RIM} - of_finite == {Level("sliding_fine", 4), Level("sliding_fine", 5)}
    levels = {kind.name: {level.order for level in kind.levels if level.grading == "graded"} for kind in KINDS}
    assert levels["small strain, box"] | levels["small strain, highest orders"] == {*FLAT_ORDERS}
    of_mixed = (levels[f"Poisson ratio above 0.499{more}"] for more in ("", ", highest orders"))
    assert set().union(*of_mixed) == {*FLAT_ORDERS}
    for name in ("dome that touches everywhere", "dome that lifts off"):
        assert levels[name] == {*DOMED_ORDERS}
    assert {*SOLID_ORDERS} - levels["3-D, off the axis"] == {SOLID_ORDERS[-1]}


def test_statements_of_a_scene_in_the_box_hold():
    kind = ModelKind("box", box_scene, 1, (Level("graded", 3), Level("graded", 4)), (Level("graded", 7),))
    found = measure_effectivity([kind], seed=4)
    assert {one.level for one in found} == {"graded 3", "graded 4"}
    assert all(one.is_held for one in found)
    assert np.median([one.ratio for one in found]) < 50
