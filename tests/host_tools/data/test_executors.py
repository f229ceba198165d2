"""A cluster gives the rows of one machine: none lost, none doubled, whatever happens to its workers."""

import os
import signal
import socket
import subprocess
import sys
import time
from itertools import pairwise
from operator import itemgetter

import numpy as np
import pytest
import xarray as xr
from dask_cluster import NO_DASHBOARD, two_workers
from distributed import Client, LocalCluster
from sweep_rows import SCENES

from device.measurement.quantities import InvalidQuantity
from host_tools import workers
from host_tools.data.dataset import read_dataset
from host_tools.data.executors import executor, solve_on_cluster
from host_tools.data.journal import Journal
from host_tools.data.plan import SweepPlan
from host_tools.data.sweep import sweep

NO_TRUTH = np.zeros(3)


@pytest.fixture(scope="module")
def cluster():
    with two_workers() as running:
        yield running


@pytest.fixture
def client(cluster):
    with Client(cluster.scheduler_address, set_as_default=False) as connected:
        yield connected


@pytest.mark.long
def test_a_worker_killed_in_the_middle_costs_no_row_and_doubles_none(tmp_path, cluster, client, uninterrupted):
    victim = next(iter(client.run(os.getpid).values()))
    done_of = []

    def on_row(row, done):
        done_of.append(done)
        if done == SCENES // 3:
            os.kill(victim, signal.SIGKILL)

    path = sweep(SweepPlan(SCENES, 4), tmp_path / "s.nc", scheduler=cluster.scheduler_address, on_row=on_row)
    assert done_of == list(range(1, SCENES + 1))
    assert victim not in client.run(os.getpid).values()
    # Workers may differ from this process in the last bits of their linear algebra.
    xr.testing.assert_allclose(read_dataset(path), uninterrupted, rtol=1e-6, atol=1e-9)


@pytest.mark.long
def test_only_the_scene_that_kills_its_workers_fails(client):
    def solve(index, truth):
        if index == 2:
            os._exit(9)
        return {"index": index, "reason": ""}

    rows = list(solve_on_cluster(client, solve, ((i, NO_TRUTH) for i in range(6))))
    reasons = {row["index"]: row["reason"] for row in rows}
    assert len(rows) == len(reasons) == 6
    assert reasons.pop(2) == "KilledWorker: 2 workers died of this scene, see their logs"
    assert set(reasons.values()) == {""}


@pytest.mark.long
def test_no_more_cases_are_under_way_than_asked_for(client):
    drawn = []

    def cases():
        for index in range(20):
            drawn.append(index)
            yield index, NO_TRUTH

    rows = solve_on_cluster(client, lambda index, truth: {"index": index}, cases(), under_way=3)
    drawn_by_then = [len(drawn) for _ in rows]
    assert len(drawn_by_then) == 20
    assert drawn_by_then[0] == 3
    assert all(b - a <= 1 for a, b in pairwise(drawn_by_then))


@pytest.mark.long
def test_a_mistake_in_the_program_is_no_row(client):
    with pytest.raises(ZeroDivisionError):
        list(solve_on_cluster(client, lambda index, truth: 1 / 0, [(0, NO_TRUTH)]))


def test_threads_of_one_worker_solve_one_after_the_other():
    def solve(index, truth):
        began_s = time.monotonic()
        time.sleep(0.02)
        return {"index": index, "began_s": began_s, "ended_s": time.monotonic()}

    with (
        LocalCluster(n_workers=1, threads_per_worker=4, processes=False, **NO_DASHBOARD) as threads,
        Client(threads, set_as_default=False) as connected,
    ):
        rows = sorted(solve_on_cluster(connected, solve, ((i, NO_TRUTH) for i in range(12))), key=itemgetter("began_s"))
    assert len(rows) == 12
    assert all(a["ended_s"] <= b["began_s"] for a, b in pairwise(rows))


@pytest.mark.long
def test_a_worker_solves_on_one_core(client):
    threads = client.run(lambda: [os.environ.get(name) for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")])
    assert all(counts == ["1", "1"] for counts in threads.values())


def test_a_lost_scheduler_is_one_sentence(tmp_path):
    told = tmp_path / "scheduler.json"
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--no-dashboard", "--host", "127.0.0.1"]
    scheduler = subprocess.Popen([*command, "--port", "0", "--scheduler-file", str(told)], stderr=subprocess.DEVNULL)

    def cases():
        yield 0, NO_TRUTH
        scheduler.kill()

    while not told.exists():
        assert scheduler.poll() is None
        time.sleep(0.05)
    with (
        Client(scheduler_file=str(told), set_as_default=False) as connected,
        pytest.raises(InvalidQuantity, match="scheduler is lost"),
    ):
        list(solve_on_cluster(connected, lambda index, truth: {}, cases()))
    scheduler.wait()


@pytest.mark.parametrize(
    "address", ["", "localhost:8786", "tcp://127.0.0.1", "http://127.0.0.1:1", "tcp://127.0.0.1:1"]
)
def test_an_unreachable_scheduler_is_refused_before_the_journal_is_touched(tmp_path, monkeypatch, address):
    monkeypatch.setattr(workers, "REACHED_WITHIN_S", 0.2)
    Journal(tmp_path / "s.nc.partial", SweepPlan(3, 1).as_record()).close()
    with pytest.raises(InvalidQuantity, match="of a running Dask scheduler") as refused:
        sweep(SweepPlan(3, 2), tmp_path / "s.nc", scheduler=address)
    assert refused.value.value == address
    assert [path.name for path in tmp_path.iterdir()] == ["s.nc.partial"]


def test_a_server_that_does_not_answer_is_refused(monkeypatch):
    monkeypatch.setattr(workers, "REACHED_WITHIN_S", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as mute:
        address = f"tcp://127.0.0.1:{mute.getsockname()[1]}"
        with pytest.raises(InvalidQuantity, match=address), executor(scheduler=address):
            pass


@pytest.mark.parametrize(("jobs", "scheduler"), [(0, None), (2, "tcp://127.0.0.1:1")])
def test_jobs_that_mean_nothing_are_refused(jobs, scheduler):
    with pytest.raises(InvalidQuantity, match="jobs"):
        executor(jobs=jobs, scheduler=scheduler)
