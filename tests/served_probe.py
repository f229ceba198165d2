"""A simulated probe served from the test's own process, so that a test may say in which state it is."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import uvicorn

from device.assembly.probe import open_simulated_probe
from device.config import CameraSection, simulated_config
from device.instrument.procedure import Procedure
from device.records.updates import Updates
from device.simulation.scenario import Scenario
from device.web.app import create_app
from device.web.entrance.network import ServedNetwork


@dataclass
class ServedProbe:
    """Where a probe is served, and its procedure."""

    url: str
    procedure: Procedure
    updates: Path


@contextmanager
def served_probe(
    folder: Path, *, is_running: bool, scenario: Scenario | None = None, network: ServedNetwork | None = None
) -> Iterator[ServedProbe]:
    """Serve a simulated probe; one that does not run stays in the state that the test writes on its board.

    It is served here alone, and says that others reach it by `network`.
    """
    config = replace(simulated_config(), data=folder, camera=CameraSection(late_frames=100.0))
    procedure = open_simulated_probe(config, scenario or Scenario())
    procedure.start()
    if not is_running:
        procedure.stop()
        procedure._thread.join()
    updates = folder / "updates"
    app = create_app(procedure, procedure.store, updates=Updates(updates, "0.1.0+400"), network=network)
    settings = uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=1, lifespan="off")
    server, listening = uvicorn.Server(settings), socket.create_server(("127.0.0.1", 0))
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # as the daemon's own port has it
    serving = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    serving.start()
    try:
        yield ServedProbe(f"http://127.0.0.1:{listening.getsockname()[1]}", procedure, updates)
    finally:
        server.should_exit = True
        serving.join()
        listening.close()
        procedure.close()
