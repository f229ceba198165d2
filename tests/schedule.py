"""Which tests of a parallel run (`-n`) share a worker, and which come first.

A file's tests share one, as do all in real time, and all that trace rays.

Two daemons with a hand in real time at once would each see frames come late; the tests of a file share what is set up
once for them; in a fresh clone the tracer of rays is compiled for ten seconds, by each process that then begins it.
Here because of https://github.com/pytest-dev/pytest-xdist/issues/1386: pytest 9.2 no longer reads the `item._nodeid`
by which xdist 3.8 hands a group on, so `--dist loadgroup` spreads groups over the workers. tests/test_schedule.py fails
when that works again. Then drop both files: run with `--dist loadgroup`, and let conftest.py give each test an
`xdist_group`: "real time", "rays", or its file.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from xdist.scheduler import LoadScopeScheduling

ROOT = Path(__file__).resolve().parents[1]
REAL_TIME = "real time"
RAYS = "rays"
MARK = "pytest.mark.real_time"
LONG = "pytest.mark.long"
TRACING = ("from host_tools.optics", "from host_tools.verification.light")


class OneHand(LoadScopeScheduling):
    """Sends the tests of a file to one worker; those in real time to one, and those of rays, before all others.

    Files with a long test come next: at the end of a run the other workers would wait for one.
    """

    def _split_scope(self, nodeid: str) -> str:
        path = nodeid.split("::", 1)[0]
        return _group(path) or path

    def _assign_work_unit(self, node: object) -> None:
        for group in (next(filter(_has_long, self.workqueue), ""), RAYS, REAL_TIME):
            if group in self.workqueue:
                self.workqueue.move_to_end(group, last=False)
        super()._assign_work_unit(node)


@cache
def _has_long(scope: str) -> bool:
    return (ROOT / scope).is_file() and LONG in (ROOT / scope).read_text(encoding="utf-8")


@cache
def _group(path: str) -> str:
    """Return the group of a file's tests, or "": the scheduler knows their names alone, so the file tells."""
    text = (ROOT / path).read_text(encoding="utf-8")
    if MARK in text:
        return REAL_TIME
    return RAYS if any(line.startswith(TRACING) for line in text.splitlines()) else ""
