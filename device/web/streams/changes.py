"""Measurements and exams as events, whenever one is made or changed: their id is that of the audit's entry.

That is its number and its hash, so a client that was away, or whose probe was restarted, gets what it has missed by the
id of its last one, and is told all where a backup was restored and the number is another entry's. Nothing is read as
long as nothing is written to the store.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import Header
from fastapi.sse import ServerSentEvent

from device.records.audit import AuditHead
from device.records.listing import Change
from device.records.store import Store

PAGE = 100
LastEventId = Annotated[
    str | None,
    Header(alias="Last-Event-ID", description="The `id` of the last event that was received; empty is none."),
]


class ChangeFeed:
    """The changes of a store. One feed serves one client."""

    def __init__(self, store: Store, last_event_id: str | None) -> None:
        """Take the id of the last event that the client knows; without one it is told what changes from now on."""
        self._store, self._last_event_id = store, (last_event_id or "").strip()
        self._after: int | None = None
        self._revision: int | None = None

    async def begin(self) -> str:
        """Return the id from which on the client is told: its own, or that of the newest entry.

        Of an id that is none of this store's, as after an older backup was restored, nobody knows what its client has
        missed: it is told all. Raises `StorageError` when the store cannot be read.
        """
        audit = self._store.audit
        last = self._last_event_id
        head = await (asyncio.to_thread(audit.known, last) if last else asyncio.to_thread(audit.newest))
        self._after = head.seq
        return str(head)

    async def new(self) -> AsyncIterator[ServerSentEvent]:
        """Yield what has changed since the last time, or since it began; raises as `begin`."""
        revision, is_more = self._store.revision, True
        if self._revision == revision:
            return
        while is_more:
            if self._after is None:
                await self.begin()
            changes = await asyncio.to_thread(self._store.listing.changes, after=self._after or 0, limit=PAGE)
            for change in changes:
                self._after = change.number
                yield _event(change)
            is_more = len(changes) == PAGE
        self._revision = revision  # not before: what could not be read is asked for again


def _event(change: Change) -> ServerSentEvent:
    head = AuditHead(change.number, change.hash)
    return ServerSentEvent(event=change.kind, id=str(head), raw_data=json.dumps(change.record))
