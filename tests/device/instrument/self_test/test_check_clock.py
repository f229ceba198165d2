"""The wall clock: set meanwhile, before this software was, kept by a server."""

import pytest

from device.instrument.self_test.checks import clock_results

NOW = "2026-01-01T12:00:00.000Z"


@pytest.fixture
def marker(tmp_path):
    return tmp_path / "synchronized"


@pytest.mark.parametrize(("drift_s", "verdict"), [(0.001, "passed"), (-1.9, "passed"), (3600.0, "failed")])
def test_a_clock_that_was_set_meanwhile_fails(marker, drift_s, verdict):
    steady, date, _ = clock_results(drift_s, 2.0, NOW, marker)
    assert (steady.verdict, date.verdict) == (verdict, "passed")


@pytest.mark.parametrize(("now", "days"), [("1970-01-01T00:00:10.000Z", -20088.999884), ("2024-12-31T00:00:00Z", -1.0)])
def test_a_clock_before_this_software_fails_with_how_far(marker, now, days):
    """From 1970 to 2025 there are 55 * 365 + 14 = 20089 days."""
    _, date, _ = clock_results(0.0, 2.0, now, marker)
    assert date.verdict == "failed"
    assert date.value == pytest.approx(days)


def test_nobody_knows_of_a_time_server_until_one_has_set_the_clock(marker):
    assert clock_results(0.0, 2.0, NOW, marker)[-1].verdict == "not_tested"
    marker.touch()
    assert clock_results(0.0, 2.0, NOW, marker)[-1].verdict == "passed"
