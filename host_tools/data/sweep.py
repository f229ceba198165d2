"""Random scenes of the paper's box to a data set, on all cores or a cluster, resumable, failures kept with a reason.

Rows arrive in any order and stand in the journal before anything else is done with them; the data set is written when
all are there. Memory does not grow with the number of scenes, except for a truth and a position each.
"""

from __future__ import annotations

import json
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import FrameType

from device import __version__
from device.measurement.quantities import InvalidQuantity
from host_tools.calibration.certified_probe import source_sha256
from host_tools.data.dataset_file import origin_of, write_dataset
from host_tools.data.executors import executor
from host_tools.data.journal import Journal, Row
from host_tools.data.plan import SweepPlan
from host_tools.data.rows import solve_row


def sweep(
    plan: SweepPlan,
    out: Path,
    *,
    jobs: int = -1,
    scheduler: str | None = None,
    on_row: Callable[[Row, int], None] = lambda row, done: None,
    replace: bool = False,
) -> Path:
    """Solve every scene that `out`'s journal does not hold yet, then write `out`; return it.

    A file that holds this very sweep is left as it is, whichever software solved it: it says so itself. Raise
    `InvalidQuantity` for one that holds anything else, and for a journal of other software, unless `replace` says to
    give it up, and for a folder; all before anything is solved.

    `scheduler` is the address tcp://host:port of a Dask cluster; without it `jobs` processes of this machine solve.
    `on_row` hears each new row and how many there are. Interrupted, it leaves the journal and no `out`.
    """
    if _is_done(plan, out, replace=replace):
        return out
    with executor(jobs=jobs, scheduler=scheduler) as rows_of, _remembered_interrupt() as interrupted:
        out.parent.mkdir(parents=True, exist_ok=True)
        solved_by = {"software": __version__, "software_sha256": source_sha256()}
        partial_file = out.with_suffix(out.suffix + ".partial")
        journal = Journal(partial_file, plan.as_record(), software=solved_by, replace=replace)
        truths = plan.truths()
        missing = [index for index in range(plan.scenes) if index not in journal]
        try:
            for row in rows_of(partial(solve_row, plan), ((index, truths[index]) for index in missing)):
                if interrupted.is_set():
                    raise KeyboardInterrupt
                if journal.append(row):
                    on_row(row, len(journal))
        finally:
            journal.close()
    write_dataset(journal, out)
    journal.remove()
    return out


def _is_done(plan: SweepPlan, out: Path, *, replace: bool) -> bool:
    """Return whether a file holds this sweep already; refuse what may not be replaced."""
    if out.is_dir():
        raise InvalidQuantity("out", out, "a file, not a folder", "name the netCDF file in it")
    if not out.exists():
        return False
    if holds(out, plan):
        return True
    if not replace:
        bound = "a new file, or one of the same scenes, seed, press and probe"
        raise InvalidQuantity("out", f"{out}, which holds something else", bound, "name another file, or add --force")
    return False


def holds(path: Path, plan: SweepPlan) -> bool:
    """Return whether a data set is of this plan, whichever software solved it."""
    return bool(origin_of(path) == json.loads(json.dumps(plan.as_record())))


@contextmanager
def _remembered_interrupt() -> Iterator[threading.Event]:
    """Yield what is set once SIGINT came: a solver may swallow the exception, or call its scene failed by it."""
    interrupted = threading.Event()
    if threading.current_thread() is not threading.main_thread():  # signals are another thread's
        yield interrupted
        return

    def remember(number: int, frame: FrameType | None) -> None:
        interrupted.set()
        signal.default_int_handler(number, frame)

    before = signal.signal(signal.SIGINT, remember)
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, before)
