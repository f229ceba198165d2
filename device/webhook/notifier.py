"""The thread that tells an address of every change, in their order, and goes on trying until it has it.

The audit is its queue: each change is an entry there, on the disk with the act itself, and the number of the last one
that the address has taken is kept in the same store. So nothing is lost by a kill, and nothing is kept twice; what may
have arrived is sent again with the same id.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from device.config import WebhookSection
from device.errors import DeviceError, StorageError
from device.records.listing import Change
from device.records.store import Store
from device.sending.persistent_sender import PersistentSender
from device.webhook.address import WebhookAddress
from device.webhook.notice import notice_of, read_secret, signed_headers

log = logging.getLogger(__name__)

WHOM = "webhook"
AT_ONCE = 50
"""Changes that are read at a time."""
LOOK_S = 0.5


class Notifier(PersistentSender):
    """Tells of what is changed from its first start on, until it is closed."""

    receiver = "webhook"
    look_s = LOOK_S

    def __init__(
        self,
        settings: WebhookSection,
        store: Store,
        serial: str,
        tell: Callable[[DeviceError | None], None] = lambda fault: None,
        is_busy: Callable[[], bool] = lambda: False,
    ) -> None:
        """Take the settings with an address and a secret, what there is to tell of, and whom to tell of a fault."""
        assert settings.url is not None
        assert settings.secret_file is not None  # as the settings require beside an address
        super().__init__(tell, is_busy)
        self._store, self._serial, self._secret_file = store, serial, settings.secret_file
        self._address = WebhookAddress(settings.url, settings.tls_authority)
        self._revision: int | None = None

    def start(self) -> None:
        """Begin."""
        with suppress(StorageError):  # a disk that takes nothing now is told by others, and may take it later
            self._begin()
        super().start()

    def _begin(self) -> None:
        """Where nobody was told before, tell of what is changed from now on."""
        listing = self._store.listing
        if listing.told(WHOM) is None:
            listing.note_told(WHOM, listing.newest_change())

    def as_record(self) -> dict[str, Any]:
        """Return where notices go, which change the address has, what the newest is, and what is wrong."""
        listing, state = self._store.listing, self.state
        return {
            "address": str(self._address),
            "told": listing.told(WHOM),
            "newest": listing.newest_change(),
            "fault": state.fault.as_record() if state.fault else None,
            "next_try_at": state.next_try_at,
        }

    def _delivered(self) -> tuple[bool, DeviceError | None]:
        """Tell of everything that the address has not got, oldest first; nothing is read while nothing is written."""
        if self._failures == 0 and self._revision == self._store.revision:
            return False, None
        self._begin()
        is_more = True
        while is_more and not self._is_to_pause():
            self._revision = self._store.revision
            changes = self._store.listing.changes(after=self._store.listing.told(WHOM) or 0, limit=AT_ONCE)
            is_more = bool(changes)
            for change in changes:
                if self._is_to_pause():
                    break
                self._tell_of(change)
        return is_more, None

    def _tell_of(self, change: Change) -> None:
        notice = notice_of(change, self._serial)
        self._address.post(notice.body, signed_headers(notice, read_secret(self._secret_file), int(time.time())))
        self._store.listing.note_told(WHOM, change.number)
        log.info("webhook seq=%d type=%s id=%s", change.number, notice.type, change.record["id"])
