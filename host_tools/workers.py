"""Where the long loops of the toolkit run: on the cores of this machine, or on the workers of a Dask cluster.

Every long loop is joblib's, and whoever writes one does not know where it runs. A worker that dies costs no result:
Dask hands what it was at to another one, and gives up only what several workers died of.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from threading import Lock
from typing import TYPE_CHECKING, Any

from device.measurement.quantities import InvalidQuantity

if TYPE_CHECKING:
    from distributed import Client

REACHED_WITHIN_S = 3.0
LARGEST_BATCH = "100 MB"
"""Tables and models go along with a batch, so that any worker can take it over; Dask warns above this."""
AT_WORK = Lock()
"""Two threads of one worker that solve at once crash it: NGSolve's task manager belongs to the process."""


@contextmanager
def workers(scheduler: str | None) -> Iterator[None]:
    """Let the loops inside run on a cluster by its scheduler's address; without one, on this machine.

    Wait while the cluster has no worker. Raise `InvalidQuantity` when the scheduler is not there or is lost, or several
    workers died of one and the same work.
    """
    if scheduler is None:
        yield
        return
    import dask
    from distributed import CancelledError, KilledWorker
    from joblib import parallel_config

    large = dask.config.set({"distributed.admin.large-graph-warning-threshold": LARGEST_BATCH})
    with large, connected(scheduler) as client, parallel_config(backend=_backend(client)):
        try:
            yield
        except KilledWorker as error:
            died = f"{scheduler}, where {error.allowed_failures + 1} workers died of the same work"
            action = "see the workers' logs for what they lacked"
            raise InvalidQuantity("scheduler", died, "that of workers that end their work", action) from error
        except CancelledError as error:
            raise InvalidQuantity("scheduler", f"{scheduler}, lost", "there until the end", "start again") from error


def one_core_each() -> AbstractContextManager[object]:
    """Return the setting for loops of linear algebra: each process here on one core, as a cluster's workers are."""
    from joblib import parallel_config
    from joblib.parallel import get_active_backend

    is_here = get_active_backend()[0].supports_inner_max_num_threads
    return parallel_config(backend="loky", inner_max_num_threads=1) if is_here else nullcontext()


def _backend(client: Client) -> Any:
    """Return what runs joblib's batches on a cluster.

    Not joblib's own for Dask: that waits for ever when work cannot be sent or workers died of it, and with one worker
    left computes in this process.
    """
    from distributed.protocol.pickle import dumps
    from joblib.parallel import ParallelBackendBase, SequentialBackend

    class Cluster(ParallelBackendBase):  # type: ignore[misc]
        supports_retrieve_callback = True
        supports_return_generator = True

        def effective_n_jobs(self, n_jobs: int) -> int:
            cores = client.ncores()  # type: ignore[no-untyped-call]
            return max(2, sum(map(int, cores.values())))  # of one job joblib makes a loop in this process

        def submit(self, func: Callable[[], Any], callback: Callable[[Any], None] | None = None) -> Any:
            future = client.submit(_work_off, dumps(func), pure=False)  # type: ignore[no-untyped-call]
            if callback:
                future.add_done_callback(callback)  # type: ignore[no-untyped-call]
            return future

        def retrieve_result_callback(self, out: Any) -> Any:
            return out.result()

        def get_nested_backend(self) -> tuple[Any, int]:
            return SequentialBackend(nesting_level=1), 1

    return Cluster()


def _work_off(batch: bytes) -> Any:
    """Return the results of a batch, on a worker: one after the other, whatever its threads."""
    from distributed.protocol.pickle import loads

    with AT_WORK:
        return loads(batch)()  # type: ignore[no-untyped-call]


def connected(address: str) -> Client:
    """Return a client of a scheduler, to be closed; raise `InvalidQuantity` when there is none at the address."""
    _require_scheduler(address)
    from distributed import Client

    return Client(address, timeout=REACHED_WITHIN_S, set_as_default=False)  # type: ignore[no-untyped-call]


def _require_scheduler(address: str) -> None:
    """Refuse an address where nothing speaks Dask's protocol: the client itself would wait there for ever."""
    from distributed.comm.core import connect

    async def shake_hands() -> None:
        comm = await connect(address, timeout=REACHED_WITHIN_S)  # type: ignore[no-untyped-call]
        await comm.close()

    action = "start one with `dask scheduler`, or give its address"
    refusal = InvalidQuantity("scheduler", address, "tcp://host:port of a running Dask scheduler", action)
    if not address.startswith("tcp://"):
        raise refusal
    try:
        asyncio.run(asyncio.wait_for(shake_hands(), 2 * REACHED_WITHIN_S))
    except (OSError, ValueError, TimeoutError) as error:
        raise refusal from error
