"""The folder in which others leave what is to be done: a release file, or the wish for the previous release.

Its writers (the ssh account of `make deploy`, the daemon for its REST upload) are not trusted: root takes a file out
of their reach before it looks at it, and believes only what the signature says.
"""

from __future__ import annotations

import errno
import shutil
from contextlib import suppress
from pathlib import Path

from device.errors import BusyError, UpdateFailed
from device.files.handed_over import PART, HandedOverFile, is_held
from device.update.layout import UpdateLayout
from device.update.progress import file_id

MOST_BYTES = 2**31
BUSY = "Wait until it has ended: progress.json, the screen and `python -m device.update status` tell."


class Upload:
    """A release file on its way in: written piece by piece, then handed over whole, or abandoned without a trace."""

    def __init__(self, layout: UpdateLayout) -> None:
        """Begin. Raises `UpdateFailed` when the folder cannot be written, `BusyError` when another one waits there."""
        self._layout = layout
        try:
            if layout.uploaded.exists():
                raise BusyError("Another release waits to be installed.", BUSY)
            self._file = HandedOverFile(layout.incoming)
        except OSError as error:
            raise _failed(error) from None

    def write(self, piece: bytes) -> None:
        """Take the next piece. Raises `UpdateFailed` when there is no space, or it becomes too large."""
        if self._file.bytes_written + len(piece) > MOST_BYTES:
            raise UpdateFailed(f"The release file has more than {MOST_BYTES} bytes.", "Send a release file.")
        try:
            self._file.write(piece)
        except OSError as error:
            raise _failed(error) from None

    def hand_over(self) -> str:
        """Let the updater see the file; return how it is named in the progress. Raises `BusyError`, `UpdateFailed`."""
        try:
            return file_id(self._file.hand_over(self._layout.uploaded.name))
        except FileExistsError:
            raise BusyError("Another release waits to be installed.", BUSY) from None
        except OSError as error:
            raise _failed(error) from None

    def abandon(self) -> None:
        """Remove what has come so far."""
        self._file.discard()


def ask_for_roll_back(layout: UpdateLayout) -> None:
    """Ask for the previous release. Raises `UpdateFailed` when the folder cannot be written."""
    try:
        layout.roll_back_request.touch()
    except OSError as error:
        raise _failed(error, "The wish to go back") from None


def withdraw(layout: UpdateLayout, file: str) -> None:
    """Remove a request that nobody took, named as in the progress."""
    for path in (layout.uploaded, layout.roll_back_request):
        with suppress(OSError):
            if file_id(path.stat()) == file:
                path.unlink()


def take_uploaded(layout: UpdateLayout) -> bool:
    """Move the release file that waits out of its sender's reach; return whether there was one. Raises `OSError`."""
    _remove(layout.taken)
    try:
        layout.uploaded.rename(layout.taken)
    except FileNotFoundError:
        return False
    return True


def take_roll_back_request(layout: UpdateLayout) -> str | None:
    """Remove the wish for the previous release; return how it is named in the progress, or None. Raises `OSError`."""
    try:
        asked = file_id(layout.roll_back_request.lstat())
    except FileNotFoundError:
        return None
    _remove(layout.roll_back_request)
    return asked


def clear_incoming(layout: UpdateLayout) -> None:
    """Remove what an interrupted update or upload left; what waits stays. Raises `OSError`."""
    _remove(layout.taken)
    for path in layout.incoming.glob(f"{PART}*"):
        if not is_held(path):
            _remove(path)


def _remove(path: Path) -> None:
    """Remove whatever a stranger has put there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _failed(error: OSError, what: str = "The release file") -> UpdateFailed:
    remedy = "Free space." if error.errno == errno.ENOSPC else "Use sudo, or an account of the group tsis-update."
    return UpdateFailed(f"{what} could not be put on the probe: {error}.", remedy)
