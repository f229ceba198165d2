"""Feeds systemd's watchdog while camera, LED chip, load cell, inference and disk go on, and only then.

A part that stops is first a fault on the screen and a note on the disk; then nothing more is fed, and systemd kills the
daemon, darkens the LEDs and starts it again. Its own thread does no more than look at the other loops' progress.
Source: sd_notify(3), WATCHDOG=1; systemd.service(5), WatchdogSec=.

What it tells systemd are datagrams of assignments to the socket that the environment names. Without that socket, as on
a laptop, nothing is sent and nothing is missing. Source: sd_notify(3), sd_watchdog_enabled(3).
"""

from __future__ import annotations

import logging
import os
import socket
import threading

from device.errors import StalledError
from device.instrument.status import StatusBoard
from device.instrument.watch.progress import Part, ProgressBoard, Stall
from device.instrument.watch.restart_note import RestartNote

log = logging.getLogger(__name__)
WITHOUT_SYSTEMD_S = 15.0
"""What systemd/tsis.service asks for; without systemd a part that stops is shown, and nothing restarts."""
LOOKS = 4
"""Looks in the watchdog's time: at least two are fed, and a fault is on the screen for half of it."""
NOTIFY_TIMEOUT_S = 2.0
"""A systemd that does not read for so long is not waited for: screen, log and stop need this thread."""
MOST_RESTARTS = 3
"""So many in a row have not helped: a part that still comes back with its fault stays on the screen instead."""


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
        notifying.settimeout(NOTIFY_TIMEOUT_S)
        notifying.sendto("\n".join(assignments).encode(), address)
    return True


def watchdog_s() -> float | None:
    """Return within how many seconds systemd wants to hear `WATCHDOG=1` from this process, or None when it does not."""
    asked_us, asked_pid = os.environ.get("WATCHDOG_USEC"), os.environ.get("WATCHDOG_PID")
    if not asked_us or (asked_pid and int(asked_pid) != os.getpid()):
        return None
    return int(asked_us) * 1e-6


class Watchdog:
    """Looks at the progress of the parts from its start until it is closed."""

    def __init__(self, progress: ProgressBoard, board: StatusBoard, note: RestartNote) -> None:
        """Take the time within which systemd wants to be fed from the environment."""
        self._progress, self._board, self._note = progress, board, note
        asked_s = watchdog_s()
        self._is_armed, self._time_s = asked_s is not None, asked_s or WITHOUT_SYSTEMD_S
        self._shown: tuple[tuple[Part, ...], bool] | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="watchdog", daemon=True)

    def start(self) -> None:
        """Say that the daemon is ready, and look from now on."""
        _tell("READY=1")
        self._thread.start()

    def close(self) -> None:
        """Look no more: the daemon ends by itself."""
        self._stopping.set()
        self._thread.join()
        self._note.take_back()
        _tell("STOPPING=1")

    def _run(self) -> None:
        while not self._stopping.wait(self._time_s / LOOKS):
            self.look()

    def look(self) -> None:
        """Feed the watchdog when all parts go on; else show, log and note which one does not."""
        stall = self._progress.stall(self._time_s)
        is_fed = stall is None or (stall.comes_back and self._note.times >= MOST_RESTARTS)
        if stall is None:
            self._note.see_health()
        shown = (stall.parts, is_fed) if stall else None
        if shown != self._shown:
            self._shown = shown
            self._show(stall, will_restart=self._is_armed and not is_fed)
        if is_fed:
            _tell("WATCHDOG=1", f"STATUS={stall or 'all parts go on'}")

    def _show(self, stall: Stall | None, *, will_restart: bool) -> None:
        error = _error(stall, will_restart) if stall else None
        log.warning("%s", f"{error.code} {error}" if error else "All parts go on again.")
        self._board.update(stall=error)
        if stall and will_restart:
            self._note.write(str(stall))
        else:
            self._note.take_back()


def _error(stall: Stall, will_restart: bool) -> StalledError:
    words = str(stall)
    remedy = (
        "Wait: the probe restarts." if will_restart else "Switch the probe off and on; if it stays, have it checked."
    )
    return StalledError(f"{words[0].upper()}{words[1:]}.", remedy)


def _tell(*assignments: str) -> None:
    """Notify systemd; a socket that is gone is logged: what then is not fed, systemd ends."""
    try:
        notify(*assignments)
    except OSError as error:
        log.error("systemd cannot be notified: %s.", error)
