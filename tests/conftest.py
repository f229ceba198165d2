"""Shared fixtures: the committed model and table, a recording of the simulated probe, and a running daemon.

Run in parallel (`-n`), the tests of a file stay together, and those in which a virtual hand presses in real time are
one group: two hands at once would each see frames come late.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from daemon_process import QUICK_HAND, ROOT, Daemon

from device.measurement.calibration import Calibration, read_calibration
from device.measurement.inversion import ModelBundle
from device.measurement.quantities import Inclusion
from device.measurement.recording import Recording
from device.simulation.surface_table import SurfaceTable
from device.simulation.virtual_probe import ProbeTables
from host_tools.phantom import Protocol, phantom_recording

MODELS = ROOT / "models"
IN_REAL_TIME = "browser/", "device/test_modes", "device/test_scenarios", "test_press_to_result", "test_watchdog"


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put every test into the group of its file, or of all that run in real time."""
    for item in items:
        path = item.path.relative_to(ROOT / "tests").as_posix()
        item.add_marker(pytest.mark.xdist_group("real time" if path.startswith(IN_REAL_TIME) else path))


@pytest.fixture(scope="session")
def bundle() -> ModelBundle:
    return ModelBundle.load(MODELS / "paper")


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
    return phantom_recording(Inclusion(12.0, 6.0, 60.0), tables, seed=3, protocol=Protocol(frames=3))


@pytest.fixture(scope="session")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    """A running simulated probe with a quick hand."""
    running = Daemon(tmp_path_factory.mktemp("daemon"), QUICK_HAND)
    yield running
    running.stop()
