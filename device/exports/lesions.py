"""Several presses of one lesion as one lesion's row: a row an exam, with mean, spread and repeatability.

An exam is of one place. Measurements that belong to none are of no known lesion, and in no row.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from device.exports.selection import Exported
from device.exports.table import OF_EXAM, Cell, column_of, written
from device.measurement.quantities import UNKNOWNS
from device.measurement.repeats import Repeats, model_of, repeats_by_unknown
from device.records.store import StoredRecord

PARTS = ("mean", "spread", "presses", "repeatability_index")
OF_ESTIMATE = (*UNKNOWNS, "mode", "model_sha256", "model_card_sha256", "simulated")
OF_MEASUREMENTS = ("measurements", "first_taken_at_utc", "last_taken_at_utc", "modes", "simulated")
MADE_BY = ("models", "serials", "software")
LESION_COLUMNS = (
    "exam_id", *OF_EXAM, *OF_MEASUREMENTS, *(column_of(name, part) for name in UNKNOWNS for part in PARTS),
    *(column_of(name, "open_presses") for name in UNKNOWNS), "patient_issuer", *MADE_BY,
)  # fmt: skip


@dataclass
class Lesion:
    """An exam and its measurements that were selected: their estimates, when they were taken, in which modes, and
    by which models, probes and software; what a record of before does not say is none of them.
    """

    exam: StoredRecord
    estimates: list[dict[str, Any]]
    taken_at: list[str]
    modes: set[str]
    serials: set[str]
    software: set[str]

    @property
    def repeats(self) -> Mapping[str, Repeats]:
        """How far the measurements agree, by unknown."""
        return repeats_by_unknown(self.estimates)

    def row(self) -> list[Cell]:
        """Return the row of the table."""
        of_exam = [self.exam["id"], *(self.exam.get(name) for name in OF_EXAM)]
        is_simulated = any(one["simulated"] for one in self.estimates)
        told = [len(self.estimates), min(self.taken_at), max(self.taken_at), _listed(self.modes), is_simulated]
        repeats = [self.repeats[name] for name in UNKNOWNS]
        agreed = [getattr(one, part) for one in repeats for part in PARTS]
        open_presses = [one.open_presses for one in repeats]
        made_by = [_listed(one) for one in ({model_of(one) for one in self.estimates}, self.serials, self.software)]
        return [*of_exam, *told, *agreed, *open_presses, self.exam["patient_issuer"], *made_by]


def _listed(told: Iterable[str]) -> str:
    return " ".join(sorted(told))


def lesions_of(exported: Iterable[Exported]) -> list[Lesion]:
    """Return the lesions of a selection, in the order in which it comes to them; what was voided is in none."""
    lesions: dict[str, Lesion] = {}
    for one in exported:
        if one.exam is None or one.measurement["voided"]:
            continue
        lesion = lesions.setdefault(one.exam["id"], Lesion(one.exam, [], [], set(), set(), set()))
        estimate = one.measurement["estimate"]
        lesion.estimates.append({name: estimate.get(name) for name in OF_ESTIMATE})
        lesion.taken_at.append(one.taken_at)
        lesion.modes.add(one.measurement["mode"])
        for found, name in ((lesion.serials, "serial"), (lesion.software, "software")):
            if told := one.measurement.get(name):
                found.add(told)
    return list(lesions.values())


def lesion_table(exported: Iterable[Exported]) -> Iterator[bytes]:
    """Yield the table's bytes, the header and then row by row."""
    return written(LESION_COLUMNS, (lesion.row() for lesion in lesions_of(exported)))
