"""Which form the store has, and which forms this code reads: SQLite's `user_version` of its database.

1: a recording is a folder. 2: a new one is a .zip; the tables are those of 1, and its folders stay as they are.
3: a recording may hold several presses on the lesion (`tsis.recording/2`); tables and older recordings are those of 2.
4: tables more, of exams, to which of them measurements belong, their audit, and the requests that are answered once
only; everything else is as in 3. 5: the audit has a chain of hashes, and there are tokens. 6: a table more, of each
recording's size and hash; everything else is as in 5. 7: tables more, of what goes to the hospital's archive. What a
release needs beside a form and no release of that form trips over is in `migrations.ADDITIONS`, and raises no number.

A release's manifest states both numbers (`data_schemas.store`), so that an update can be refused before it writes what
the release one back cannot read. Standard library only: the manifest's builder reads them without the daemon's
packages.
"""

from __future__ import annotations

from pathlib import Path

STORE_WRITES = 7
"""The form that this code leaves behind. Whoever changes tables or recordings raises it, and adds to `migrations`."""
STORE_READS = (1, 2, 3, 4, 5, 6, 7)
"""The forms that this code can open, of which it makes the one that it writes."""
MANIFEST_SINCE = 6
UNNUMBERED = 1
"""What a database without a number is: the form before it had one."""
MAGIC, VERSION_AT = b"SQLite format 3\0", 60
"""https://www.sqlite.org/fileformat2.html#user_version_number"""


def store_schema(database: Path) -> int | None:
    """Return the form of a database by its header, or None when there is none; opens no SQLite and takes no lock.

    The store brings the number to the file itself, not only to its log, before it writes a record.
    """
    try:
        with database.open("rb") as file:
            header = file.read(100)
    except FileNotFoundError:
        return None
    if not header.startswith(MAGIC) or len(header) < VERSION_AT + 4:
        return None
    return int.from_bytes(header[VERSION_AT : VERSION_AT + 4], "big") or UNNUMBERED
