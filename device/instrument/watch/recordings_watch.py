"""Whether the recordings are still as they were kept: the newest looked at after each start, then one a minute.

A thread of its own reads and hashes them, one after the other, so that no start and no press waits for it: a start
looks at names and sizes only. A recording of before there were hashes gets its own first. One that is damaged is told
with the next press, or while nobody presses, and is not handed out. Once an hour, and while there is too little space,
it deletes what the settings' rule lets it: see device/records/retention.py. By age it deletes nothing until the wall
clock has run for a while as it is: a board without a battery starts at some old date, and a server may be wrong.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Iterator
from dataclasses import replace

from device.config import Config
from device.errors import DamagedRecordingError, DeviceError
from device.instrument.watch.clock_watch import ClockWatch
from device.records.recordings import damaged_recordings
from device.records.retention import RetentionRule
from device.records.store import Store

log = logging.getLogger(__name__)
NEWEST = 20
RETAIN_EVERY_S = 3600.0
SOON_S, LATER_S = 0.05, 60.0
"""Between two recordings: of the newest and of those without a hash, and of all others."""


def retention_rule(config: Config) -> RetentionRule:
    """Return the rule that the settings give."""
    said = config.retention
    return RetentionRule(said.keep_days, said.free_mb, said.saved_first)


class RecordingsWatch:
    """Looks from its start until it is closed. `taken` may be called from any thread."""

    def __init__(self, store: Store, clock: ClockWatch, rule: RetentionRule | None = None) -> None:
        self._store, self._clock, self._rule = store, clock, rule or RetentionRule()
        self._stopping = threading.Event()
        self._retained_s = -math.inf
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

    def retain(self) -> None:
        """Delete what the rule deletes now, unless that was looked at within the hour and there is space."""
        rule = self._rule if self._clock.is_steady else replace(self._rule, keep_days=None)
        now_s = time.monotonic()
        is_short = rule.free_mb is not None and self._store.free_mb < rule.free_mb
        if is_short or (rule.keep_days is not None and now_s - self._retained_s >= RETAIN_EVERY_S):
            self._retained_s = now_s
            for one in self._store.retention.carry_out(rule).removals:
                log.info("the recording %s was deleted: %s", one.recording_id, one.why)

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                self._look_at_all()
            except (DeviceError, OSError) as error:  # of a store that is at fault the procedure tells
                log.error("recordings are looked at again in %g s: %s", LATER_S, error)
                self._stopping.wait(LATER_S)

    def _look_at_all(self) -> None:
        for recording_id, wait_s in self._turns():
            self.look(recording_id)
            self.retain()
            if self._stopping.wait(wait_s):
                return

    def _turns(self) -> Iterator[tuple[str, float]]:
        for recording_id in (*self._store.recordings.unnoted(), *self._store.recordings.newest()[:NEWEST]):
            yield recording_id, SOON_S
        self.retain()
        while not self._stopping.wait(LATER_S):
            self.retain()
            for recording_id in self._store.recordings.newest():
                yield recording_id, LATER_S
