"""A sender whose waits take no time: hours of a receiver that is down pass in a moment, by its own schedule."""

from __future__ import annotations

import threading

from device.sending.persistent_sender import PersistentSender


class HurriedWait(threading.Event):
    """What a sender waits by: it adds up how long that would have been, and waits a hundredth of a second at most."""

    def __init__(self) -> None:
        super().__init__()
        self.waited_s: list[float] = []

    def wait(self, timeout: float | None = None) -> bool:
        assert timeout is not None
        self.waited_s.append(timeout)
        return super().wait(min(timeout, 0.01))


def hurry(sender: PersistentSender) -> HurriedWait:
    """Let a sender that was not started wait by its schedule without waiting."""
    sender._woken = waiting = HurriedWait()
    return waiting
