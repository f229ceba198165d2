"""What counts as held, refused and silent where tolerances are judged; the scenes run in `verify --tolerances`."""

import numpy as np
import pytest

from host_tools.verification.tolerances import TOLERANCES, ToleranceAnswer, answers, as_chapter, random_scene

GOOD = {"max_deformation_mm": (0.004, 0.001), "force_n": (0.003, 0.0)}
BAD = {"max_deformation_mm": (0.001, 0.2)}


def _scene(pairs, refusal=""):
    return [ToleranceAnswer(tolerance, 4, 1.0, pairs, refusal) for tolerance in TOLERANCES]


def test_answers_within_the_tolerance_are_held_and_refusals_are_no_answers():
    chapter = as_chapter([_scene(GOOD), _scene(BAD, "tolerance is missed")])
    assert chapter.passed
    assert chapter.tables[0].rows[0][1:3] == ("1", "1")
    assert chapter.tables[1].rows == (("4", "9", "0.667", "4.0", "0.005"),)


def test_an_answer_outside_the_tolerance_is_silent_and_fails_the_chapter():
    failed = [one.quantity for one in as_chapter([_scene(GOOD), _scene(BAD)]).benchmarks if not one.passed]
    assert len(failed) == 2 * len(TOLERANCES)


@pytest.mark.long
def test_a_random_scene_is_answered_at_every_tolerance():
    found = answers(random_scene(np.random.default_rng(2027)))
    assert [one.tolerance for one in found] == list(TOLERANCES)
    assert all(one.is_held for one in found)
    assert found[0].order <= found[-1].order
