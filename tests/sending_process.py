"""A process that does nothing but send a store's outbox, to be killed: DATA_FOLDER ARCHIVE_PORT OWN_TITLE TITLE."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from device.config import DicomSection
from device.dicom.hospital import Hospital
from device.files.recording_file import read_picture
from device.records.store import Store

if __name__ == "__main__":
    folder, port, own_title, title = sys.argv[1:]
    settings = DicomSection(archive_host="127.0.0.1", archive_port=int(port), archive_title=title, own_title=own_title)
    store = Store(Path(folder))
    hospital = Hospital(settings, store, read_picture)
    hospital.start()
    while not store.outbox.is_idle():
        time.sleep(0.02)
    hospital.close()
    store.close()
