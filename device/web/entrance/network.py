"""How other machines reach the probe: a port of its own for TLS, and the certificate that it shows there.

Opened before any hardware is, and with nothing of the web but this module.
"""

from __future__ import annotations

import errno
import logging
import os
import socket
import ssl
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.access.certificate import FOLDER, UNTIL_THEN, ServerCertificate, own_certificate
from device.access.known_hosts import ANYWHERE, LOOPBACK, KnownHosts
from device.config import Config
from device.errors import CertificateRefused, DeviceError
from device.files.file_reader import user_name

log = logging.getLogger(__name__)
IP_FREEBIND = 15
"""ip(7); Python has no name for it. An address that no interface has can be bound, and needs no right for that."""


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

    Raises `CertificateRefused` before anything listens, and `DeviceError` when the port cannot be had.
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
    try:
        return bound(host, port)
    except OSError as error:
        raise unusable(host, port, error, setting) from error


def unusable(host: str, port: int, error: OSError, setting: str) -> DeviceError:
    """Return that nothing can listen at a port, with the setting that names what is wrong: the port or the host."""
    is_of_port = error.errno in (errno.EADDRINUSE, errno.EACCES)
    remedy = f"Choose another by {setting}." if is_of_port else "Correct server.host; 0.0.0.0 is every address."
    return DeviceError(f"Port {port} of {host} cannot be used: {error.strerror or error}.", remedy)


def bound(host: str, port: int) -> socket.socket:
    """Return what listens on a port, also of an address that this machine has only later; raise `OSError`.

    The probe measures also where the cable is out when it starts, or its network gives it the address a minute later.
    """
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    # What it accepts inherits this. asyncio leaves sockets of a listener without a stated protocol alone, and then
    # every answer of two parts waits 44 ms for the client's delayed acknowledgement.
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    try:
        try:
            listening.bind((host, port))
        except OSError as error:
            if error.errno != errno.EADDRNOTAVAIL or sys.platform != "linux":
                raise
            log.warning("This machine does not have the address %s now: it is served once it has.", host)
            listening.setsockopt(socket.IPPROTO_IP, IP_FREEBIND, 1)
            listening.bind((host, port))
        listening.listen()
    except OSError:
        listening.close()
        raise
    return listening


def _certificate(config: Config) -> ServerCertificate:
    stated = config.server
    if stated.client_authority:
        _require_authority("server.client_authority", Path(stated.client_authority))
    if stated.certificate and stated.certificate_key:
        given = ServerCertificate(Path(stated.certificate), Path(stated.certificate_key))
        _require_readable("server.certificate", given.certificate)
        _require_readable("server.certificate_key", given.key)
        given.require_usable()
        return given
    names = KnownHosts.of_machine(stated.host, *stated.hosts).names
    return own_certificate(config.data / FOLDER, names)


def _require_readable(setting: str, path: Path) -> None:
    """Raise `CertificateRefused` unless this process can read the file that a setting names."""
    try:
        path.open("rb").close()
    except OSError as error:
        user = user_name(os.geteuid())
        cause = f"{setting} names {path}, which the user {user} cannot read: {error.strerror or error}."
        remedy = f"Bring the file there, or let {user} read it, and start the daemon again. {UNTIL_THEN}"
        raise CertificateRefused(cause, remedy) from error


def _require_authority(setting: str, path: Path) -> None:
    """Raise `CertificateRefused` unless the file that a setting names holds certificates that vouch for clients."""
    _require_readable(setting, path)
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_verify_locations(path)
    except (OSError, ValueError) as error:
        cause = f"{setting} names {path}, which holds no certificates that can be used: {error}."
        remedy = f"Bring the authority's certificates there (PEM), and start the daemon again. {UNTIL_THEN}"
        raise CertificateRefused(cause, remedy) from error
