"""Rows of a sweep, kept as they are made: a text file of JSON lines that survives Ctrl-C, a crash and a power cut.

The first line says what is being swept, so that a journal is never continued with other parameters. A line torn by a
crash can only be the last one and is dropped: its row is solved again.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from device.measurement.quantities import InvalidQuantity

Row = dict[str, Any]


class Journal:
    """Append-only record of finished rows beside the file that they will become."""

    def __init__(self, path: Path, plan: Row) -> None:
        """Open or continue; raise `InvalidQuantity` when the file was begun with another plan."""
        self.path, self.rows = path, {}
        self.rows = {row["index"]: row for row in self._continue(plan)}
        self._file = path.open("a", encoding="utf-8")
        if not path.stat().st_size:
            self._write(plan)

    def _continue(self, plan: Row) -> Iterator[Row]:
        if not self.path.exists():
            return
        whole = self.path.read_bytes().rpartition(b"\n")[0]
        try:
            lines = [json.loads(line) for line in whole.splitlines()]
        except ValueError as error:
            raise InvalidQuantity("journal", self.path, "lines of JSON", "delete it to begin anew") from error
        if lines and lines[0] != json.loads(json.dumps(plan)):
            raise InvalidQuantity(
                "sweep",
                f"another one than {self.path} was begun with",
                "the same scenes, seed and press",
                "repeat the first command, or delete that file to begin anew",
            )
        os.truncate(self.path, len(whole) + 1 if whole else 0)
        yield from lines[1:]

    def append(self, row: Row) -> None:
        """Keep one finished row; it is on the disk when this returns."""
        self.rows[row["index"]] = row
        self._write(row)

    def _write(self, line: Row) -> None:
        self._file.write(json.dumps(line) + "\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file; the rows stay."""
        self._file.close()

    def remove(self) -> None:
        """Delete the journal once its rows stand in the data set."""
        self.close()
        self.path.unlink()
