"""How the daemon before ended, told to the one that comes after it, once.

While a daemon runs its note is on the disk, without a cause; a clean stop removes it. What is found at a start tells of
an end that was not clean: with a cause, the watchdog's; without one, a kill, a crash or a power cut, whatever it was.
systemd knows more of that end than the daemon could: its `ExecStopPost=` adds that to the note.
Source: systemd.exec(5), "$SERVICE_RESULT, $EXIT_CODE, $EXIT_STATUS"; random(4) for the boot's id.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from device.errors import RestartedError, UncleanEndError
from device.files.durable import write_durably

log = logging.getLogger(__name__)

NAME = "restart.json"
IN_A_ROW_S = 600.0
"""A restart after less than this has not mended what the one before was for."""
BOOT_ID = Path("/proc/sys/kernel/random/boot_id")
"""Another one at each start of the board."""
LOST = "A press under way was lost: press again; measurements that were shown are kept."


class RestartNote:
    """The note in the data folder. `times`: how many restarts by the watchdog have followed each other."""

    def __init__(
        self, folder: Path, clock: Callable[[], float] = time.monotonic, boot: Callable[[], str] | None = None
    ) -> None:
        """Read and remove the note of the daemon before; one that cannot be read counts as none."""
        self._path, self._clock, self._since_s = folder / NAME, clock, clock()
        self._boot, self._is_running = (boot or _boot_id)(), False
        self.cause, self.times, self._unclean = "", 0, ""
        try:
            note = json.loads(self._path.read_text(encoding="utf-8"))
            self.cause, self.times = str(note["cause"]), int(note["times"])
            self._unclean = "" if self.cause else self._end(note)
            self._path.unlink()
        except FileNotFoundError:
            pass
        except (OSError, ValueError, KeyError, TypeError) as error:
            log.warning("The note of a restart, %s, cannot be read: %s.", self._path, error)

    def _end(self, note: Mapping[str, Any]) -> str:
        """Return how a daemon ended that noted no cause."""
        if note["boot"] != self._boot:
            return "The probe lost its power, or its board was restarted, while it ran"
        return str(note.get("ended")) if note.get("ended") else "The daemon was killed while it ran"

    def warning(self) -> RestartedError | UncleanEndError | None:
        """Return what the screen shows of the end before, or None when that was a clean stop."""
        if self.cause:
            remedy = f"{LOST} If it comes back, have that part checked and send the log."
            return RestartedError(f"Restarted by the watchdog: {self.cause}.", remedy)
        if self._unclean:
            return UncleanEndError(f"{self._unclean}.", f"{LOST} If it comes back, check the supply and send the log.")
        return None

    def see_health(self) -> None:
        """Note that all parts go on now: after ten minutes the restarts before have helped."""
        if self._clock() - self._since_s >= IN_A_ROW_S:
            self.times = 0

    def begin(self) -> None:
        """Note durably that a daemon runs; only `remove` says that it has ended well."""
        self._is_running = True
        self._keep("", 0)

    def write(self, cause: str) -> None:
        """Keep the watchdog's cause durably for the next daemon."""
        self._keep(cause, self.times + 1)

    def take_back(self) -> None:
        """Take back what was written: there will be no restart by the watchdog, and the daemon still runs."""
        if self._is_running:
            self.begin()
        else:
            self.remove()

    def remove(self) -> None:
        """Say that the daemon has ended well. A disk that refuses it is logged, and stops nothing."""
        try:
            self._path.unlink(missing_ok=True)
        except OSError as error:
            log.error("The note of a restart, %s, cannot be removed: %s.", self._path, error.strerror)

    def _keep(self, cause: str, times: int) -> None:
        """Write the note; a disk that does not take it is logged, and stops nothing."""
        try:
            write_durably(self._path, json.dumps({"cause": cause, "times": times, "boot": self._boot}).encode())
        except OSError as error:
            log.error("The reason of the restart cannot be kept in %s: %s.", self._path, error.strerror)


def note_end(folder: Path, environment: Mapping[str, str]) -> None:
    """Add to the note of a daemon that did not end well how systemd says that it ended; for its `ExecStopPost=`.

    Without systemd, after a clean stop, or with the watchdog's cause in the note nothing is added.
    """
    path, words = folder / NAME, _ended_words(environment)
    try:
        note = json.loads(path.read_text(encoding="utf-8"))
        if words and not note["cause"]:
            write_durably(path, json.dumps({**note, "ended": words}).encode())
    except FileNotFoundError:
        pass
    except (OSError, ValueError, KeyError, TypeError) as error:
        log.warning("The note of a restart, %s, cannot be completed: %s.", path, error)


def _ended_words(environment: Mapping[str, str]) -> str:
    """Return what systemd's variables of a service's end mean, "" when they say nothing."""
    result, status = environment.get("SERVICE_RESULT", ""), environment.get("EXIT_STATUS", "")
    return {
        "watchdog": "The daemon froze as a whole, and its watchdog ended it",
        "oom-kill": "The board's memory ran out, and the daemon was killed",
        "timeout": "The daemon did not start or stop in time, and was killed",
        "signal": f"The daemon was killed by the signal {status}",
        "core-dump": f"The daemon crashed with the signal {status}",
        "exit-code": f"The daemon failed with exit code {status}",
    }.get(result, "")


def _boot_id() -> str:
    try:
        return BOOT_ID.read_text(encoding="ascii").strip()
    except OSError:  # not on Linux
        return ""
