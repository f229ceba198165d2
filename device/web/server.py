"""The web application on a port, until the daemon is told to stop; then the probe is dark before anything else."""

from __future__ import annotations

import signal
import socket
from types import FrameType

import uvicorn

from device.access.known_hosts import KnownHosts
from device.dicom.hospital import Hospital
from device.instrument.procedure import Procedure
from device.records.updates import Updates
from device.web.app import create_app


def run_server(procedure: Procedure, hospital: Hospital, listening: socket.socket) -> None:
    """Serve a running procedure on a port that listens, until SIGTERM or SIGINT."""
    stated = procedure.config.server
    hosts = KnownHosts.of_machine(stated.host, *stated.hosts)
    updates = Updates(procedure.config.updates)
    app = create_app(procedure, procedure.store, hosts=hosts, updates=updates, hospital=hospital)
    # Open event streams never end by themselves; without the limit a stop would wait for them.
    settings = uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=1, lifespan="off")
    server = DarkeningServer(settings, procedure)
    signal.signal(signal.SIGTERM, server.handle_exit)  # until the server has its own
    server.run(sockets=[listening])


class DarkeningServer(uvicorn.Server):
    """The server whose first act at a signal to stop is to darken the probe: its clients are waited for after that."""

    def __init__(self, settings: uvicorn.Config, procedure: Procedure) -> None:
        super().__init__(settings)
        self._procedure = procedure

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Take a signal to stop."""
        self._procedure.stop()
        super().handle_exit(sig, frame)
