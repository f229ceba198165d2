"""Cases to rows, on the cores of this machine or on a Dask cluster; whoever sweeps does not know which.

Rows come in the order in which they are done, and only a bounded number of cases is under way at once. A worker that
dies costs no row: its cases are solved by another one. Dask blames *every* case that waits at a dying worker, so
a case is given up only after it has killed workers while it was alone in the cluster.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any, Protocol

from joblib import Parallel, delayed

from device.measurement.quantities import InvalidQuantity
from host_tools.data.journal import Row
from host_tools.data.rows import Truth, empty_row
from host_tools.workers import AT_WORK, connected

if TYPE_CHECKING:
    from distributed import Client, Future, KilledWorker

Case = tuple[int, Truth]
"""Index of a scene in its sweep, and its truth [3]."""
Solve = Callable[[int, Truth], Row]

CASES_UNDER_WAY = 256
"""Two for each of a hundred workers; a million cases at once would fill the scheduler."""


class Executor(Protocol):
    """Maps cases to rows in any order, one row a case."""

    def __call__(self, solve: Solve, cases: Iterable[Case]) -> Iterator[Row]:
        """Yield each row when it is done."""


def executor(*, jobs: int = -1, scheduler: str | None = None) -> AbstractContextManager[Executor]:
    """Return where to solve: on `jobs` processes here (-1: all cores), or on the cluster of a scheduler's address.

    Raise `InvalidQuantity` for no processes, for both together, and on entering when the scheduler is not there.
    """
    if jobs == 0:
        raise InvalidQuantity("jobs", jobs, "a number of processes, or -1 for all cores", "leave the option away")
    if scheduler is None:
        return nullcontext(partial(_on_this_machine, jobs))
    if jobs != -1:
        raise InvalidQuantity("jobs", jobs, "left away with a scheduler", "start as many workers as you want")
    return _on_cluster(scheduler)


def _on_this_machine(jobs: int, solve: Solve, cases: Iterable[Case]) -> Iterator[Row]:
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # inherited by the workers: one solve, one core
    yield from Parallel(n_jobs=jobs, return_as="generator_unordered")(delayed(solve)(*case) for case in cases)


@contextmanager
def _on_cluster(address: str) -> Iterator[Executor]:
    """Connect to a scheduler. A worker solves one case at a time, and Dask starts it with BLAS at one thread.

    More threads than one (`dask worker --nthreads`) are therefore idle: start a worker for each core.
    """
    with connected(address) as client:
        yield partial(solve_on_cluster, client)


def solve_on_cluster(
    client: Client, solve: Solve, cases: Iterable[Case], *, under_way: int = CASES_UNDER_WAY
) -> Iterator[Row]:
    """Yield rows from a cluster's workers, at most `under_way` cases submitted at once.

    Wait while the cluster has no worker. A case at which workers died too often for Dask is solved again when all
    others are done, alone; if workers die of it then, too, its row says so. Raise `InvalidQuantity` when the scheduler
    is lost.
    """
    from distributed import KilledWorker

    suspects: list[Case] = []
    for case, outcome in _outcomes(client, solve, cases, under_way):
        if isinstance(outcome, KilledWorker):
            suspects.append(case)
        else:
            yield outcome
    for (index, truth), outcome in _outcomes(client, solve, suspects, 1):
        if isinstance(outcome, KilledWorker):
            reason = f"KilledWorker: {outcome.allowed_failures + 1} workers died of this scene, see their logs"
            yield empty_row(index, truth, reason=reason)
        else:
            yield outcome


def _outcomes(
    client: Client, solve: Solve, cases: Iterable[Case], under_way: int
) -> Iterator[tuple[Case, Row | KilledWorker]]:
    from distributed import as_completed

    waiting = iter(cases)
    case_of: dict[Future[Row], Case] = {}
    done: Any = as_completed(loop=client.loop, with_results=True, raise_errors=False)  # type: ignore[no-untyped-call]

    def submit(count: int) -> None:
        for case in islice(waiting, count):
            future = client.submit(_solve_one_at_a_time, solve, *case, pure=False)
            case_of[future] = case
            done.add(future)

    submit(under_way)
    for future, result in done:
        yield case_of.pop(future), _row_or_killed(result)
        submit(1)


def _solve_one_at_a_time(solve: Solve, index: int, truth: Truth) -> Row:
    with AT_WORK:
        return solve(index, truth)


def _row_or_killed(result: Any) -> Row | KilledWorker:
    """Return what Dask hands over if a case is over by it; raise everything else."""
    from distributed import CancelledError, KilledWorker

    match result:
        case dict():
            return result
        case (_, KilledWorker() as killed, _):
            return killed
        case (_, Exception() as error, traceback):
            raise error.with_traceback(traceback)
        case CancelledError():
            action = "start it again; the same command goes on"
            raise InvalidQuantity("scheduler", "lost", "there until the last row", action)
    raise TypeError(f"Dask handed over {result!r}, no row and no error")
