"""Answers that are being sent piece by piece, so that they can be ended: at a stop, or when their token holds no more.

An event stream has no end of its own. One that is ended here ends as if it had come to its end: its client sees no
error, and the log none either.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import anyio
from starlette.types import Message, Send

LAST_S = 0.2
"""A client that does not read gets no end: its connection is aborted by who serves it."""


class OpenAnswers:
    """The tasks that send answers in pieces, each with the token it is for; all but `end_of` in the server's loop."""

    def __init__(self) -> None:
        self._under_way: dict[asyncio.Task[object], str | None] = {}
        self._ended: set[asyncio.Task[object]] = set()
        self._loop: asyncio.AbstractEventLoop | None = None

    async def answer(
        self, token_id: str | None, send: Send, run: Callable[[Send], Awaitable[None]], *, valid_s: float | None = None
    ) -> None:
        """Let `run` answer, until its last piece or until it is ended, as by a token that is valid no longer."""
        task = asyncio.current_task()
        assert task is not None
        self._loop, is_complete = asyncio.get_running_loop(), False

        async def sending(message: Message) -> None:
            nonlocal is_complete
            if message["type"] == "http.response.body":
                is_complete = not message.get("more_body", False)
                if not is_complete:
                    self._under_way[task] = token_id
            await send(message)

        expiry = None if valid_s is None else self._loop.call_later(valid_s, self._expire, task)
        try:
            await run(sending)
        except asyncio.CancelledError:
            if task not in self._ended:
                raise
            task.uncancel()
            if not is_complete:
                await _end(send)
        except ExceptionGroup as several:
            _, others = several.split(anyio.BrokenResourceError)  # the client has left, which FastAPI's stream tells so
            if others or task not in self._under_way:
                raise
        finally:
            if expiry:
                expiry.cancel()
            self._under_way.pop(task, None)
            self._ended.discard(task)

    def end_all(self) -> None:
        """End every answer that is being sent."""
        self._end(list(self._under_way))

    def end_of(self, token_id: str) -> None:
        """End the answers for a token, soon; may be called from any thread."""
        if self._loop and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._end_of, token_id)

    def _end_of(self, token_id: str) -> None:
        self._end([task for task, its in self._under_way.items() if its == token_id])

    def _expire(self, task: asyncio.Task[object]) -> None:
        self._end([task] if task in self._under_way else [])

    def _end(self, tasks: list[asyncio.Task[object]]) -> None:
        for task in tasks:
            self._ended.add(task)
            task.cancel()


async def _end(send: Send) -> None:
    try:
        async with asyncio.timeout(LAST_S):
            await send({"type": "http.response.body", "body": b"", "more_body": False})
    except TimeoutError:
        return
