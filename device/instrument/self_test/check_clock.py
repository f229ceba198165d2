"""The wall clock to a verdict: does it run as the monotonic clock does, is its date possible, who keeps it right."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from device.instrument.self_test.result import Result, judged, not_tested
from device.measurement.quantities import Bound

PART = "Clock"
NOT_BEFORE = datetime(2025, 1, 1, tzinfo=UTC)
"""Older than this software: a board whose clock has lost its battery begins in 1970, or at the date of its image."""
DATE = Bound(0.0, float("inf"), "days")
SYNCHRONISED = Path("/run/systemd/timesync/synchronized")
"""Made once the time has been set by a server: systemd-timesyncd.service(8). Other time services do not make it."""
SET_IT = "Set the clock, check its battery, and give the board a time server."


def clock_results(drift_s: float, max_jump_s: float, now: str, synchronised: Path = SYNCHRONISED) -> list[Result]:
    """Return the judgement of a change of wall against monotonic time (s), and of the time now (RFC 3339)."""
    age_days = (datetime.fromisoformat(now) - NOT_BEFORE).total_seconds() / 86_400
    steady = Bound(-max_jump_s, max_jump_s, "s")
    return [
        judged(PART, "steady clock", drift_s, steady, "Check the board's clock and its time server."),
        judged(PART, f"date after {NOT_BEFORE:%Y-%m-%d}", age_days, DATE, SET_IT),
        _time_server(synchronised),
    ]


def _time_server(synchronised: Path) -> Result:
    if synchronised.exists():
        return Result(PART, "time server", "passed")
    return not_tested(PART, "time server", "Nothing says that a server keeps this clock: compare it with another one.")
