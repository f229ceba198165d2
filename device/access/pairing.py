"""Pairing: a short code on the probe's own screen, which another machine brings within minutes for a token.

Whoever guesses is slowed down by his address, and no other; after some wrong codes in all the code is void, so that
many addresses are of no use either. A wrong code, an old one and none at all are answered alike.
"""

from __future__ import annotations

import hmac
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from device.access.scopes import Scope
from device.errors import TooManyTries, WrongCode

SIGNS = "23456789ABCDEFGHJKLMNPQRSTUVWXYZ"
"""Those of a code: none that looks like another one."""
CODE_SIGNS = 8
"""Of 32 signs each: 40 bits, of which one has as many tries as the bounds below."""
VALID_S = 300.0
TRIES_OF_ONE, TRIES_WITHIN_S = 5, 60.0
TRIES_IN_ALL = 20
MOST_ADDRESSES = 1000


@dataclass(frozen=True)
class PairingCode:
    """A code, for whom it is, what his token will be allowed and for how many days; it ends at a time (s)."""

    code: str
    name: str
    scope: Scope
    days: int
    until_s: float

    @property
    def shown(self) -> str:
        """The code as it is read out."""
        return f"{self.code[:4]}-{self.code[4:]}"


class TryLimit:
    """How often one address may be wrong: some times a minute, whatever the others do."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock, self._lock = clock, threading.Lock()
        self._wrong: dict[str, list[float]] = {}

    def require(self, address: str) -> None:
        """Raise `TooManyTries` for an address that was wrong too often just now."""
        with self._lock:
            recent = self._recent(address)
            if len(recent) >= TRIES_OF_ONE:
                wait_s = max(1, round(recent[0] + TRIES_WITHIN_S - self._clock()))
                cause = f"{address} was wrong {len(recent)} times within {TRIES_WITHIN_S:g} s."
                refusal = TooManyTries(cause, f"Wait {wait_s} s.")
                refusal.wait_s = wait_s
                raise refusal

    def note(self, address: str) -> None:
        """Count a wrong try."""
        with self._lock:
            if len(self._wrong) >= MOST_ADDRESSES:
                self._wrong.pop(next(iter(self._wrong)))
            self._wrong[address] = [*self._recent(address), self._clock()]

    def _recent(self, address: str) -> list[float]:
        now_s = self._clock()
        return [at_s for at_s in self._wrong.get(address, []) if now_s - at_s < TRIES_WITHIN_S]


class Pairing:
    """At most one code at a time; all methods may be called from any thread."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock, self._lock = clock, threading.Lock()
        self.limit = TryLimit(clock)
        self._code: PairingCode | None = None
        self._tries = 0

    def begin(self, name: str, scope: Scope, days: int) -> PairingCode:
        """Return a new code; the one before ends."""
        code = "".join(secrets.choice(SIGNS) for _ in range(CODE_SIGNS))
        with self._lock:
            self._code, self._tries = PairingCode(code, name, scope, days, self._clock() + VALID_S), 0
            return self._code

    def present(self) -> PairingCode | None:
        """Return the code that can be brought now."""
        with self._lock:
            return self._present()

    def left_s(self, code: PairingCode) -> float:
        """Return how long a code still holds (s)."""
        return max(0.0, code.until_s - self._clock())

    def end(self) -> None:
        """Let the code hold no more."""
        with self._lock:
            self._code = None

    def claim(self, brought: str, address: str) -> PairingCode:
        """Return what a code is for, and end it.

        Raises `WrongCode`, and `TooManyTries` for an address that was wrong too often, right or wrong.
        """
        self.limit.require(address)
        said = "".join(sign for sign in brought.upper() if sign in SIGNS)
        with self._lock:
            present = self._present()
            if present and hmac.compare_digest(present.code, said):
                self._code = None
                return present
            self._tries += 1
            if self._tries >= TRIES_IN_ALL:
                self._code = None
        self.limit.note(address)
        raise WrongCode("This is not the code on the probe's screen now.", "Read it again, or ask for a new one there.")

    def _present(self) -> PairingCode | None:
        return self._code if self._code and self._clock() < self._code.until_s else None
