"""What a start costs that looks through the store: `python tests/bench_start_of_store.py [MEASUREMENTS] [FOLDER]`.

Each time is a ratio to hashing 100 MB in the same run. Rows are as long as a measurement's of mode standard; recordings
are small files, for a start looks at their names and sizes only.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import sys
import time
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

from device.records.database import open_database
from device.records.store import Store

ROW_BYTES = 3000


def fill(folder: Path, count: int) -> None:
    """Make a store of so many measurements, in one transaction."""
    Store(folder).close()
    with closing(sqlite3.connect(folder / "tsis.sqlite")) as db, db:
        for number in range(1, count + 1):
            name = f"00000000-0000-4000-8000-{number:012d}"
            record = {"id": name, "seq": number, "recording_id": name, "features": "x" * ROW_BYTES}
            db.execute("INSERT INTO measurement VALUES (?, ?, ?)", (number, name, json.dumps(record)))
            db.execute("INSERT INTO kept_recording VALUES (?, 5, 'none', '', NULL)", (name,))
            (folder / "recordings" / f"{name}.zip").write_bytes(b"12345")


def timed(action) -> float:
    """Return how long an action takes (s), the best of three."""
    times = []
    for _ in range(3):
        began = time.perf_counter()
        action()
        times.append(time.perf_counter() - began)
    return min(times)


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    with TemporaryDirectory(dir=sys.argv[2] if len(sys.argv) > 2 else None) as name:
        folder = Path(name)
        fill(folder, count)
        yardstick_s = timed(lambda: hashlib.sha256(bytes(100_000_000)).digest())
        database_s = timed(lambda: open_database(folder).connection.close())
        whole_s = timed(lambda: Store(folder).close())
        size_mb = (folder / "tsis.sqlite").stat().st_size / 1e6
    print(f"{count} measurements, database of {size_mb:.0f} MB; 100 MB are hashed in {yardstick_s:.3f} s")
    for what, seconds in (("open and look through the database", database_s), ("the whole start", whole_s)):
        print(f"{what:40} {seconds:.3f} s  {seconds / yardstick_s:.2f} of the yardstick")


if __name__ == "__main__":
    main()
