"""Counts and newtons: what turns one into the other, and what does not."""

import re

import pytest
from mypy import api

from device.hardware.interfaces import ForceScale

MIXED = """
from device.hardware.interfaces import CellSample, ForceScale, Newtons

def limit(force: Newtons) -> None: ...

def ask(sample: CellSample, scale: ForceScale) -> None:
    limit(scale.newtons(sample.counts))
    limit(sample.counts)
    limit(0.5)
    scale.newtons(scale.newtons(sample.counts))
"""


def test_newtons_are_the_counts_above_the_tare_over_the_sensitivity():
    scale = ForceScale(sensitivity_counts_per_n=1000.0, tare_counts=500.0)
    assert [scale.newtons(counts) for counts in (500.0, 2500.0, -500.0)] == [0.0, 2.0, -1.0]


@pytest.mark.long
def test_the_type_check_refuses_counts_and_plain_numbers_for_newtons_and_newtons_for_counts(tmp_path):
    """Line 7 of the text is right, lines 8 to 10 are not."""
    code = tmp_path / "mixed.py"
    code.write_text(MIXED)
    report, _, _ = api.run([str(code), "--follow-imports=silent", "--cache-dir", str(tmp_path / "cache")])
    assert re.findall(r"mixed\.py:(\d+): error: .* incompatible type", report) == ["8", "9", "10"]
