"""The daemon's unit, by `systemctl` from the PATH: stopped, started, its files read again."""

from __future__ import annotations

import subprocess

from device.errors import UpdateFailed

DAEMON = "tsis.service"
NOT_LOADED = 5
"""What `systemctl stop` ends with where there is no such unit, as before the first release: its link points nowhere."""
WITHIN_S = 90
"""The unit's TimeoutStopSec is 10 s; systemd kills what is left then."""


def stop_daemon() -> None:
    """Stop the daemon, and return when it is gone or was never there. Raises `UpdateFailed`."""
    _ask("stop", DAEMON)


def start_daemon() -> None:
    """Let the daemon start; does not wait, since whether it works is seen at its answers. Raises `UpdateFailed`."""
    _ask("--no-block", "start", DAEMON)


def reload_units() -> None:
    """Read the unit files again, which the link `current` has exchanged. Raises `UpdateFailed`."""
    _ask("daemon-reload")


def _ask(*words: str) -> None:
    remedy = "Look into `journalctl -u tsis`."
    try:
        done = subprocess.run(["systemctl", *words], capture_output=True, text=True, timeout=WITHIN_S)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise UpdateFailed(f"systemctl {' '.join(words)} failed: {error}.", remedy) from None
    if done.returncode and (words[0], done.returncode) != ("stop", NOT_LOADED):
        said = " ".join(done.stderr.split()) or f"exit code {done.returncode}"
        raise UpdateFailed(f"systemctl {' '.join(words)} failed: {said}.", remedy)
