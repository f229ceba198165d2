"""A check's result: passed inside its bound, failed outside with what to do, and nothing that was not done passes."""

import pytest

from device.errors import DiskFullError
from device.instrument.self_test.report import CheckResult, broken, compared, not_tested, overall
from device.measurement.quantities import Bound

BOUND = Bound(-0.02, 0.02, "N")


def test_a_value_in_its_bound_passes_without_advice():
    result = compared("Load cell", "zero", 0.01, BOUND, "Hold it free.")
    assert (result.verdict, result.remedy) == ("passed", "")
    assert (result.measured, result.bound) == ("0.01 N", "at least -0.02 and at most 0.02 N")


@pytest.mark.parametrize("value", [0.03, float("nan")])
def test_a_value_outside_or_that_is_none_fails_with_what_to_do(value):
    result = compared("Load cell", "zero", value, BOUND, "Hold it free.")
    assert (result.verdict, result.remedy) == ("failed", "Hold it free.")


def test_a_fault_fails_the_check_with_its_code_and_names_its_own_part():
    result = broken("write and read", DiskFullError("It is full.", "Free it."))
    assert (result.part, result.verdict, result.code) == ("Storage", "failed", "E602")
    assert (result.cause, result.remedy) == ("It is full.", "Free it.")


PASSED, UNTESTED = CheckResult("Light", "a", "passed"), not_tested("Light", "b", "Use the block.")
FAILED = broken("c", DiskFullError("It is full.", "Free it."))


@pytest.mark.parametrize(
    ("results", "verdict"),
    [
        ([PASSED, FAILED, UNTESTED], "failed"),
        ([UNTESTED, PASSED], "passed"),
        ([UNTESTED], "not_tested"),
        ([], "not_tested"),
    ],
)
def test_one_failure_is_a_failure_and_what_was_not_tested_is_no_pass(results, verdict):
    assert overall(results) == verdict
