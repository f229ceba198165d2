"""How far the update under way is, for whoever waits for it: the screen, `make deploy`, a person at the probe.

A file that is replaced whole; it is not synchronised, since after a power cut state.json alone decides. That it
cannot be written, as on a full disk, stops no update.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from typing import Literal

from device.errors import DeviceError
from device.update.layout import UpdateLayout

SCHEMA = "tsis.update/1"
StateName = Literal["idle", "verifying", "unpacking", "switching", "checking", "committed", "rolled_back", "refused"]
ENDED = ("committed", "rolled_back", "refused")


@dataclass(frozen=True)
class UpdateProgress:
    """One moment of an update; `progress` runs from 0 to 1, `file` is the file it began with (`file_id`)."""

    state: StateName = "idle"
    release: str = ""
    progress: float = 0.0
    step: str = ""
    reason: str = ""
    code: str | None = None
    file: str = ""

    def __str__(self) -> str:
        told = f" {self.code}" if self.code else ""
        reason = f": {self.reason}" if self.reason else ""
        step = f", {self.step}" if self.step else ""
        return f"{self.progress:4.0%} {self.release} {self.state}{step}{told}{reason}"


class ProgressReport:
    """Tells each moment to progress.json, and to `listener`."""

    def __init__(self, layout: UpdateLayout, listener: Callable[[UpdateProgress], None] = lambda moment: None) -> None:
        self._layout, self._listener = layout, listener
        self.file, self.release = "", ""
        self._last = UpdateProgress()

    def tell(self, state: StateName, progress: float, step: str = "") -> None:
        """Say where the update is; less than a hundredth of progress within a step is passed over."""
        moment = UpdateProgress(state, self.release, round(progress, 2), step, file=self.file)
        if moment != self._last:
            self._write(moment)

    def end(self, state: StateName, error: DeviceError | None = None, step: str = "") -> None:
        """Say how the update ended."""
        reason, code = (str(error), error.code) if error else ("", None)
        self._write(UpdateProgress(state, self.release, 1.0, step, reason, code, self.file))

    def _write(self, moment: UpdateProgress) -> None:
        self._last = moment
        with suppress(OSError):
            _replace(self._layout, json.dumps({"schema": SCHEMA, **asdict(moment)}))
        with suppress(OSError):  # whoever read it may be gone, as with a terminal that was closed
            self._listener(moment)


def read_progress(layout: UpdateLayout) -> UpdateProgress:
    """Return the last moment that was told; idle when there is none that can be read."""
    try:
        record = json.loads(layout.progress.read_bytes())
        if record.pop("schema") != SCHEMA:
            return UpdateProgress()
        known = {one.name for one in fields(UpdateProgress)}  # a later updater, whose file it is, may tell more
        return UpdateProgress(**{name: value for name, value in record.items() if name in known})
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return UpdateProgress()


def file_id(status: os.stat_result) -> str:
    """Return what stays the same when a file is renamed: an uploader knows its own file again by it."""
    return f"{status.st_ino}.{status.st_mtime_ns}"


def _replace(layout: UpdateLayout, text: str) -> None:
    temporary = layout.progress.with_name("progress.json.tmp")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(layout.progress)
