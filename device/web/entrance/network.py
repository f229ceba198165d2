"""How other machines reach the probe: a port of its own for TLS, and the certificate that it shows there.

Opened before any hardware is, and with nothing of the web but this module.
"""

from __future__ import annotations

import errno
import os
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.access.certificate import FOLDER, ServerCertificate, own_certificate
from device.access.known_hosts import ANYWHERE, LOOPBACK, KnownHosts
from device.config import Config
from device.errors import DeviceError


@dataclass(frozen=True)
class ServedNetwork:
    """Where the network is served by TLS, and the SHA-256 of the certificate that is shown there."""

    url: str
    certificate_sha256: str

    def as_record(self) -> dict[str, Any]:
        """Return it as JSON object."""
        return {"url": self.url, "certificate_sha256": self.certificate_sha256}

    def url_for(self, host: str) -> str:
        """Return the address for who asked at a name or an address of this machine."""
        _, _, port = self.url.rstrip("/").rpartition(":")
        return f"https://{host}:{port}/" if host else self.url


@dataclass(frozen=True)
class NetworkPort:
    """What listens for other machines, the certificate that it shows, and how they reach it."""

    listening: socket.socket
    certificate: ServerCertificate
    served: ServedNetwork


def is_served(host: str) -> bool:
    """Return whether a host to listen at is one that other machines can reach."""
    return host not in LOOPBACK and not host.startswith("127.")


def open_network(config: Config) -> NetworkPort | None:
    """Listen for other machines, None where only the probe itself is served.

    Raises `CertificateRefused`, and `DeviceError` when the port cannot be had.
    """
    stated = config.server
    if not is_served(stated.host):
        return None
    certificate = _certificate(config)
    listening = listen(stated.host, stated.tls_port, "server.tls_port")
    name = socket.gethostname() if stated.host in ANYWHERE else stated.host
    url = f"https://{name}:{listening.getsockname()[1]}/"
    return NetworkPort(listening, certificate, ServedNetwork(url, certificate.sha256))


def listen(host: str, port: int, setting: str) -> socket.socket:
    """Return what listens on a port; raise `DeviceError` with its setting when it cannot be had."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # see DaemonPort
    try:
        listening.bind((host, port))
        listening.listen()
    except OSError as error:
        listening.close()
        why = os.strerror(error.errno or errno.EIO)
        raise DeviceError(f"Port {port} of {host} cannot be used: {why}.", f"Choose another by {setting}.") from error
    return listening


def _certificate(config: Config) -> ServerCertificate:
    stated = config.server
    if stated.certificate and stated.certificate_key:
        given = ServerCertificate(Path(stated.certificate), Path(stated.certificate_key))
        given.require_usable()
        return given
    names = KnownHosts.of_machine(stated.host, *stated.hosts).names
    return own_certificate(config.data / FOLDER, names)
