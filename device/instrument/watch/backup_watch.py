"""Whether measurements have been in no backup for too long: a card that fails loses them, and a rule deletes nothing.

Nothing tells the probe that a stick was lost; what it knows is what the last backup held when it was read back.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

from device.errors import BackupOverdue, DeviceError
from device.records.store import Store

log = logging.getLogger(__name__)
EVERY_S = 60.0
"""So often the database is asked; a warning goes so soon after a backup."""
REMEDY = "Mount a stick and run `python -m device backup FOLDER`, as docs/care.md says."


class BackupWatch:
    """Looks at what no backup of a store holds; `warn_days` 0 is never."""

    def __init__(self, store: Store, warn_days: float, every_s: float = EVERY_S) -> None:
        self._store, self._warn_days, self._every_s = store, warn_days, every_s
        self._warning: BackupOverdue | None = None
        self._looked_s = -math.inf

    def warned(self, others: Sequence[DeviceError]) -> tuple[DeviceError, ...]:
        """Return these warnings with that of the backup brought up to date; raise `StorageError` when it is unknown."""
        now_s = time.monotonic()
        if self._warn_days and now_s - self._looked_s >= self._every_s:
            self._note(self._store.unsaved().since)
            self._looked_s = now_s
        own = (self._warning,) if self._warning else ()
        return (*(one for one in others if not isinstance(one, BackupOverdue)), *own)

    def _note(self, since: str | None) -> None:
        if since is None or datetime.now(UTC) - datetime.fromisoformat(since) <= timedelta(days=self._warn_days):
            self._warning = None
            return
        cause = f"Measurements since {since[:10]} are in no backup, for more than {self._warn_days:g} days."
        if self._warning is None or self._warning.cause != cause:
            self._warning = BackupOverdue(cause, REMEDY)
            log.warning("%s %s", self._warning.code, self._warning)
