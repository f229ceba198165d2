"""`python -m device` without a verb: the daemon itself.

It takes the port, opens the probe, and serves until it is told to stop; then every part is closed and dark.
"""

from __future__ import annotations

import signal
import socket
from collections.abc import Callable

import uvicorn

from device.config import Config
from device.errors import DeviceError
from device.instrument.procedure import Procedure
from device.instrument.watch.restart_note import RestartNote
from device.instrument.watch.watchdog import Watchdog
from device.records.updates import Updates
from device.settings.last_good import StartSettings
from device.web.app import create_app


def serve(settings: StartSettings, opened: Callable[[], Procedure]) -> int:
    """Serve the probe that `opened` opens until SIGTERM or SIGINT; return the exit code.

    Raises `DeviceError` when the port is taken, and whatever `opened` raises when a part does not open.
    """
    config = settings.config
    listening = _listen(config)
    with listening:
        procedure = opened()
        note = RestartNote(config.data)
        updates = Updates(config.updates)
        warnings = tuple(one for one in (settings.warning, note.warning(), updates.warning()) if one)
        procedure.board.update(warnings=warnings)
        watchdog = Watchdog(procedure.progress, procedure.board, note)
        procedure.start()
        watchdog.start()
        try:
            if procedure.bench.force.fault is None:  # else `cell.device` may be what is wrong
                settings.keep()
            _run_server(procedure, updates, listening)
        finally:
            try:
                watchdog.close()
            finally:
                procedure.close()
    return 0


def _listen(config: Config) -> socket.socket:
    """Take the port before any hardware is opened; raise `DeviceError` when it is in use."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    host, port = config.server.host, config.server.port
    try:
        listening.bind((host, port))
        listening.listen()
    except OSError as error:
        listening.close()
        raise DeviceError(
            f"Port {port} of {host} cannot be used: {error.strerror}.", "Choose another with --port."
        ) from error
    return listening


def _run_server(procedure: Procedure, updates: Updates, listening: socket.socket) -> None:
    host, port = listening.getsockname()
    kind = "simulated probe" if procedure.is_simulated else "probe"
    print(f"TSIS {kind} {procedure.config.serial}: screen and API at http://{host}:{port}/", flush=True)
    app = create_app(procedure, procedure.store, updates)
    # Open event streams never end by themselves; without the limit a stop would wait for them.
    settings = uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=1, lifespan="off")
    server = uvicorn.Server(settings)
    signal.signal(signal.SIGTERM, lambda *_: setattr(server, "should_exit", True))
    server.run(sockets=[listening])
