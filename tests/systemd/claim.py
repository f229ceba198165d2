"""What a story of a service claims."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Claim:
    """What has to hold, whether it does, and what was seen."""

    words: str
    holds: bool
    seen: object = ""

    def __str__(self) -> str:
        seen = f": {self.seen}" if self.seen != "" else ""
        return f"{'pass' if self.holds else 'FAIL'}  {self.words}{seen}"
