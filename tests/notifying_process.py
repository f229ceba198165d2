"""A process that does nothing but tell of a store's changes, to be killed: DATA_FOLDER URL SECRET_FILE."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from device.config import WebhookSection
from device.records.store import Store
from device.webhook.notifier import WHOM, Notifier

if __name__ == "__main__":
    folder, url, secret = sys.argv[1:]
    store = Store(Path(folder))
    notifier = Notifier(WebhookSection(url=url, secret_file=Path(secret)), store, "TSIS-0042")
    notifier.start()
    while store.listing.changes(after=store.listing.told(WHOM) or 0, limit=1):
        time.sleep(0.02)
    notifier.close()
    store.close()
