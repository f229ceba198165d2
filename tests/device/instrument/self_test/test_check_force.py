"""Forces that are known: nothing at rest, and a weight."""

import pytest

from device.instrument.self_test.checks import rest_results, untested_weight, weight_result


@pytest.mark.parametrize(
    ("force_n", "shift_n", "verdicts"),
    [
        (0.001, 0.0, ["passed", "passed"]),
        (-0.03, 0.0, ["failed", "passed"]),
        (0.0, 0.19, ["passed", "passed"]),
        (0.015, 0.19, ["passed", "failed"]),
    ],
)
def test_the_zero_counts_from_this_start_and_from_commissioning(force_n, shift_n, verdicts):
    """Within 0.02 N and 0.2 N: what has moved since the start adds to what had moved before."""
    assert [result.verdict for result in rest_results(force_n, shift_n, 0.02, 0.2)] == verdicts


@pytest.mark.parametrize(
    ("weight_n", "force_n", "verdict"),
    [(2.0, 2.039, "passed"), (2.0, 1.959, "failed"), (0.5, 0.519, "passed"), (0.5, 0.521, "failed")],
)
def test_a_weight_is_measured_within_2_percent_or_the_zeros_tolerance(weight_n, force_n, verdict):
    assert weight_result(force_n, weight_n, 0.02).verdict == verdict


def test_without_a_weight_nothing_is_said_about_it():
    assert (untested_weight().verdict, untested_weight().value) == ("not_tested", None)
