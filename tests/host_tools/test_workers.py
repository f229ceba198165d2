"""Loops give on a cluster what they give here, also when a worker is killed in the middle of them."""

import os
import signal
import time
from itertools import pairwise

import numpy as np
import pytest
from dask_cluster import NO_DASHBOARD, two_workers
from distributed import Client, LocalCluster
from joblib import Parallel, delayed
from joblib.parallel import get_active_backend
from toolkit_process import run_toolkit

from device.measurement.quantities import InvalidQuantity
from host_tools.paper_network.train import train
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.workers import one_core_each, workers

TRIALS = 12


@pytest.fixture(scope="module")
def cluster():
    with two_workers() as running:
        yield running


@pytest.mark.long
def test_a_worker_killed_in_the_middle_of_a_training_changes_nothing(cluster, rows):
    address = cluster.scheduler_address
    with Client(address, set_as_default=False) as client:
        victim = next(iter(client.run(os.getpid).values()))

        def progress(done, total):
            if done == TRIALS // 3:
                os.kill(victim, signal.SIGKILL)

        with workers(address):
            shared = train(rows, trials=TRIALS, progress=progress)
        assert victim not in client.run(os.getpid).values()
    alone = train(rows, trials=TRIALS, jobs=1)
    assert np.array_equal(shared.ensemble.parameters, alone.ensemble.parameters)


@pytest.mark.long
def test_a_worker_killed_by_its_work_costs_no_result(cluster, tmp_path):
    def work(number):
        died = tmp_path / f"died of {number}"
        if number == 5 and not died.exists():
            died.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return number, os.getpid()

    with workers(cluster.scheduler_address):
        found = in_parallel(work, 20, -1)
    assert [number for number, _ in found] == list(range(20))
    assert os.getpid() not in {process for _, process in found}
    assert (tmp_path / "died of 5").exists()


@pytest.mark.long
def test_work_that_kills_every_worker_is_one_sentence(cluster):
    with pytest.raises(InvalidQuantity, match="2 workers died of the same work"), workers(cluster.scheduler_address):
        Parallel(n_jobs=-1)(delayed(os._exit)(9) for _ in range(1))


@pytest.mark.long
def test_a_mistake_in_the_program_is_raised_as_it_is(cluster):
    with pytest.raises(ZeroDivisionError), workers(cluster.scheduler_address):
        in_parallel(lambda number: 1 // number, 3, -1)


@pytest.mark.long
def test_a_verb_computes_on_the_cluster(cluster, tmp_path):
    done = run_toolkit("evaluate", "--mode", "standard", "--scenes", 4, "--scheduler", cluster.scheduler_address)
    here = run_toolkit("evaluate", "--mode", "standard", "--scenes", 4)
    assert (done.returncode, done.stdout) == (0, here.stdout)
    with Client(cluster.scheduler_address, set_as_default=False) as client:
        loaded = client.run(lambda: "device.measurement.ramp_modes.fit" in __import__("sys").modules)
    assert any(loaded.values())


@pytest.mark.long
@pytest.mark.parametrize(
    "verb",
    [
        ("train", "--data", "s.nc", "--out", "model"),
        ("table",),
        ("evaluate",),
        ("modes",),
        ("verify",),
        ("sweep", "--out", "s.nc"),
    ],
    ids=lambda verb: verb[0],
)
def test_a_verb_refuses_a_scheduler_that_is_not_there(verb, tmp_path):
    done = run_toolkit(*verb, "--scheduler", "tcp://127.0.0.1:1", cwd=tmp_path)
    assert done.returncode == 1
    assert "of a running Dask scheduler" in done.stderr


def test_threads_of_one_worker_work_one_after_the_other():
    def work(number):
        began_s = time.monotonic()
        time.sleep(0.02)
        return began_s, time.monotonic()

    with (
        LocalCluster(n_workers=1, threads_per_worker=4, processes=False, protocol="tcp://", **NO_DASHBOARD) as threads,
        workers(threads.scheduler_address),
    ):
        times = sorted(Parallel(n_jobs=-1)(delayed(work)(number) for number in range(12)))
    assert all(a[1] <= b[0] for a, b in pairwise(times))


def test_without_a_scheduler_loops_run_here():
    with workers(None), one_core_each():
        assert get_active_backend()[0].supports_inner_max_num_threads
        assert in_parallel(lambda number: number**2, 5, 1) == [0, 1, 4, 9, 16]
