"""Whether the certificate that other machines see still holds: told a month before its end, and after it.

Nothing is told by a clock that somebody has set within a quarter of an hour: a board without a battery may show any
date until a time server answers, and one that shows 1970 finds no certificate at its end.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from device.access.certificate import ServerCertificate, ending
from device.errors import CertificateEnds, DeviceError

log = logging.getLogger(__name__)
LOOK_S = 60.0
"""How often the clock is looked at; the end is read once, as the certificate itself is."""
STOP_S = 5.0


class CertificateWatch:
    """Looks by a thread of its own; `tell` hears a `CertificateEnds`, or None once it is over."""

    def __init__(
        self,
        certificate: ServerCertificate,
        tell: Callable[[DeviceError | None], None],
        is_clock_steady: Callable[[], bool],
        wall_time_s: Callable[[], float] = time.time,
    ) -> None:
        """Take the certificate that is served, and whether ages by the wall clock are believed."""
        self._certificate, self._tell, self._wall_time_s = certificate, tell, wall_time_s
        self._is_clock_steady = is_clock_steady
        self._ends_s = certificate.ends_s()
        self._told: CertificateEnds | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="certificate watch", daemon=True)

    def start(self) -> None:
        """Begin; there is nothing to look at where nobody could say when the certificate ends."""
        if self._ends_s is not None:
            self._thread.start()

    def close(self) -> None:
        """End."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(timeout=STOP_S)

    def look(self) -> None:
        """Tell what holds today, if that was not told yet."""
        if self._ends_s is None or not self._is_clock_steady():
            return
        found = ending(self._certificate, self._ends_s, self._wall_time_s())
        if (found and found.cause) == (self._told and self._told.cause):
            return
        self._told = found
        if found:
            log.warning("%s %s", found.code, found)
        self._tell(found)

    def _run(self) -> None:
        while not self._stopping.wait(LOOK_S):
            self.look()
