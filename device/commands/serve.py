"""`python -m device` without a verb: the daemon itself.

It takes the port, opens the probe, and serves until it is told to stop; then every part is closed and dark.
"""

from __future__ import annotations

import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from types import FrameType

import uvicorn

from device.access.known_hosts import ANYWHERE, KnownHosts
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
        told = settings.warning, note.warning(), Updates(config.updates).warning()
        warnings = tuple(warning for warning in told if warning)
        procedure.board.update(warnings=warnings)
        watchdog = Watchdog(procedure.progress, procedure.board, note)
        with _noted(note), ExitStack() as ending:
            procedure.start()
            ending.callback(procedure.close)
            watchdog.start()
            ending.callback(watchdog.close)
            if procedure.bench.force.fault is None:  # else `cell.device` may be what is wrong
                settings.keep()
            _run_server(procedure, listening)
    return 0


@contextmanager
def _noted(note: RestartNote) -> Iterator[None]:
    """Note that the daemon runs, until it has ended by a signal to stop: any other end is told by the next one."""
    note.begin()
    try:
        yield
    except KeyboardInterrupt:
        note.remove()
        raise
    note.remove()


def _listen(config: Config) -> socket.socket:
    """Take the port before any hardware is opened; raise `DeviceError` when it is in use."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    # What it accepts inherits this. asyncio leaves sockets of a listener without a stated protocol alone, and then
    # every answer of two parts waits 44 ms for the client's delayed acknowledgement.
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
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


def _run_server(procedure: Procedure, listening: socket.socket) -> None:
    host, port = listening.getsockname()
    kind = "simulated probe" if procedure.is_simulated else "probe"
    reached_at = socket.gethostname() if host in ANYWHERE else host
    print(f"TSIS {kind} {procedure.config.serial}: screen and API at http://{reached_at}:{port}/", flush=True)
    stated = procedure.config.server
    hosts = KnownHosts.of_machine(stated.host, *stated.hosts)
    app = create_app(procedure, procedure.store, hosts=hosts, updates=Updates(procedure.config.updates))
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
