"""Dask clusters of this machine's own, without the pages that Dask would serve of them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import dask
from distributed import LocalCluster

NO_DASHBOARD = {"dashboard_address": "127.0.0.1:0", "scheduler_kwargs": {"dashboard": False}}


@contextmanager
def two_workers() -> Iterator[LocalCluster]:
    """Two workers, one core each, started again however often they die; work is given up after two died of it."""
    patience = {
        "distributed.scheduler.allowed-failures": 1,
        "distributed.deploy.lost-worker-timeout": "1h",
        "distributed.comm.timeouts.connect": "5s",  # how long a result is asked of a worker that is dead
    }
    with (
        dask.config.set(patience),
        LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **NO_DASHBOARD) as running,
    ):
        yield running
