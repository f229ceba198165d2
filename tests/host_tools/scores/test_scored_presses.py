"""What is counted of answers: errors in millimetres and intervals, of what is answered alone."""

from dataclasses import replace

import numpy as np
import pytest
from told_answers import scored_presses, told_presses

from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.simulation.physics.world import AS_BELIEVED
from host_tools.commissioning.commission import limits
from host_tools.commissioning.joint_fit import Design
from host_tools.press_models.press_derivatives import load_derivatives
from host_tools.scores.foreign_presses import foreign_presses
from host_tools.scores.robustness import known_probe
from host_tools.scores.scored_presses import FIGURES, covered_at_least, figures_of, joined, paired, scored


def test_errors_are_found_less_true():
    found = scored_presses([(9.0, 6.0), (7.5, 5.0)], [(8.0, 6.5), (8.0, 5.0)])
    assert found.error_mm() == pytest.approx(np.array([[1.0, -0.5], [-0.5, 0.0]]), abs=1e-9)


def test_what_is_refused_counts_neither_as_error_nor_as_covered():
    good, refused = (
        scored_presses([(8.0, 6.0)], [(8.0, 6.0)]),
        scored_presses([(14.0, 9.0)], [(4.0, 5.0)], answered=False),
    )
    whole = joined([good, refused])
    assert whole.is_answered.tolist() == [True, False]
    assert whole.error_mm() == pytest.approx(np.zeros((1, 2)), abs=1e-9)
    assert whole.covered().all()


def test_what_is_not_determined_covers_with_its_whole_range_and_so_counts_apart():
    found = scored_presses([(8.0, 6.0), (11.0, 6.0), (8.0, 9.0)], [(8.0, 6.0)] * 3)
    known = np.array([[True, True, True], [True, True, False], [True, False, False]])
    found.evaluated.is_known[:] = known
    found.evaluated.low[2, 1], found.evaluated.high[2, 1] = -1.0, 1.0
    assert found.covered().mean(axis=0) == pytest.approx([2 / 3, 1.0])
    assert found.determined_covered() == pytest.approx([2 / 3, 1.0])
    found.evaluated.is_known[1] = False
    assert found.determined_covered() == pytest.approx([1.0, 1.0])
    cells = dict(zip(FIGURES, figures_of(found), strict=True))
    assert (cells["size covered"], cells["determined size covered"]) == ("67 %", "100 %")
    assert (cells["size, depth determined"], cells["E determined"]) == ("33 %", "33 %")
    assert (cells["size bias (mm)"], cells["depth bias (mm)"]) == ("+1.00", "+1.00")


def test_a_bound_on_coverage_is_of_what_is_determined_alone():
    found = scored_presses([(11.0, 6.0), (8.0, 6.0)], [(8.0, 6.0)] * 2)
    assert [one.measured for one in covered_at_least("a", found, 0.9)] == pytest.approx([0.5, 1.0])
    found.evaluated.is_known[:] = [[True, False, False], [False, False, False]]
    [of_size] = covered_at_least("a", found, 0.9)
    assert (of_size.measured, of_size.passed) == (0.0, False)
    assert covered_at_least("a", scored_presses([(8.0, 6.0)], [(8.0, 6.0)], answered=False), 0.9) == []


def test_joint_regions_are_counted_of_what_is_answered():
    found = told_presses(good=3, wrong=1, refused=2)
    assert found.region_holds() == 0.75
    assert figures_of(found)[FIGURES.index("joint region holds")] == "75 %"
    of_quick = replace(found, evaluated=replace(found.evaluated, in_region=None))
    assert np.isnan(of_quick.region_holds())
    assert figures_of(of_quick)[FIGURES.index("joint region holds")] == ""


def test_a_press_that_is_too_faint_for_who_answers_is_neither_answered_nor_refused():
    found = told_presses(good=6, refused=2, faint=4)
    assert (len(found.number), found.share_answered()) == (12, 0.75)
    cells = dict(zip(FIGURES, figures_of(found), strict=True))
    assert (cells["stand out"], cells["answered"], cells["refused"]) == ("8", "6", "25 %")
    assert cells["median misfit"] == "1.00"
    nothing = told_presses(good=0, faint=2)
    assert nothing.share_answered() == 0.0
    assert figures_of(nothing) == ("0", *[""] * (len(FIGURES) - 1))


def test_pairs_are_of_the_same_numbers_whatever_stands_out_beside_them():
    first = replace(scored_presses([(8.0, 6.0), (9.0, 6.0)], [(8.0, 6.0)] * 2), number=np.array([3, 5]))
    second = replace(scored_presses([(8.1, 6.0), (9.1, 6.0)], [(8.0, 6.0)] * 2), number=np.array([5, 4]))
    mine, theirs = paired(first, second)
    assert mine.number.tolist() == theirs.number.tolist() == [5]
    assert (mine.error_mm()[0, 0], theirs.error_mm()[0, 0]) == pytest.approx((1.0, 0.1))


@pytest.mark.long
def test_presses_are_scored_where_they_are_answered(tables):
    model = read_ramp_model(MODELS / "standard")
    design = Design(model.answers, load_derivatives(SIMULATED_PROBE))
    taken = foreign_presses(tables, AS_BELIEVED, model.answers.noise, 6, seed=5, jobs=1)
    known = known_probe(design, AS_BELIEVED)
    critical = limits(known, model, seed=1)["standard"]
    found = scored(known, model, critical, taken, 1)
    assert found.is_answered.sum() >= 3
    assert 0 <= found.region_holds() <= 1
    levels = replace(known.noise.levels, model_ratio=1.0)
    blind = OwnAnswers(known.surrogate, replace(known.noise, levels=levels), known.own)
    assert not scored(blind, model, critical, taken.first(1), 1).stands_out.any()
    none = scored(known, model, replace(critical, misfit_ratio=0.0), taken, 1)
    assert np.isnan(none.region_holds())
    assert not none.is_answered.any()
