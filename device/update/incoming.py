"""The folder in which others leave what is to be done: a release file, or the wish for the previous release.

Its writers (the ssh account of `make deploy`, the daemon for its REST upload) are not trusted: root takes a file out
of their reach before it looks at it, and believes only what the signature says.
"""

from __future__ import annotations

import errno
import fcntl
import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

from device.errors import BusyError, UpdateFailed
from device.update.layout import UpdateLayout
from device.update.progress import file_id

PART = ".upload-"
MOST_BYTES = 2**31
BUSY = "Wait until it has ended: progress.json, the screen and `python -m device.update status` tell."


class Upload:
    """A release file on its way in: written piece by piece, then handed over whole, or abandoned without a trace."""

    def __init__(self, layout: UpdateLayout) -> None:
        """Begin. Raises `UpdateFailed` when the folder cannot be written, `BusyError` when another one waits there."""
        self._layout, self._bytes = layout, 0
        try:
            if layout.uploaded.exists():
                raise BusyError("Another release waits to be installed.", BUSY)
            handle, name = tempfile.mkstemp(prefix=PART, dir=layout.incoming)
        except OSError as error:
            raise _failed(error) from None
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)  # what nobody holds was left by somebody who is gone
        self._file, self._path = os.fdopen(handle, "wb"), Path(name)

    def write(self, piece: bytes) -> None:
        """Take the next piece. Raises `UpdateFailed` when there is no space, or it becomes too large."""
        self._bytes += len(piece)
        if self._bytes > MOST_BYTES:
            raise UpdateFailed(f"The release file has more than {MOST_BYTES} bytes.", "Send a release file.")
        try:
            self._file.write(piece)
        except OSError as error:
            raise _failed(error) from None

    def hand_over(self) -> str:
        """Let the updater see the file; return how it is named in the progress. Raises `BusyError`, `UpdateFailed`."""
        try:
            self._file.flush()
            os.fchmod(self._file.fileno(), 0o640)
            os.fsync(self._file.fileno())
            os.link(self._path, self._layout.uploaded)  # unlike a rename it replaces nothing
        except FileExistsError:
            raise BusyError("Another release waits to be installed.", BUSY) from None
        except OSError as error:
            raise _failed(error) from None
        finally:
            identifier = file_id(os.fstat(self._file.fileno()))
            self.abandon()
        return identifier

    def abandon(self) -> None:
        """Remove what has come so far."""
        self._path.unlink(missing_ok=True)
        with suppress(OSError):  # on a full disk closing writes what is left, in vain
            self._file.close()


def ask_for_roll_back(layout: UpdateLayout) -> None:
    """Ask for the previous release. Raises `UpdateFailed` when the folder cannot be written."""
    try:
        layout.roll_back_request.touch()
    except OSError as error:
        raise _failed(error) from None


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
        if not _is_held(path):
            _remove(path)


def _is_held(path: Path) -> bool:
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(handle)
    return False


def _remove(path: Path) -> None:
    """Remove whatever a stranger has put there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _failed(error: OSError) -> UpdateFailed:
    remedy = "Free space." if error.errno == errno.ENOSPC else "Use sudo, or an account of the group tsis-update."
    return UpdateFailed(f"The release file could not be put on the probe: {error}.", remedy)
