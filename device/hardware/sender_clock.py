"""When a sender says it measured, on its own clock, to the one clock of the probe.

A line is never early, only late: by the serial line, by a bus, by a busy board. So the least delay that was seen lately
is the difference of the clocks, and what comes on top of it is lateness of that line alone.
Source: the minimum filter of RFC 5905 (NTP), section 10; Zhang, Liu & Xia, IEEE INFOCOM 2002, on clocks that drift.
"""

from __future__ import annotations

MOST_DRIFT_RATIO = 0.005
"""How fast the sender's clock may lose on ours: a ceramic resonator's half per cent."""
RESTART_S = 0.5
"""A line this much earlier or later than the sender's clock lets expect comes from a clock that began anew."""


class SenderClock:
    """The difference of two clocks, from the lines that have come so far."""

    def __init__(self) -> None:
        self._ahead_s: float | None = None
        self._sender_s = self._measured_s = 0.0

    def measured_s(self, sender_s: float, arrival_s: float) -> float:
        """Return when a line was measured (s, our clock) that says `sender_s` and came at `arrival_s`.

        Never later than it came, and never before the line before it.
        """
        ahead_s = arrival_s - sender_s
        if self._ahead_s is None or sender_s < self._sender_s or abs(ahead_s - self._ahead_s) > RESTART_S:
            self._ahead_s = ahead_s
        else:
            self._ahead_s = min(ahead_s, self._ahead_s + MOST_DRIFT_RATIO * (sender_s - self._sender_s))
        self._sender_s = sender_s
        self._measured_s = min(arrival_s, max(self._measured_s, sender_s + self._ahead_s))
        return self._measured_s
