"""What a self-test found, and the self-test as one resource: what it was asked for, how far it is, and what it says.

A check found a measured value, the bound it must be in, and what to do if it is not.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Literal

from device.errors import DeviceError
from device.measurement.quantities import Bound

Verdict = Literal["passed", "failed", "not_tested"]


@dataclass(frozen=True)
class CheckResult:
    """One check of one part.

    `value` is in `unit`. `cause` and `code` are those of the fault that kept the check from being done; `remedy` says
    what to do about a failure, or for a check that was not done what it takes.
    """

    part: str
    check: str
    verdict: Verdict
    value: float | None = None
    unit: str = ""
    bound: str = ""
    cause: str = ""
    remedy: str = ""
    code: str | None = None

    @property
    def measured(self) -> str:
        """The value with its unit, empty without one."""
        return "" if self.value is None else f"{self.value:.4g} {self.unit}".strip()

    def as_record(self) -> dict[str, Any]:
        """Return the result as JSON object."""
        return asdict(self)


def compared(part: str, check: str, value: float, bound: Bound, remedy: str) -> CheckResult:
    """Return whether a measured value is in its bound; the remedy is told only if it is not."""
    value, is_in_bound = float(value), bound.holds(value)
    verdict: Verdict = "passed" if is_in_bound else "failed"
    return CheckResult(part, check, verdict, value, bound.unit, str(bound), remedy="" if is_in_bound else remedy)


def not_tested(part: str, check: str, remedy: str) -> CheckResult:
    """Return that a check was not done, and what it takes."""
    return CheckResult(part, check, "not_tested", remedy=remedy)


def broken(check: str, error: DeviceError) -> CheckResult:
    """Return the failure of a check that a fault kept from being done; the part is that of the fault."""
    return CheckResult(error.part(), check, "failed", cause=error.cause, remedy=error.remedy, code=error.code)


def overall(results: Iterable[CheckResult]) -> Verdict:
    """Return failed when one check failed, else passed when one passed: what was not tested is listed, not counted."""
    verdicts = {result.verdict for result in results}
    return "failed" if "failed" in verdicts else "passed" if "passed" in verdicts else "not_tested"


SelfTestState = Literal["waiting", "running", "done", "failed"]


@dataclass(frozen=True)
class SelfTestJob:
    """A self-test: with the probe held on the reference block or not, with a known weight (N) or none.

    It has failed when it could not be brought to its end; whether the probe has is its verdict.
    """

    id: str
    started_at: str
    on_block: bool = False
    weight_n: float | None = None
    state: SelfTestState = "waiting"
    results: tuple[CheckResult, ...] = ()

    @property
    def is_under_way(self) -> bool:
        """Whether it keeps a press from beginning."""
        return self.state in ("waiting", "running")

    @property
    def verdict(self) -> Verdict:
        """What the results so far come to."""
        return "failed" if self.state == "failed" else overall(self.results)

    def as_record(self) -> dict[str, Any]:
        """Return the job with its results as JSON object."""
        return asdict(self) | {"verdict": self.verdict}

    def summary(self) -> dict[str, Any]:
        """Return what the stream of statuses says of it: whoever wants the results asks for them."""
        return {"id": self.id, "state": self.state, "verdict": self.verdict, "checks": len(self.results)}
