"""Under which names this machine is reached: what a request's `Host` may say.

A page whose own name is made to resolve to this machine (DNS rebinding) sends that name, and so cannot ask.
"""

from __future__ import annotations

import ipaddress
import re
import socket
from dataclasses import dataclass

LOOPBACK_ADDRESS = "127.0.0.1"
LOOPBACK = ("localhost", LOOPBACK_ADDRESS, "::1")
ANYWHERE = ("0.0.0.0", "::", "")
"""What a listener is bound to that serves every network: no address of a machine."""


def asked_at(host: str) -> str:
    """Return the address at which a program of this machine asks what listens at a host."""
    return LOOPBACK_ADDRESS if host in ANYWHERE else host


AUTHORITY = re.compile(r"(?:\[(?P<ip6>[0-9a-f:.]+)\]|(?P<name>[^\s:/@\[\],]+))(?::(?P<port>\d{1,5}))?")


@dataclass(frozen=True)
class KnownHosts:
    """The names and addresses of this machine, in lower case."""

    names: frozenset[str]

    @classmethod
    def of_machine(cls, *more: str) -> KnownHosts:
        """Return the loopback's names, the machine's host name, alone and with .local, and `more`."""
        own = socket.gethostname().lower()
        short = own.partition(".")[0]
        given = {name.lower() for name in more} - set(ANYWHERE)
        return cls(frozenset({*LOOPBACK, own, short, f"{short}.local", *given}) - {"", ".local"})

    def has(self, host: str, served_at: str | None) -> bool:
        """Return whether a `Host` header names this machine: one of the names, or the address that was asked.

        `served_at` is the machine's own address of this very connection, which a listener on all networks does not
        know before.
        """
        name, _ = split_authority(host)
        return name in self.names or (is_address(name) and name == served_at)


def split_authority(text: str) -> tuple[str, int | None]:
    """Return the host, in lower case, and the port of `host[:port]`; ("", None) for what is none."""
    found = AUTHORITY.fullmatch(text.lower())
    if not found:
        return "", None
    name, port = found["ip6"] or found["name"].removesuffix("."), found["port"]
    return name, int(port) if port else None


def is_address(name: str | None) -> bool:
    """Return whether a text is an IP address."""
    try:
        ipaddress.ip_address(name or "")
    except ValueError:
        return False
    return True


def is_loopback(address: str | None) -> bool:
    """Return whether an address is this machine's own, to which no other machine can connect."""
    if not is_address(address):
        return False
    found = ipaddress.ip_address(address or "")
    mapped = getattr(found, "ipv4_mapped", None)
    return (mapped or found).is_loopback
