"""The ways out that the page offers at the probe: back to the last good release, and a support file.

Neither is done here: the updater, which is root's, sees a file appear; the support file has a command of its own.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
from pathlib import Path

from device.errors import BusyError, DeviceError, NotSetUp
from device.fallback.situation import NOTES, Situation
from device.files.handed_over import HandedOverFile

ROLL_BACK = f"{NOTES}/incoming/roll_back"
SUPPORT = "device.commands.support"
SUPPORT_S = 60.0


def roll_back(root: Path, situation: Situation) -> None:
    """Ask the updater for the last good release.

    Raises `NotSetUp` when there is none, `BusyError` when it was asked already, `DeviceError` when it cannot be.
    """
    if not situation.may_roll_back:
        raise NotSetUp("There is no other release on this probe.", "Install one: `make deploy`, or a USB stick.")
    path = root / ROLL_BACK
    try:
        HandedOverFile(path.parent).hand_over(path.name)
    except FileExistsError:
        raise BusyError("The probe was asked to go back already.", "Wait a minute, or switch it off and on.") from None
    except OSError as error:
        raise DeviceError(
            f"The updater cannot be asked: {error.strerror}.", "Install a release: `make deploy`."
        ) from None


def has_support() -> bool:
    """Return whether this release has the command that writes a support file."""
    try:
        return importlib.util.find_spec(SUPPORT) is not None
    except ImportError:
        return False


def support_file() -> bytes:
    """Return a support file, a zip. Raises `DeviceError` when its command writes none."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "support.zip"
        try:
            done = subprocess.run(
                [sys.executable, "-m", SUPPORT, str(path)],
                capture_output=True, text=True, errors="replace", timeout=SUPPORT_S, check=False,
            )  # fmt: skip
            if done.returncode == 0:
                return path.read_bytes()
            reason = done.stderr.strip().rpartition("\n")[2] or f"exit code {done.returncode}"
        except (OSError, subprocess.TimeoutExpired) as error:
            reason = str(error)
    raise DeviceError(f"The support file was not written: {reason}.", "Fetch the log: `journalctl -u tsis`.")
