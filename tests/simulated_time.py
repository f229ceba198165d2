"""A clock that no load can make late: threads run one at a time, and time moves only when every one of them waits.

Each thread keeps its turn until it sleeps or waits; then the first that may go on goes on, and when none may, the
earliest time that one waits for is come. So what the device's own threads do is the same on a busy machine, and takes
no longer than its computing. A wait for a process or a socket is not known here: time stands still in it.
"""

from __future__ import annotations

import math
import sys
import threading
import time
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import pytest

STUCK_S = 120.0
"""Real seconds for which a thread may wait for its turn: then another one hangs."""


@dataclass(eq=False)
class Wait:
    """A thread that waits until something is true, or until a time (ns)."""

    is_over: Callable[[], bool]
    until_ns: float
    turn: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))

    def begin(self) -> None:
        """Keep the thread until its turn has come."""
        assert self.turn.acquire(timeout=STUCK_S), "another thread does not give its turn away"


class SimulatedTime:
    """The clock of the thread that makes it, and of those that are started by `SimulatedThread`."""

    def __init__(self, start_s: float = 1000.0) -> None:
        self._now_ns, self._waiting = round(1e9 * start_s), list[Wait]()
        self._wall_less_monotonic_s = time.time() - start_s

    def monotonic_ns(self) -> int:
        return self._now_ns

    def monotonic(self) -> float:
        return 1e-9 * self._now_ns

    def wall(self) -> float:
        return self.monotonic() + self._wall_less_monotonic_s

    def sleep(self, seconds: float) -> None:
        self.wait(lambda: False, seconds)

    def wait(self, is_over: Callable[[], bool], timeout_s: float | None = None) -> bool:
        """Let the other threads run until something is true, or for a time; return whether it is true."""
        until_ns = math.inf if timeout_s is None else self._now_ns + math.ceil(1e9 * max(timeout_s, 0.0))
        mine = self.queued(is_over, until_ns)
        self.pass_on()
        mine.begin()
        return is_over()

    def queued(self, is_over: Callable[[], bool], until_ns: float = math.inf) -> Wait:
        """Return the place in the queue of a thread that is about to wait."""
        self._waiting.append(Wait(is_over, until_ns))
        return self._waiting[-1]

    def pass_on(self) -> None:
        """Give the turn to the first thread that may go on; when none may, now is the earliest time waited for."""
        while not (free := next((one for one in self._waiting if self._may_go_on(one)), None)):
            earliest_ns = min((one.until_ns for one in self._waiting), default=math.inf)
            assert earliest_ns < math.inf, "every thread waits for another"
            self._now_ns = int(earliest_ns)
        self._waiting.remove(free)
        free.turn.release()

    def _may_go_on(self, one: Wait) -> bool:
        return one.until_ns <= self._now_ns or one.is_over()

    def replace(self, package: str, monkeypatch: pytest.MonkeyPatch) -> None:
        """Put this clock where modules of a package have `time`, `threading`, or a function of `time` as default."""
        own_time = {"monotonic": self.monotonic, "monotonic_ns": self.monotonic_ns, "time": self.wall}
        classes = {"Thread": SimulatedThread, "Event": SimulatedEvent, "Lock": SimulatedLock}
        own_threading = {name: partial(kind, self) for name, kind in classes.items()}
        own_threading["Condition"] = partial(SimulatedCondition, self)
        stand_ins = {
            "time": types.SimpleNamespace(**vars(time) | own_time | {"sleep": self.sleep}),
            "threading": types.SimpleNamespace(**vars(threading) | own_threading),
        }
        for module in [one for name, one in sys.modules.items() if f"{name}.".startswith(f"{package}.")]:
            for name, stand_in in stand_ins.items():
                if getattr(module, name, None) is sys.modules[name]:
                    monkeypatch.setattr(module, name, stand_in)
            for function in _functions(module):
                self._replace_defaults(function, monkeypatch)

    def _replace_defaults(self, function: types.FunctionType, monkeypatch: pytest.MonkeyPatch) -> None:
        def other(value: Any) -> Any:
            return self.monotonic if value is time.monotonic else self.wall if value is time.time else value

        if time.monotonic in (defaults := list(function.__defaults__ or ())) or time.time in defaults:
            monkeypatch.setattr(function, "__defaults__", tuple(map(other, defaults)))
        if time.monotonic in (named := function.__kwdefaults__ or {}).values() or time.time in named.values():
            monkeypatch.setattr(function, "__kwdefaults__", {name: other(value) for name, value in named.items()})


def _functions(module: types.ModuleType) -> Iterator[types.FunctionType]:
    for value in list(vars(module).values()):
        members = vars(value).values() if isinstance(value, type) and value.__module__ == module.__name__ else [value]
        yield from (one for one in members if isinstance(one, types.FunctionType))


class SimulatedEvent:
    """`threading.Event`."""

    def __init__(self, clock: SimulatedTime) -> None:
        self._clock, self._is_set = clock, False

    def is_set(self) -> bool:
        return self._is_set

    def set(self) -> None:
        self._is_set = True

    def clear(self) -> None:
        self._is_set = False

    def wait(self, timeout: float | None = None) -> bool:
        return self._clock.wait(self.is_set, timeout)


class SimulatedLock:
    """`threading.Lock`."""

    def __init__(self, clock: SimulatedTime) -> None:
        self._clock, self._is_held = clock, False

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(self, *error: object) -> None:
        self.release()

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        if self._is_held and blocking:
            self._clock.wait(lambda: not self._is_held, None if timeout < 0 else timeout)
        is_mine, self._is_held = not self._is_held, True
        return is_mine

    def release(self) -> None:
        self._is_held = False

    def locked(self) -> bool:
        return self._is_held


class SimulatedCondition(SimulatedLock):
    """`threading.Condition`, with a lock of its own that is taken once."""

    def __init__(self, clock: SimulatedTime) -> None:
        super().__init__(clock)
        self._notes = 0

    def wait(self, timeout: float | None = None) -> bool:
        seen = self._notes
        self.release()
        is_notified = self._clock.wait(lambda: self._notes > seen, timeout)
        self.acquire()
        return is_notified

    def wait_for(self, predicate: Callable[[], Any], timeout: float | None = None) -> Any:
        self.release()
        self._clock.wait(lambda: not self._is_held and bool(predicate()), timeout)
        self.acquire()
        return predicate()

    def notify_all(self) -> None:
        self._notes += 1


class SimulatedThread:
    """`threading.Thread`: a thread that runs when it has the turn."""

    def __init__(
        self, clock: SimulatedTime, *, target: Callable[[], None], name: str = "", daemon: bool = True
    ) -> None:
        self._clock, self._target, self._is_alive = clock, target, False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        self._is_alive, self._first_turn = True, self._clock.queued(lambda: True)
        self._thread.start()

    def _run(self) -> None:
        self._first_turn.begin()
        try:
            self._target()
        finally:
            self._is_alive = False
            self._clock.pass_on()

    def is_alive(self) -> bool:
        return self._is_alive

    def join(self, timeout: float | None = None) -> None:
        self._clock.wait(lambda: not self._is_alive, timeout)
