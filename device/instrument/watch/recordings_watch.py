"""Whether the recordings are still as they were kept: the newest looked at after each start, then one a minute.

A thread of its own reads and hashes them, one after the other, so that no start and no press waits for it: a start
looks at names and sizes only. A recording of before there were hashes gets its own first. One that is damaged is told
with the next press, or while nobody presses, and is not handed out.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator

from device.errors import DamagedRecordingError, DeviceError
from device.records.recordings import damaged_recordings
from device.records.store import Store

log = logging.getLogger(__name__)
NEWEST = 20
SOON_S, LATER_S = 0.05, 60.0
"""Between two recordings: of the newest and of those without a hash, and of all others."""


class RecordingsWatch:
    """Looks from its start until it is closed. `taken` may be called from any thread."""

    def __init__(self, store: Store) -> None:
        self._store, self._stopping = store, threading.Event()
        self._damaged = dict.fromkeys((*store.findings.missing, *store.findings.resized))
        self._told = len(self._damaged)
        self._thread = threading.Thread(target=self._run, name="recordings", daemon=True)

    def start(self) -> None:
        """Look from now on."""
        self._thread.start()

    def close(self) -> None:
        """Look no more; a look that hangs is left alone."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(timeout=1.0)

    def taken(self) -> tuple[DamagedRecordingError, ...]:
        """Return the warning of all damaged recordings when there are more than the last time."""
        damaged = tuple(self._damaged)
        if len(damaged) == self._told:
            return ()
        self._told = len(damaged)
        return (damaged_recordings(damaged),)

    def look(self, recording_id: str) -> None:
        """Look at one recording."""
        if recording_id not in self._damaged and not self._store.recordings.check(recording_id):
            log.error("the recording %s is missing or not as it was kept", recording_id)
            self._damaged[recording_id] = None

    def _run(self) -> None:
        try:
            for recording_id, wait_s in self._turns():
                self.look(recording_id)
                if self._stopping.wait(wait_s):
                    return
        except DeviceError as error:  # of a store that is at fault the procedure tells
            log.error("%s %s", error.code, error)

    def _turns(self) -> Iterator[tuple[str, float]]:
        for recording_id in (*self._store.recordings.unnoted(), *self._store.recordings.newest()[:NEWEST]):
            yield recording_id, SOON_S
        while not self._stopping.wait(LATER_S):
            for recording_id in self._store.recordings.newest():
                yield recording_id, LATER_S
