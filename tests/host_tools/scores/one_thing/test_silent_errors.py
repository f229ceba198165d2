"""What is further off than without a thing, and prolate inclusions of a ball's volume."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from told_answers import scored_presses

from host_tools.scores.one_thing import silent_errors
from host_tools.scores.one_thing.silent_errors import (
    _as_prolate,
    _balls,
    _benchmarks,
    further_off_mm,
    moved_mm,
    solved_prolate,
)


def off_by(error_mm):
    return scored_presses(np.add([(8.0, 6.0)] * 3, error_mm), [(8.0, 6.0)] * 3)


def test_further_off_is_beyond_what_the_same_presses_are_without_it():
    assert further_off_mm(off_by((0.7, -0.2)), off_by((0.2, 0.1))) == pytest.approx([0.5, -0.3], abs=1e-9)
    refused = replace(off_by((0.0, 0.0)), is_answered=np.zeros(3, bool))
    assert np.isnan(further_off_mm(refused, off_by((0.0, 0.0)))).all()


def test_moved_is_of_the_same_presses_and_hides_no_sign():
    """The same number is the same press, in any order: truths alone may be those of a ball on several skins."""
    truth = [(8.0, 6.0), (8.0, 6.0), (10.0, 7.0)]
    without = scored_presses(truth, truth)
    found = scored_presses(np.add(truth, [(0.3, 0.0), (-0.3, 0.1), (0.3, 0.0)])[::-1], truth[::-1])
    found = replace(found, number=np.arange(3)[::-1])
    assert moved_mm(found, without) == pytest.approx([0.3, 0.1 / np.sqrt(3)], abs=1e-9)
    assert further_off_mm(found, without) == pytest.approx([0.1, 0.1 / 3], abs=1e-9)
    assert np.isnan(moved_mm(found, replace(without, number=np.arange(3) + 7))).all()


def test_the_bound_is_on_every_thing_but_what_it_is_compared_with():
    nothing, layer = (dict.fromkeys(silent_errors.MODES, off_by((error, 0.0))) for error in (0.1, 1.3))
    benchmarks = _benchmarks({"nothing": nothing, "layer": layer}, dict.fromkeys(["nothing", "layer"], nothing))
    assert {one.case for one in benchmarks} == {"layer, standard", "layer, precise"}
    assert [one.passed for one in benchmarks if one.quantity.startswith("size")] == [False, False]
    assert [one.passed for one in benchmarks if one.quantity.startswith("depth")] == [True, True]


def test_a_prolate_inclusion_has_the_volume_of_the_ball_that_is_to_be_found():
    balls = _balls(2, scans=2, seed=1)
    prolate = _as_prolate(balls, 1.5)
    height, ball = prolate.pressed[:, 0], prolate.parameters[:, 0]
    np.testing.assert_allclose(height * (height / 1.5) ** 2, ball**3)
    np.testing.assert_array_equal(prolate.pressed[:, 1:], balls.parameters[:, 1:])
    np.testing.assert_array_equal(balls.parameters[0, :3], balls.parameters[2, :3])
    assert balls.parameters[0, 3] != balls.parameters[2, 3]


def test_each_inclusion_is_solved_where_both_presses_of_its_scan_are(tables, monkeypatch):
    def solved(scene, table):
        return SimpleNamespace(scene=scene)

    monkeypatch.setattr(silent_errors, "stretched_inclusion", solved)
    monkeypatch.setattr(silent_errors, "in_parallel", lambda work, count, jobs: [work(i) for i in range(count)])
    prolate = _as_prolate(_balls(2, scans=2, seed=1), 1.25)
    found = solved_prolate(prolate, 2, 1.25, tables, jobs=1)
    places = [[one.off_axis.scene.placement for one in of_one] for of_one in found]
    assert [[place.offset_x_mm for place in of_one] for of_one in places] == [
        [prolate.pressed[number, -1], prolate.further_mm[number]] for number in range(2)
    ]
    assert {place.width_ratio_x for of_one in places for place in of_one} == {0.8}
    assert found[1][0].off_axis.scene.inclusion.size_mm == prolate.pressed[1, 0]
