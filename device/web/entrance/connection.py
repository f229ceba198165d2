"""One connection of the server, with an end to patience: uvicorn's own protocol waits for ever for a request.

A client that connects and sends nothing, or its request drop by drop, is let go, and so is one that does not read what
it asked for.
"""

from __future__ import annotations

import asyncio

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from device.access.request_rules import BODY_RULES, JSON_BODY

HEAD_S = 10.0
"""A request's head is there so soon after its connection, or after the answer before."""
SILENT_S = 10.0
"""A body that was begun goes on within this."""
BODY_S = 30.0
"""A body that is not streamed is there as a whole."""
UNREAD_S = 30.0
"""So long an answer may wait for its client to read on."""
LOOK_S = 2.0


class PatientProtocol(H11Protocol):
    """HTTP/1.1 of one client, until it takes too long."""

    _idle_since_s = _heard_s = 0.0
    _look: asyncio.TimerHandle | None = None
    _unread: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a connection."""
        super().connection_made(transport)
        self._idle_since_s = self._heard_s = self.loop.time()
        self._look = self.loop.call_later(LOOK_S, self._look_again)

    def connection_lost(self, exc: Exception | None) -> None:
        """Let go of it."""
        for timer in (self._look, self._unread):
            if timer:
                timer.cancel()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Hear what the client sends."""
        self._heard_s = self.loop.time()
        super().data_received(data)

    def on_response_complete(self) -> None:
        """Wait for the next request from now on."""
        self._idle_since_s = self.loop.time()
        super().on_response_complete()

    def pause_writing(self) -> None:
        """Wait for a client that does not read, for a while."""
        super().pause_writing()
        self._unread = self._unread or self.loop.call_later(UNREAD_S, self.transport.abort)

    def resume_writing(self) -> None:
        """Go on, for it reads."""
        if self._unread:
            self._unread.cancel()
            self._unread = None
        super().resume_writing()

    def shutdown(self) -> None:
        """End after the answer under way; at once where nobody reads it."""
        if self._unread:
            self.transport.abort()
        else:
            super().shutdown()

    def _look_again(self) -> None:
        if self.transport.is_closing():
            return
        if self._is_late(self.loop.time()):
            self.transport.abort()
            return
        self._look = self.loop.call_later(LOOK_S, self._look_again)

    def _is_late(self, now_s: float) -> bool:
        state = self.conn.their_state
        if state is h11.IDLE:
            return now_s - self._idle_since_s > HEAD_S
        if state is not h11.SEND_BODY or self.flow.read_paused:
            return False
        rule = BODY_RULES.get(str(self.scope["path"]), JSON_BODY)
        is_slow = not rule.streamed and now_s - self._idle_since_s > HEAD_S + BODY_S
        return is_slow or now_s - self._heard_s > SILENT_S
