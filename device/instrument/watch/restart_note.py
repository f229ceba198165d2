"""Why the watchdog is about to restart the daemon, told to the daemon that comes after it.

The note is on the disk before the watchdog bites, and gone once the next daemon has read it.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable
from pathlib import Path

from device.errors import RestartedError
from device.files.durable import write_durably

log = logging.getLogger(__name__)

NAME = "restart.json"
IN_A_ROW_S = 600.0
"""A restart after less than this has not mended what the one before was for."""


class RestartNote:
    """The note in the data folder. `times`: how many restarts by the watchdog have followed each other."""

    def __init__(self, folder: Path, clock: Callable[[], float] = time.monotonic) -> None:
        """Read and remove the note of the daemon before; one that cannot be read counts as none."""
        self._path, self._clock, self._since_s = folder / NAME, clock, clock()
        self.cause, self.times = "", 0
        try:
            note = json.loads(self._path.read_text(encoding="utf-8"))
            self.cause, self.times = str(note["cause"]), int(note["times"])
            self._path.unlink()
        except FileNotFoundError:
            pass
        except (OSError, ValueError, KeyError, TypeError) as error:
            log.warning("The note of a restart, %s, cannot be read: %s.", self._path, error)

    def warning(self) -> RestartedError | None:
        """Return what the screen shows of the restart, or None when there was none."""
        if not self.cause:
            return None
        remedy = "A press under way was lost: press again. If it comes back, have that part checked and send the log."
        return RestartedError(f"Restarted by the watchdog: {self.cause}.", remedy)

    def see_health(self) -> None:
        """Note that all parts go on now: after ten minutes the restarts before have helped."""
        if self._clock() - self._since_s >= IN_A_ROW_S:
            self.times = 0

    def write(self, cause: str) -> None:
        """Keep the cause durably for the next daemon; a disk that does not take it is logged, and stops nothing."""
        try:
            write_durably(self._path, json.dumps({"cause": cause, "times": self.times + 1}).encode())
        except OSError as error:
            log.error("The reason of the restart cannot be kept in %s: %s.", self._path, error.strerror)

    def remove(self) -> None:
        """Take back what was written: there will be no restart. A disk that refuses it is logged, and stops nothing."""
        try:
            self._path.unlink(missing_ok=True)
        except OSError as error:
            log.error("The note of a restart, %s, cannot be removed: %s.", self._path, error.strerror)
