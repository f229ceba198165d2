"""The web application on its ports, until the daemon is told to stop; then the probe is dark before anything else.

The own screen asks by loopback, in clear. Where the network is served, other machines ask at a port of its own by TLS.
"""

from __future__ import annotations

import asyncio
import logging
import signal
import socket
import ssl
from collections.abc import Callable, Mapping, Sequence
from types import FrameType

import uvicorn
from fastapi import FastAPI

from device.access.certificate import CIPHERS
from device.access.known_hosts import KnownHosts
from device.config import ServerSection
from device.dicom.hospital import Hospital
from device.instrument.procedure import Procedure
from device.records.updates import Updates
from device.web.app import create_app
from device.web.entrance.connection import PatientProtocol
from device.web.entrance.counted_port import CountedPort, ServerLoop
from device.web.entrance.door import Door
from device.web.entrance.network import NetworkPort
from device.web.entrance.open_answers import OpenAnswers
from device.web.screen.kept_choices import KeptChoices
from device.webhook.notifier import Notifier

log = logging.getLogger(__name__)

GRACE_S = 1
"""So long a stop waits for answers under way; streams are ended at once."""
MOST_HEAD_BYTES = 16 * 1024


def run_server(
    procedure: Procedure,
    hospital: Hospital,
    listening: Sequence[socket.socket],
    network: NetworkPort | None = None,
    notifier: Notifier | None = None,
    certificate_ends_s: Callable[[], Mapping[str, float]] = dict,
) -> None:
    """Serve a running procedure on ports that listen, until SIGTERM or SIGINT.

    `certificate_ends_s` says when the certificates of each setting end, in s since 1970.
    """
    stated, answers = procedure.config.server, OpenAnswers()
    hosts = KnownHosts.of_machine(stated.host, *stated.hosts)
    store, updates, door = procedure.store, Updates(procedure.config.updates), Door(procedure.store.tokens)
    door.tokens.on_revoked(answers.end_of)
    served = network.served if network else None
    app = create_app(
        procedure,
        store,
        hosts=hosts,
        updates=updates,
        hospital=hospital,
        notifier=notifier,
        door=door,
        answers=answers,
        network=served,
        choices=KeptChoices(procedure.config.data),
        certificate_ends_s=certificate_ends_s,
    )
    servers = [DarkeningServer(_settings(app), procedure, answers, listening)]
    if network:
        servers.append(DarkeningServer(_encrypted(app, network, stated), procedure, answers, [network.listening]))
    servers[0].others = servers[1:]
    signal.signal(signal.SIGTERM, servers[0].handle_exit)  # until the server has its own
    with asyncio.Runner(loop_factory=ServerLoop) as runner:
        runner.run(_serve(servers))


async def _serve(servers: Sequence[DarkeningServer]) -> None:
    first, *others = servers
    async with asyncio.TaskGroup() as group:
        for other in others:
            group.create_task(other.serve_beside())
        group.create_task(first.serve(sockets=first.listening))


def _settings(app: FastAPI, **of_port: object) -> uvicorn.Config:
    return uvicorn.Config(
        app,
        http=PatientProtocol,
        ws="none",
        lifespan="off",
        log_level="warning",
        access_log=False,  # it would write queries; the guard has a line for each request
        proxy_headers=False,  # who asks is whose connection it is
        server_header=False,
        h11_max_incomplete_event_size=MOST_HEAD_BYTES,
        timeout_graceful_shutdown=GRACE_S,
        **of_port,  # type: ignore[arg-type]
    )


def _encrypted(app: FastAPI, network: NetworkPort, stated: ServerSection) -> uvicorn.Config:
    authority = stated.client_authority
    return _settings(
        app,
        ssl_certfile=network.certificate.certificate,
        ssl_keyfile=network.certificate.key,
        ssl_ciphers=CIPHERS,
        ssl_ca_certs=authority or None,
        ssl_cert_reqs=ssl.CERT_REQUIRED if authority else ssl.CERT_NONE,
    )


class DarkeningServer(uvicorn.Server):
    """The server whose first act at a signal to stop is to darken the probe: its clients are waited for after that."""

    def __init__(
        self,
        settings: uvicorn.Config,
        procedure: Procedure,
        answers: OpenAnswers,
        listening: Sequence[socket.socket] = (),
    ) -> None:
        super().__init__(settings)
        self.listening: list[socket.socket] = [CountedPort(one) for one in listening]
        self.others: list[DarkeningServer] = []
        self._procedure, self._answers, self._signal = procedure, answers, 0

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Take a signal to stop."""
        self._signal = sig
        self._procedure.stop()
        super().handle_exit(sig, frame)
        for other in self.others:
            other.should_exit = True

    async def serve_beside(self) -> None:
        """Serve without taking signals: another server of this process does."""
        await self._serve(self.listening)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the streams, and then what else is under way."""
        if self._signal:
            log.info("stop signal=%s", signal.Signals(self._signal).name)
        self._answers.end_all()
        await super().shutdown(sockets)
