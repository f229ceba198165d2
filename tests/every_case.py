"""Whether tests go through every case of what they else sample, as `make torture` asks by TSIS_EVERY_CASE."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterable
from typing import TypeVar

Case = TypeVar("Case")
EVERY_CASE = bool(os.environ.get("TSIS_EVERY_CASE"))


def one_of_each(cases: Iterable[Case], kind: Callable[[Case], Hashable]) -> list[Case]:
    """Return every case, or the first of each kind."""
    cases = list(cases)
    return cases if EVERY_CASE else list({kind(case): case for case in reversed(cases)}.values())[::-1]
