"""Which measurements are taken away: those of an exam, a time, a mode or an outcome, each with its exam.

They come newest first, a page of the store at a time, so that a selection of any size is never in memory. What was
voided is left out unless it is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from device.records.listing import NEWEST, Wanted
from device.records.store import Store, StoredRecord

PAGE = 100


@dataclass(frozen=True)
class Exported:
    """A measurement as it was kept, and the exam that it belongs to now; None of one that belongs to none."""

    measurement: StoredRecord
    exam: StoredRecord | None

    @property
    def taken_at(self) -> str:
        """When it was taken, RFC 3339 in UTC."""
        return str(self.measurement["taken_at"])

    @property
    def taken_at_local(self) -> str:
        """The same in the time zone of the probe, with its offset."""
        return datetime.fromisoformat(self.taken_at).astimezone().isoformat(timespec="milliseconds")


def local_time(moment: str) -> str:
    """Return a time of a record for a reader: in the time zone of the probe, with its offset from UTC."""
    told = datetime.fromisoformat(moment).astimezone().isoformat(" ", "seconds")
    return f"{told[:19]} (UTC{told[19:]})"


@dataclass(frozen=True)
class Selection:
    """Measurements of a store below a sequence number, all or what is wanted of them."""

    store: Store
    wanted: Wanted = field(default_factory=Wanted)
    with_void: bool = False
    before: int = NEWEST

    @classmethod
    def of_now(cls, store: Store, wanted: Wanted, *, with_void: bool = False) -> Selection:
        """Return what is there now: what is measured meanwhile does not come in, however often it is gone through."""
        newest = store.listing.measurements(Wanted(), limit=1).records
        return cls(store, wanted, with_void, newest[0]["seq"] + 1 if newest else 1)

    def __iter__(self) -> Iterator[Exported]:
        exams: dict[str, StoredRecord] = {}
        for measurement in self._measurements():
            if measurement["voided"] and not self.with_void:
                continue
            exam_id = measurement["exam_id"]
            if exam_id and exam_id not in exams:
                exams[exam_id] = self.store.exams.exam(exam_id)
            yield Exported(measurement, exams.get(exam_id))

    def _measurements(self) -> Iterator[dict[str, Any]]:
        before: int | None = self.before
        while before is not None:
            page = self.store.listing.measurements(self.wanted, before=before, limit=PAGE)
            yield from page.records
            before = page.next_before
