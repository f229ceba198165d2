"""Rows of a sweep, kept as they are made: a text file of JSON lines that survives Ctrl-C, a crash and a power cut.

The first line says what is being swept and by which software, so that a journal is never continued with other
parameters or by another solver. A line torn by a crash can only be the last one and is dropped: its row is solved
again. In memory is only where each row begins.
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
    """Append-only record of finished rows beside the file that they will become; `index in journal` tells which."""

    def __init__(self, path: Path, plan: Row, *, software: Row | None = None, replace: bool = False) -> None:
        """Open or continue; `software` says by version and hash who solves, unless given nobody knows.

        Raises `InvalidQuantity` for one begun with another plan or by other software, unless told to replace that.
        """
        self.path, self.plan, self.software = path, plan, software or {}
        self._offset_of: dict[int, int] = {}
        self._head = plan | self.software
        if replace and path.exists() and not _is_begun_with(self._head, path):
            path.unlink()
        if path.exists():
            os.truncate(path, self._read_whole_lines())
        self._file = path.open("ab")
        if not self._file.tell():
            self._write(self._head)

    def _read_whole_lines(self) -> int:
        """Note where every row begins; return where the last whole line ends, in bytes."""
        end = 0
        with self.path.open("rb") as file:
            for line in file:
                if not line.endswith(b"\n"):
                    break
                self._note(line, end)
                end += len(line)
        return end

    def _note(self, line: bytes, offset: int) -> None:
        try:
            record = json.loads(line)
        except ValueError as error:
            raise InvalidQuantity("journal", self.path, "lines of JSON", "delete it to begin anew") from error
        if offset:
            self._offset_of.setdefault(record["index"], offset)
        elif record != (head := json.loads(json.dumps(self._head))):
            begun = {name: record.pop(name, None) for name in self.software}
            if record == json.loads(json.dumps(self.plan)):
                told = f"{_named(begun)}, by which {self.path} was begun"
                action = "go on by those sources, or add --force to begin anew"
                raise InvalidQuantity("software", told, _named(head), action)
            raise InvalidQuantity(
                "sweep",
                f"another one than {self.path} was begun with",
                "the same scenes, seed and press",
                "repeat the first command, or add --force to begin anew",
            )

    def __len__(self) -> int:
        return len(self._offset_of)

    def __contains__(self, index: int) -> bool:
        return index in self._offset_of

    def append(self, row: Row) -> bool:
        """Keep one finished row, on the disk when this returns; return False for a row that is already kept."""
        if row["index"] in self:
            return False
        self._offset_of[row["index"]] = self._write(row)
        return True

    def _write(self, line: Row) -> int:
        """Return where the line begins."""
        offset = self._file.tell()
        self._file.write(json.dumps(line).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())
        return offset

    def in_order(self) -> Iterator[Row]:
        """Read the rows back one by one, by their index."""
        with self.path.open("rb") as file:
            for index in sorted(self._offset_of):
                file.seek(self._offset_of[index])
                yield json.loads(file.readline())

    def close(self) -> None:
        """Close the file; the rows stay."""
        self._file.close()

    def remove(self) -> None:
        """Delete the journal once its rows stand in the data set."""
        self.close()
        self.path.unlink()


def _named(solved_by: Row) -> str:
    """Return by which software rows were solved; earlier ones did not say."""
    if not solved_by.get("software_sha256"):
        return "one that did not say which it is"
    return f"{solved_by['software']} of sources {solved_by['software_sha256'][:12]}"


def _is_begun_with(plan: Row, path: Path) -> bool:
    """Return whether a file's first line says a plan."""
    with path.open("rb") as file:
        try:
            return bool(json.loads(file.readline()) == json.loads(json.dumps(plan)))
        except ValueError:
            return False
