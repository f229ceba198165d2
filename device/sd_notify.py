"""What a service tells systemd: datagrams of assignments to the socket that the environment names.

Without that socket, as on a laptop, nothing is sent and nothing is missing.
Source: sd_notify(3), sd_watchdog_enabled(3).
"""

from __future__ import annotations

import os
import socket


def notify(*assignments: str) -> bool:
    """Send assignments such as `READY=1` in one datagram; return False when nobody listens for them.

    An address that begins with @ is of Linux' abstract name space. Raises `OSError` when the socket does not take them.
    """
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address:
        return False
    if address.startswith("@"):
        address = "\0" + address[1:]
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as notifying:
        notifying.sendto("\n".join(assignments).encode(), address)
    return True


def watchdog_s() -> float | None:
    """Return within how many seconds systemd wants to hear `WATCHDOG=1` from this process, or None when it does not."""
    asked_us, asked_pid = os.environ.get("WATCHDOG_USEC"), os.environ.get("WATCHDOG_PID")
    if not asked_us or (asked_pid and int(asked_pid) != os.getpid()):
        return None
    return int(asked_us) * 1e-6
