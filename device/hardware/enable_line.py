"""The line that enables the LEDs' outputs, as the driver asks for it: up, hold, down. A process of its own holds it.

Whoever has the light on has to say again and again that it goes on: what takes longer than `light_keeper.HOLD_S` loses
the line, be it this process, its bus or its camera. A keeper that does not answer is ended and another one started,
which asks for the line low.
"""

from __future__ import annotations

import os
import select
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Protocol

from device.errors import LightCutError, LightLineError
from device.hardware.light_keeper import DOWN, HOLD, HOLD_S, OPENED, UP, WAS_UP

START_S, ANSWER_S = 10.0, 0.5
"""A Python that starts on a slow board; one byte there and back on a busy one."""
REMEDY = "Press again; if it comes back, send the log."


class EnableLine(Protocol):
    """The line above its keeper. Each method raises `LightLineError` when the line cannot be had."""

    def up(self) -> bool:
        """Enable the outputs; return whether they had been so all the time since the last call."""

    def hold(self) -> None:
        """Say that whoever has the light on goes on; raise `LightCutError` when the line has fallen meanwhile."""

    def down(self) -> None:
        """Disable the outputs."""

    def close(self) -> None:
        """Disable the outputs and release the line."""


class KeptLine:
    """A line that the process of `command` keeps. Implements `EnableLine`."""

    def __init__(self, command: Sequence[str], environment: Mapping[str, str] | None = None) -> None:
        """Start the keeper; raise `LightLineError` when it does not get the line."""
        self._command, self._environment = command, environment
        self._keeper: subprocess.Popen[bytes] | None = None
        self._started()

    def up(self) -> bool:
        """Enable the outputs; return whether they had been so all the time since the last call."""
        return self._asked(self._keeper or self._started(), UP)

    def hold(self) -> None:
        """Say that whoever has the light on goes on; raise `LightCutError` when the line has fallen meanwhile."""
        if not (self._keeper and self._asked(self._keeper, HOLD)):
            raise LightCutError(f"The light went off: nothing asked for it for {HOLD_S:g} s.", REMEDY)

    def down(self) -> None:
        """Disable the outputs; by another keeper when this one does not answer."""
        if self._keeper:
            with suppress(LightCutError):
                self._asked(self._keeper, DOWN)
                return
        self._started()

    def close(self) -> None:
        """Disable the outputs and release the line."""
        if self._keeper:
            self._end(self._keeper, within_s=ANSWER_S)

    def _started(self) -> subprocess.Popen[bytes]:
        """Start a keeper and return it once it has the line, low."""
        # In a session of its own: Ctrl-C is for the daemon, which then darkens in order.
        keeper = subprocess.Popen(
            self._command, env=self._environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
        )
        said = self._heard(keeper, START_S)
        if said == OPENED:
            self._keeper = keeper
            return keeper
        assert keeper.stdout is not None
        if keeper.poll() is None and not said:
            keeper.kill()
        words = (said + keeper.stdout.read()).decode(errors="replace").strip() or "its keeper does not start"
        self._end(keeper, within_s=ANSWER_S)
        remedy = "Correct light.enable_chip and light.enable_line; see that no other program has the line."
        raise LightLineError(f"The line that enables the LEDs cannot be had: {words}.", remedy)

    def _asked(self, keeper: subprocess.Popen[bytes], request: bytes) -> bool:
        """Return whether the line had been up; raise `LightCutError` when the keeper is gone or does not answer."""
        assert keeper.stdin is not None
        try:
            os.write(keeper.stdin.fileno(), request)
            if answer := self._heard(keeper, ANSWER_S):
                return answer == WAS_UP
        except BrokenPipeError:
            pass
        self._end(keeper)
        raise LightCutError("The process that keeps the LEDs' enable line has ended or hangs.", REMEDY)

    @staticmethod
    def _heard(keeper: subprocess.Popen[bytes], within_s: float) -> bytes:
        """Return the next byte that the keeper says, none when it is gone or silent."""
        assert keeper.stdout is not None
        handle = keeper.stdout.fileno()
        return os.read(handle, 1) if select.select([handle], [], [], within_s)[0] else b""

    def _end(self, keeper: subprocess.Popen[bytes], *, within_s: float = 0.0) -> None:
        """End a keeper: by the end of its input, or by force when that takes too long."""
        assert keeper.stdin is not None
        assert keeper.stdout is not None
        self._keeper = None
        keeper.stdin.close()
        try:
            keeper.wait(within_s)
        except subprocess.TimeoutExpired:
            keeper.kill()
            keeper.wait()
        keeper.stdout.close()
