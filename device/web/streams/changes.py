"""Measurements and exams as events, whenever one is made or changed: their number is that of the audit's entry.

So a client that was away, or whose probe was restarted, gets what it has missed by the number of its last one. Nothing
is read as long as nothing is written to the store.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import Header
from fastapi.sse import ServerSentEvent

from device.records.listing import NEWEST, Change
from device.records.store import Store

PAGE, LONGEST = 100, 18
LastEventId = Annotated[
    str | None,
    Header(alias="Last-Event-ID", description="The `id` of the last event that was received; empty is none."),
]


def number_of(last_event_id: str | None) -> int | None:
    """Return the number of the last change that a client knows, None where it names none.

    Of what is no number that this store gave nobody knows what its client has missed: it is above them all.
    """
    said = (last_event_id or "").strip()
    is_number = said.isascii() and said.isdecimal() and len(said) <= LONGEST
    return (int(said) if is_number else NEWEST) if said else None


class ChangeFeed:
    """The changes of a store. One feed serves one client."""

    def __init__(self, store: Store, after: int | None) -> None:
        """Take the number of the last change that the client knows, None for those from now on."""
        self._store, self._after = store, after
        self._revision: int | None = None

    async def begin(self) -> int:
        """Return the number from which on the client is told: its own, or that of the newest change.

        A number that the store has not come to is of one in whose place a backup was restored: nobody knows what the
        client has missed, so it is told all. Raises `StorageError` when the store cannot be read.
        """
        newest = await asyncio.to_thread(self._store.listing.newest_change)
        if self._after is None:
            self._after = newest
        elif self._after > newest:
            self._after = 0
        return self._after

    async def new(self) -> AsyncIterator[ServerSentEvent]:
        """Yield what has changed since the last time, or since it began; raises as `begin`."""
        revision, is_more = self._store.revision, True
        if self._revision == revision:
            return
        while is_more:
            after = await self.begin() if self._after is None else self._after
            changes = await asyncio.to_thread(self._store.listing.changes, after=after, limit=PAGE)
            for change in changes:
                self._after = change.number
                yield _event(change)
            is_more = len(changes) == PAGE
        self._revision = revision  # not before: what could not be read is asked for again


def _event(change: Change) -> ServerSentEvent:
    return ServerSentEvent(event=change.kind, id=str(change.number), raw_data=json.dumps(change.record))
