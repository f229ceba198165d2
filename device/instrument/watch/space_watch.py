"""Whether the disk will soon be full: told while presses are still taken, in time to export, and to make space.

The store refuses a press below `store.min_free_mb` (E602); this warns from `Config.warn_free_mb` on, and is over by
itself once there is space again.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence

from device.config import Config
from device.errors import DeviceError, StorageLowError
from device.records.store import Store

log = logging.getLogger(__name__)
STEP_MB = 10
"""So finely it is told how much is left: another sentence after each press would be another warning each time."""
REMEDY = "Export the exams, back up with `python -m device backup FOLDER`, and free space or set retention.free_mb."


class SpaceWatch:
    """Looks at the space that is left for a store."""

    def __init__(self, store: Store, config: Config) -> None:
        self._store, self._config = store, config
        self._warning: StorageLowError | None = None

    def warned(self, others: Sequence[DeviceError]) -> tuple[DeviceError, ...]:
        """Return these warnings with that of the disk brought up to date; a disk that is full is a fault instead.

        Raises `StorageError` when nobody can say how much is left.
        """
        left_mb, warn_mb = self._store.free_mb, self._config.warn_free_mb
        self._note(left_mb if self._config.store.min_free_mb <= left_mb < warn_mb else None)
        own = (self._warning,) if self._warning else ()
        return (*(one for one in others if not isinstance(one, StorageLowError)), *own)

    def _note(self, low_mb: float | None) -> None:
        if low_mb is None:
            self._warning = None
            return
        told_mb = STEP_MB * int(low_mb // STEP_MB)
        cause = f"The disk of {self._store.folder} has some {told_mb} MB left, below {self._config.warn_free_mb:g} MB."
        if self._warning is None or self._warning.cause != cause:
            self._warning = StorageLowError(cause, REMEDY)
            log.warning("%s %s", self._warning.code, self._warning)
