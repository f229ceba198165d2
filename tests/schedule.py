"""Which tests of a parallel run (`-n`) share a worker: those of a file, and all that are marked `real_time`.

Two daemons with a hand in real time at once would each see frames come late; the tests of a file share what is set up
once for them. Here because of https://github.com/pytest-dev/pytest-xdist/issues/1386: pytest 9.2 no longer reads the
`item._nodeid` by which xdist 3.8 hands a group on, so `--dist loadgroup` spreads groups over the workers.
tests/test_schedule.py fails when that works again. Then drop both files: run with `--dist loadgroup`, and let
conftest.py give each test an `xdist_group`, "real time" or its file.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from xdist.scheduler import LoadScopeScheduling

ROOT = Path(__file__).resolve().parents[1]
REAL_TIME = "real time"
MARK = "pytest.mark.real_time"


class OneHand(LoadScopeScheduling):
    """Sends the tests of a file to one worker, and those in real time to one, too, before all others."""

    def _split_scope(self, nodeid: str) -> str:
        path = nodeid.split("::", 1)[0]
        return REAL_TIME if _is_in_real_time(path) else path

    def _assign_work_unit(self, node: object) -> None:
        if REAL_TIME in self.workqueue:
            self.workqueue.move_to_end(REAL_TIME, last=False)
        super()._assign_work_unit(node)


@cache
def _is_in_real_time(path: str) -> bool:
    """Return whether a file's tests are marked: the scheduler knows their names alone."""
    return MARK in (ROOT / path).read_text(encoding="utf-8")
