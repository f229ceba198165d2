"""What is kept of the press under way besides its frames: its job, its warnings, how it failed, and the light it took.

The store first, then the board: whoever reads that a press has changed finds it kept.
"""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Any

from device.errors import DeviceError
from device.instrument.light_budget import LightBudget
from device.instrument.status import PressJob, StatusBoard
from device.records.store import ENDED, Store

log = logging.getLogger(__name__)

SAVE_LIGHT_EVERY_S = 10.0
"""So much light may be missing from the hours counter after a power cut, and that of the press under way."""


class PressBook:
    """Keeps one press after the other; the procedure's thread alone writes in it."""

    def __init__(self, board: StatusBoard, store: Store, budget: LightBudget) -> None:
        self._board, self._store, self._budget = board, store, budget

    def note(self, job: PressJob, **changes: Any) -> None:
        """Keep and show what has changed of a press, with the warnings and the light until now."""
        warnings = tuple(warning.as_record() for warning in self._board.now.warnings)
        light_on_s = round(self._budget.press_s, 2)
        changed = replace(self._board.now.press or job, warnings=warnings, light_on_s=light_on_s, **changes)
        self._store.save_press(changed.as_record())
        self._board.update(press=changed)

    def warn(self, warning: DeviceError | None) -> None:
        """Show what does not end a press; the next `note` keeps it with the press."""
        if warning:
            log.warning("%s %s", warning.code, warning)
            others = tuple(one for one in self._board.now.warnings if one.code != warning.code)
            self._board.update(warnings=(*others, warning))

    def fail(self, waiting: PressJob | None, end: DeviceError) -> None:
        """End the press that waits, or is under way, so that the next may begin: also when the store is at fault."""
        job = waiting or self._board.now.press
        if job is None or job.state in ENDED:
            return
        light_on_s = 0.0 if waiting else round(self._budget.press_s, 2)
        failed = replace(job, state="failed", reason=str(end), code=end.code, light_on_s=light_on_s)
        self._board.update(press=failed)
        try:
            self._store.save_press(failed.as_record())
        except DeviceError as error:
            log.error("%s %s", error.code, error)

    def save_light_hours(self, *, at_least_s: float = 0.0) -> None:
        """Add the light since the last time to the hours counter, unless it is less than `at_least_s`."""
        seconds = self._budget.unsaved_s
        if seconds >= at_least_s:
            self._store.add_light_on_s(seconds)
            self._budget.note_saved(seconds)
