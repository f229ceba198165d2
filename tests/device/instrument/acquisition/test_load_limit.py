"""What a load cell of 1000 counts a newton bears, whose zero was 200 counts when it was commissioned."""

import pytest

from device.errors import OverloadedCellError, ZeroShiftError
from device.hardware.interfaces import ForceScale
from device.instrument.acquisition.load_limit import LoadLimit

LIMIT = LoadLimit(ForceScale(sensitivity_counts_per_n=1000.0, tare_counts=200.0), max_load_n=5.0, max_drift_n=0.5)


@pytest.mark.parametrize("counts", [200.0, 5200.0, -4800.0])
def test_a_load_up_to_the_limit_is_borne_either_way(counts):
    LIMIT.require_bearable(counts)


@pytest.mark.parametrize(("counts", "load"), [(5210.0, r"\+5\.01"), (-4810.0, r"-5\.01")])
def test_a_load_above_the_limit_is_refused_with_load_and_limit(counts, load):
    with pytest.raises(OverloadedCellError, match=rf"carries {load} N .* above the 5 N it bears"):
        LIMIT.require_bearable(counts)


@pytest.mark.parametrize("tare_counts", [200.0, 700.0, -300.0])
def test_a_tare_near_that_of_commissioning_holds(tare_counts):
    LIMIT.require_tare(tare_counts)


@pytest.mark.parametrize(("tare_counts", "drift"), [(710.0, r"\+0\.51"), (-310.0, r"-0\.51")])
def test_a_tare_far_from_that_of_commissioning_is_refused_with_both(tare_counts, drift):
    words = rf"is {tare_counts:.0f} counts, {drift} N from the 200 of commissioning, above the 0\.5 N allowed"
    with pytest.raises(ZeroShiftError, match=words):
        LIMIT.require_tare(tare_counts)
