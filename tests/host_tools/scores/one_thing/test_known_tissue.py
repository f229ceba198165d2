"""What it costs not to know the tissue: what is told of bounds, and that the press beside the lesion tells it."""

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.press_model import PressFailed
from host_tools.scores.one_thing import known_tissue
from host_tools.scores.one_thing.known_tissue import (
    HEADER,
    INCLUSIONS,
    TISSUES,
    known_at_best,
    known_tissue_chapter,
)


def test_the_largest_cost_of_any_tissue_is_judged_and_what_folds_is_left_out(monkeypatch):
    """Spreads of 0.5 mm, 0.4 mm and 30 %, in people's tissue half as large again in depth on 20 kPa."""

    def bounds(tissue, inclusion):
        if tissue == TISSUES[1]:
            raise PressFailed("folded")
        return np.array([[0.5, 0.4, 0.3], [0.5, 0.6 if tissue[0] == 20 else 0.42, 0.3]])

    monkeypatch.setattr(known_tissue, "known_at_best", bounds)
    chapter = known_tissue_chapter(jobs=1)
    assert [one.measured for one in chapter.benchmarks] == pytest.approx([1.0, 1.5, 1.0])
    assert [one.passed for one in chapter.benchmarks] == [True, False, True]
    (table,) = chapter.tables
    assert len(table.rows) == (len(TISSUES) - 1) * len(INCLUSIONS)
    assert table.rows[0] == ("5", "30", "10", "5", "60", "0.50", "0.40", "30%", "0.50", "0.42", "30%")
    assert {len(row) for row in table.rows} == {len(HEADER)}
    assert f"{len(table.rows)} can be followed" in chapter.claim


@pytest.mark.long
@pytest.mark.study
def test_not_knowing_the_tissue_costs_little_and_firm_tissue_much():
    """Of 10 mm, 5 mm deep, 60 kPa: the press beside the lesion tells the tissue, whatever was believed before."""
    (known, unknown), (firm, _) = (known_at_best((kpa, 30.0), Inclusion(10.0, 5.0, 60.0)) for kpa in (5.0, 20.0))
    assert (unknown >= known).all()
    assert (unknown < 1.1 * known).all()
    assert (firm[:2] > 3 * known[:2]).all()
