"""What is counted of answers: errors in millimetres and intervals, of what is answered alone."""

import numpy as np
import pytest
from told_answers import scored_presses

from host_tools.scores.scored_presses import joined


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
