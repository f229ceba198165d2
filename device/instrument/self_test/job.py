"""One self-test as a resource: what it was asked for, how far it is, and what it found."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

from device.instrument.self_test.result import Result, Verdict, overall

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
    results: tuple[Result, ...] = ()

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
