"""A writer of the store for `cuts.py`: keeps presses and measurements one after the other, and says what is kept.

`python tests/torture/storing.py FOLDER FIRST [unsynchronised]`: each line on stdout is one acknowledgement, the id of a
measurement and the sha256 of its recording, printed when the store has returned. `unsynchronised` is the control: then
neither files nor SQLite are brought to the disk.
"""

from __future__ import annotations

import hashlib
import os
import sys
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS.parent)]
from probe_card import RECORDING  # noqa: E402

from device.errors import StorageError  # noqa: E402
from device.records import database  # noqa: E402
from device.records.exams import ExamContent  # noqa: E402
from device.records.store import Store  # noqa: E402


def without_synchronising() -> None:
    """Let nothing be brought to the disk before the kernel does so by itself."""
    os.fsync = lambda handle: None  # type: ignore[assignment]
    database.SET = MappingProxyType({**database.SET, "synchronous": "OFF"})
    database.DURABLE = MappingProxyType({**database.DURABLE, "synchronous": 0})


def keep_on(folder: Path, number: int) -> None:
    """Keep one measurement after the other until the disk is gone."""
    store = Store(folder)
    exam = store.exams.make(ExamContent(kind="phantom", operator="Ada"))
    while True:
        name = f"{number:08d}"
        store.save_press({"id": f"p-{name}", "state": "waiting", "mode": "quick", "exam_id": exam["id"]})
        record = {"id": f"m-{name}", "recording_id": f"r-{name}", "force_n": number / 7.0}
        store.add_measurement(record, replace(RECORDING, id=f"r-{name}"), exam_id=exam["id"])
        store.save_press({"id": f"p-{name}", "state": "done", "measurement_id": f"m-{name}"})
        own = hashlib.sha256(store.recordings.place_of(f"r-{name}").read_bytes()).hexdigest()
        print(f"m-{name} {own}", flush=True)
        number += 1


if __name__ == "__main__":
    if "unsynchronised" in sys.argv:
        without_synchronising()
    try:
        keep_on(Path(sys.argv[1]), int(sys.argv[2]))
    except (StorageError, OSError):
        sys.exit(3)  # the disk is gone
