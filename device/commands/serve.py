"""`python -m device` without a verb: the daemon itself.

It takes the port, opens the probe, and serves until it is told to stop; then every part is closed and dark. Nothing
that measures or serves is imported before the port is taken: the camera's process starts meanwhile.
"""

from __future__ import annotations

import errno
import json
import logging
import os
import socket
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from device import __version__
from device.access.known_hosts import ANYWHERE, LOOPBACK_ADDRESS
from device.config import Config
from device.errors import CertificateRefused, ConfigError, DeviceError, ModelError, StorageError
from device.fallback.handover import ask_for_port, is_fallback
from device.files.start_note import write_note
from device.instrument.watch.restart_note import RestartNote
from device.measurement.mode import Mode
from device.measurement.quantities import InvalidQuantity
from device.records.updates import Updates
from device.settings.last_good import StartSettings

if TYPE_CHECKING:
    from device.dicom.hospital import Hospital
    from device.instrument.procedure import Procedure
    from device.web.entrance.certificate_watch import CertificateWatch
    from device.web.entrance.network import NetworkPort
    from device.webhook.notifier import Notifier

log = logging.getLogger(__name__)
HANDOVER_S, HANDOVER_LOOK_S = 30.0, 0.05
START_AGAIN = "Then start the daemon again."
SWITCH_S = 0.0005
"""A thread of the web that answers gives Python's lock up so soon to one that takes frames; Python's own 5 ms, waited
for at each step of a frame's work, are a frame's time."""


def serve(settings: StartSettings, opened: Callable[[], Procedure], ready: Callable[[], None] = lambda: None) -> int:
    """Serve the probe that `opened` opens until SIGTERM or SIGINT; return the exit code.

    `ready` is called once every part has opened. Raises `DeviceError` when the port is taken, and whatever `opened`
    raises when a part does not open.
    """
    sys.setswitchinterval(SWITCH_S)
    config = settings.config
    with ExitStack() as listening:
        ports = _ports(config, listening)
        network = ports.network
        procedure = opened()
        from device.instrument.watch.watchdog import Watchdog

        note = RestartNote(config.data)
        told = (
            settings.warning,
            note.warning(),
            Updates(config.updates).warning(),
            procedure.store.audit.warning(),
            *procedure.board.now.warnings,
        )
        warnings = tuple(warning for warning in told if warning)
        procedure.board.update(warnings=warnings, network=ports.refusal)
        _note_in_use(procedure)
        watchdog = Watchdog(procedure.progress, procedure.board, note)
        with _noted(note), ExitStack() as ending:
            procedure.start()
            ending.callback(procedure.close)
            watchdog.start()
            ending.callback(watchdog.close)
            ready()
            hospital = _hospital(procedure)
            hospital.start()
            ending.callback(hospital.close)
            notifier = _notifier(procedure)
            if notifier:
                notifier.start()
                ending.callback(notifier.close)
            watch = _certificate_watch(network, procedure)
            watch.start()
            ending.callback(watch.close)
            if procedure.bench.force.fault is None:  # else `cell.device` may be what is wrong
                settings.keep()
            for port in ports.closed:
                port.hold_closed()
            listening_ports = [port.listening() for port in ports.served]
            _run_server(procedure, hospital, listening_ports, network, notifier, watch.ends_s)
    return 0


def _note_in_use(procedure: Procedure) -> None:
    """Write down what the probe works by; a store that takes nothing is the procedure's to tell, and stops no start."""
    try:
        procedure.store.audit.note_in_use(in_use(procedure.config, procedure.calibration.id, procedure.mode))
    except StorageError as error:
        log.error("%s %s", error.code, error)


def in_use(config: Config, calibration_id: str, mode: Mode) -> dict[str, Any]:
    """Return what a probe works by, for its audit: software, certificate, and each setting by its full name.

    `mode` is what `press.mode` comes to, also where it is not set.
    """
    said: dict[str, Any] = {"software": __version__, "calibration_id": calibration_id}
    for name, value in asdict(config).items():
        for inner, one in value.items() if isinstance(value, dict) else [("", value)]:
            said[f"{name}.{inner}" if inner else name] = str(one) if isinstance(one, Path) else one
    said["press.mode"] = mode
    present: dict[str, Any] = json.loads(json.dumps(said, default=str))  # as it comes back: a tuple is a list
    return present


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


class DaemonPort:
    """The daemon's port, taken before any hardware is opened; from the fallback, which has a page on it, only after.

    Raises `DeviceError` when anybody else has it.
    """

    def __init__(self, host: str, port: int) -> None:
        """Take the port, or find that the fallback has it."""
        self._host, self._port = host, port
        self._socket = self._taken()
        if self._socket is None and not is_fallback(self._host, self._port):
            raise self._refusal(OSError(errno.EADDRINUSE, os.strerror(errno.EADDRINUSE)))

    def __enter__(self) -> DaemonPort:
        return self

    def __exit__(self, *_: object) -> None:
        if self._socket:
            self._socket.close()

    def listening(self) -> socket.socket:
        """Return what listens on the port; the fallback has given it up by then."""
        until_s = time.monotonic() + HANDOVER_S
        while self._socket is None:
            ask_for_port(self._host, self._port)  # again, too: on a busy machine the fallback may have taken it again
            if time.monotonic() > until_s:
                raise self._refusal(OSError(errno.EADDRINUSE, "the fallback does not give it up"))
            time.sleep(HANDOVER_LOOK_S)
            self._socket = self._taken()
        return self._socket

    def hold_closed(self) -> None:
        """Refuse every connection, and keep the port: the fallback would say there that no daemon runs."""
        held = self.listening()
        held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 0)  # else another may listen at a port that nobody does
        held.shutdown(socket.SHUT_RDWR)

    def _taken(self) -> socket.socket | None:
        """Return what listens on the port, None when it is in use."""
        from device.web.entrance.network import bound

        try:
            return bound(self._host, self._port)
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                return None
            raise self._refusal(error) from error

    def _refusal(self, why: OSError) -> DeviceError:
        from device.web.entrance.network import unusable

        return unusable(self._host, self._port, why, "server.port or --port")


@contextmanager
def refusal_noted(root: Path) -> Iterator[None]:
    """Note why a start fails, for the page that stands in for the daemon; the error itself goes on."""
    try:
        yield
    except Exception as error:
        write_note(root, [fault.as_record() for fault in faults_of(error)])
        raise


def faults_of(error: Exception) -> list[DeviceError]:
    """Return what kept a daemon from starting as faults, each with code, cause and remedy."""
    from device.assembly.opened_parts import StartFailed
    from device.measurement.bundle import BundleRefused

    if isinstance(error, StartFailed):
        return error.faults
    if isinstance(error, DeviceError):
        return [error]
    if isinstance(error, BundleRefused):
        return [ModelError(str(error), START_AGAIN)]
    if isinstance(error, InvalidQuantity):
        return [ConfigError(str(error), START_AGAIN)]
    return [DeviceError(f"{type(error).__name__}: {error}.", "Report the daemon's log.")]


def _hospital(procedure: Procedure) -> Hospital:
    """Return what sends to the hospital's archive; the status tells when it does not get there."""
    from device.dicom.hospital import Hospital
    from device.instrument.press.picture import kept_or_drawn

    return Hospital(
        procedure.config.dicom,
        procedure.store,
        kept_or_drawn,
        _telling("archive", procedure),
        lambda: _is_pressed(procedure),
        lambda: procedure.is_clock_steady,
    )


def _notifier(procedure: Procedure) -> Notifier | None:
    """Return what tells the hospital's address of changes, None where none is set."""
    settings = procedure.config.webhook
    if settings.url is None:
        return None
    from device.webhook.notifier import Notifier

    tell = _telling("webhook", procedure)
    return Notifier(settings, procedure.store, procedure.config.serial, tell, lambda: _is_pressed(procedure))


def _certificate_watch(network: NetworkPort | None, procedure: Procedure) -> CertificateWatch:
    """Return what tells that a certificate of the settings, or the probe's own, ends or has not begun."""
    from device.web.entrance.certificate_watch import CertificateWatch, watched_files

    files = watched_files(procedure.config, network.certificate if network else None)
    return CertificateWatch(files, _telling("certificate", procedure), lambda: procedure.is_clock_steady)


def _telling(
    whom: Literal["archive", "webhook", "certificate"], procedure: Procedure
) -> Callable[[DeviceError | None], None]:
    """Return what the status hears of a receiver, or of the certificate, whenever that changes."""

    def tell(fault: DeviceError | None) -> None:
        if getattr(procedure.board.now, whom) is not fault:
            procedure.board.update(**{whom: fault})

    return tell


def _is_pressed(procedure: Procedure) -> bool:
    """Return whether a press has the probe to itself."""
    from device.records.store import ENDED

    press = procedure.board.now.press
    return press is not None and press.state not in ENDED


@dataclass(frozen=True)
class Ports:
    """Where the daemon is asked: `served` in clear, the last one at loopback where there are two; `network` by TLS.

    With a `refusal` of the certificate it is loopback alone, and `closed` are ports that nobody is answered at.
    """

    served: list[DaemonPort]
    closed: list[DaemonPort]
    network: NetworkPort | None
    refusal: CertificateRefused | None = None


def _ports(config: Config, opened: ExitStack) -> Ports:
    """Take every port: the daemon's, that of loopback where the former is another address, and by TLS for others.

    The fallback has one of the first two: of loopback where this machine has not got the stated address yet.
    """
    stated = config.server
    network, refusal = _network(config)
    if network:
        opened.callback(network.listening.close)
    if refusal and stated.host in ANYWHERE:
        hosts = [LOOPBACK_ADDRESS]
    elif (network or refusal) and stated.host not in ANYWHERE:
        hosts = [stated.host, LOOPBACK_ADDRESS]
    else:
        hosts = [stated.host]
    ports = [opened.enter_context(DaemonPort(host, stated.port)) for host in hosts]
    return Ports(ports[-1:], ports[:-1], None, refusal) if refusal else Ports(ports, [], network)


def _network(config: Config) -> tuple[NetworkPort | None, CertificateRefused | None]:
    """Return what serves other machines, or why nothing does: without a certificate they are not served in clear."""
    from device.web.entrance.network import open_network

    try:
        return open_network(config), None
    except CertificateRefused as error:
        log.warning("%s %s", error.code, error)
        return None, error


def _run_server(
    procedure: Procedure,
    hospital: Hospital,
    listening: Sequence[socket.socket],
    network: NetworkPort | None,
    notifier: Notifier | None,
    certificate_ends_s: Callable[[], Mapping[str, float]],
) -> None:
    from device.web.server import run_server

    port = listening[-1].getsockname()[1]  # of loopback, where there are two
    kind = "simulated probe" if procedure.is_simulated else "probe"
    others = ""
    if network:
        others = f"{network.served.url} (certificate SHA-256 {network.served.certificate_sha256}), here "
    local = LOOPBACK_ADDRESS if network else listening[0].getsockname()[0]
    print(f"TSIS {kind} {procedure.config.serial}: screen and API at {others}http://{local}:{port}/", flush=True)
    run_server(procedure, hospital, listening, network, notifier, certificate_ends_s)
