"""Shared fixtures: the committed model and table, a recording of the simulated probe, and a running daemon."""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as `make test` has it: more threads would only wait for each other

from collections.abc import Iterator

import hypothesis
import pytest
from daemon_process import QUICK_HAND, ROOT, Daemon
from long_tests import is_listed, listed
from schedule import OneHand
from xdist.remote import Producer

from device.files.bundle_file import read_paper_model
from device.files.certificate_file import read_calibration
from device.measurement.bundle import ModelBundle
from device.measurement.calibration import Calibration
from device.measurement.quantities import Inclusion
from device.measurement.recording.recording import Recording
from device.simulation.physics.surface_table import SurfaceTable
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording

MODELS = ROOT / "models"
hypothesis.settings.register_profile("any machine", deadline=None)
hypothesis.settings.load_profile("any machine")


def pytest_xdist_auto_num_workers() -> int:
    """Return the workers of `-n auto`: one of them mostly waits for a hand (tests/schedule.py)."""
    return (os.cpu_count() or 1) + 1


@pytest.hookimpl(tryfirst=True)  # before pytest leaves out what `-m` says
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests that were measured to be long."""
    names = listed()
    for item in items:
        if is_listed(item.nodeid, names):
            item.add_marker("long")


def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> OneHand:
    """Return what shares the tests out among the workers."""
    return OneHand(config, log)


@pytest.fixture(scope="session")
def bundle() -> ModelBundle:
    return read_paper_model(MODELS / "paper")


@pytest.fixture(scope="session")
def tables() -> ProbeTables:
    return ProbeTables.load(MODELS / "simulated_probe")


@pytest.fixture(scope="session")
def table(tables: ProbeTables) -> SurfaceTable:
    return tables.centred


@pytest.fixture(scope="session")
def calibration() -> Calibration:
    return read_calibration(MODELS / "simulated_probe" / "calibration.json")


@pytest.fixture(scope="session")
def recording(tables: ProbeTables) -> Recording:
    """One phantom of 12 mm, 6 mm deep, 60 kPa, three press frames."""
    return phantom_recording(Inclusion(12.0, 6.0, 60.0), tables, seed=3, protocol=PhantomProtocol(frames=3))


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    """A running simulated probe with a quick hand; left idle to the end of the run it costs more than a start does."""
    running = Daemon(tmp_path_factory.mktemp("daemon"), QUICK_HAND)
    yield running
    running.stop()
