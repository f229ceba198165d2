"""Which parts of the probe go on: each loop says when it is in a part and when it has come out of it again.

A loop that is in one part cannot be in another: that time is not held against the others, so that the part which
stopped is the one that is named. A fault that a part answers with is on the screen and ends by itself or by a hand, so
it counts as going on; only for a camera whose process lives and gives no frames a restart of the daemon is the remedy.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

from device.errors import CameraProcessError, DeviceError

Part = Literal["camera", "light", "force", "inference", "storage"]
BEAT_S = 1.0
"""A part that has not been used for so long is exercised: seldom enough to cost nothing."""


@dataclass(frozen=True)
class PartKind:
    """What a part is called, whose loop uses it, and how many times the watchdog's time it may be silent.

    `may_fail`: the faults that count as going on when it answers with them.
    """

    words: str
    loop: Literal["procedure", "force"]
    limit_ratio: float
    may_fail: type[Exception] = Exception


PARTS: dict[Part, PartKind] = {
    "camera": PartKind("the camera", "procedure", 2.0, may_fail=CameraProcessError),
    "light": PartKind("the LED chip", "procedure", 0.5),
    "force": PartKind("the load cell", "force", 0.3),
    "inference": PartKind("the inference", "procedure", 2.0),
    "storage": PartKind("the disk", "procedure", 2.0),
}
"""A camera's process that hung is ended and started again within 25 s. An estimate of mode precise takes 3 s on a
workstation, some times that on the probe's board; its recording is 88 files, each brought to the disk by itself."""


@dataclass(frozen=True)
class Stall:
    """Parts that make no progress, for how long (s), and whether their loops still come back with a fault."""

    parts: tuple[Part, ...]
    silent_s: float
    comes_back: bool

    def __str__(self) -> str:
        *others, last = (PARTS[part].words for part in self.parts)
        return f"{', '.join(others)}{' and ' if others else ''}{last} made no progress for {self.silent_s:.1f} s"


@dataclass(frozen=True)
class LastSeen:
    """When a part last did what it was asked for, and the error of the last time, if that was in vain.

    `ago_s`: so long ago, infinite if never; `idle_s`: the same without the time its loop has spent in other parts.
    """

    ago_s: float
    idle_s: float
    error: DeviceError | None


class ProgressBoard:
    """When each part last made progress (s, monotonic). May be asked from any thread."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock, self._lock = clock, threading.Lock()
        self._progress_s = dict.fromkeys(PARTS, clock())
        self._worked_s = dict.fromkeys(PARTS, -math.inf)
        self._awaited_s = dict(self._worked_s)
        self._errors: dict[Part, DeviceError | None] = dict.fromkeys(PARTS)
        self._returned_s = dict(self._progress_s)
        self._entered: dict[str, tuple[Part, float]] = {}
        self._exercises: dict[Part, tuple[Callable[[], None], float | None]] = {}

    @contextmanager
    def inside(self, part: Part) -> Iterator[None]:
        """Be in a part: frozen unless it is left in time. A loop is in one part at a time."""
        begun_s, error = self._clock(), None
        with self._lock:
            self._entered[PARTS[part].loop] = part, begun_s
        try:
            yield
        except BaseException as failure:
            error = failure
            raise
        finally:
            self._leave(part, begun_s, error)

    def _leave(self, part: Part, begun_s: float, error: BaseException | None) -> None:
        with self._lock:
            now_s = self._clock()
            for other, kind in PARTS.items():
                if other != part and kind.loop == PARTS[part].loop:
                    self._progress_s[other] += now_s - begun_s
                    self._awaited_s[other] += now_s - begun_s
            del self._entered[PARTS[part].loop]
            self._returned_s[part] = now_s
            if error is None or isinstance(error, PARTS[part].may_fail):
                self._progress_s[part] = now_s
            if error is None:
                self._worked_s[part] = self._awaited_s[part] = now_s
            self._errors[part] = error if isinstance(error, DeviceError) else None

    def exercise(self, part: Part, action: Callable[[], None], every_s: float | None = None) -> None:
        """Use a part by `action` at each beat that finds it idle for so long, a second unless told otherwise."""
        self._exercises[part] = action, every_s

    def beat(self) -> None:
        """Exercise the parts that have been idle for long enough; then raise the first `DeviceError` of any."""
        faults = []
        for part, (action, every_s) in self._exercises.items():
            if self._clock() - self._returned_s[part] >= (BEAT_S if every_s is None else every_s):
                try:
                    action()
                except DeviceError as error:
                    faults.append(error)
        if faults:
            raise faults[0]

    def last_seen(self, part: Part) -> LastSeen:
        """Return when a part last worked, in its own loop's time and in everybody's."""
        with self._lock:
            now_s = self._clock()
            idle_s = self._until_s(part, now_s) - self._awaited_s[part]
            return LastSeen(now_s - self._worked_s[part], idle_s, self._errors[part])

    def stall(self, watchdog_s: float) -> Stall | None:
        """Return what has made no progress for longer than its part of the watchdog's time, or None."""
        with self._lock:
            now_s = self._clock()
            silent_s = {part: self._until_s(part, now_s) - self._progress_s[part] for part in PARTS}
            still = [part for part, kind in PARTS.items() if silent_s[part] > kind.limit_ratio * watchdog_s]
            if not still:
                return None
            comes_back = all(now_s - self._returned_s[part] <= watchdog_s for part in still)
        return Stall(tuple(still), max(silent_s[part] for part in still), comes_back)

    def _until_s(self, part: Part, now_s: float) -> float:
        """Return until when a part's silence counts: its loop may be in another part."""
        entered, begun_s = self._entered.get(PARTS[part].loop, (part, now_s))
        return now_s if entered == part else begun_s
