"""Exams, and to which exam a measurement belongs; all that people change of either is in the audit.

A measurement stays as it was measured: where it belongs, and that it does not count, stands beside it. Whoever changes
something names the version that he has seen; each such act is one transaction with its entry in the audit. A patient is
known by an opaque reference and who has issued it alone: no name and no date of birth. Two issuers may give one number
to two people; a reference of no known issuer is one more identity, and equal to none that has an issuer.
"""

from __future__ import annotations

import json
import sqlite3
import unicodedata
import uuid
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from device.errors import ExamTooOld, InvalidRequest, StaleVersion, UnknownResource
from device.records.asked_once import AskedOnce, first_answer, keep_answer
from device.records.audit import append, utc_now

_Record = dict[str, Any]
ExamKind = Literal["patient", "phantom"]
EXAM_TABLES = """
CREATE TABLE IF NOT EXISTS exam
  (seq INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT UNIQUE NOT NULL, version INTEGER NOT NULL, record TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS filing
  (measurement_id TEXT PRIMARY KEY, exam_id TEXT, voided TEXT, version INTEGER NOT NULL);
CREATE INDEX IF NOT EXISTS filing_by_exam ON filing (exam_id);
"""
ISSUER_TABLE = """
CREATE TABLE IF NOT EXISTS patient_issuer (exam_id TEXT PRIMARY KEY, patient_ref TEXT NOT NULL, issuer TEXT NOT NULL);
"""
"""Who has issued the patient's reference of an exam: it holds for that reference alone, not for a corrected one.

Beside the exams, for what a release of before has written of an exam stays as it is.
"""
ISSUERS_OF_ORDERS = """
INSERT OR IGNORE INTO patient_issuer
  SELECT exam_id, json_extract(record, '$.patient_ref'), json_extract(patient, '$.issuer') FROM ordered_study
  WHERE coalesce(json_extract(patient, '$.issuer'), '') != '';
"""
"""Finds the issuers of exams that were begun before there was the table, where the patient's data are not erased."""
WITH_ISSUER = (
    "exam LEFT JOIN patient_issuer ON exam_id = exam.id AND patient_ref = json_extract(exam.record, '$.patient_ref')"
)
NO_ISSUER = ""
"""Asked for as an issuer: the exams of a reference that nobody has said the issuer of."""
JOINERS = "\u200c\u200d"
"""What some scripts need within a word, though it prints nothing."""
SPACES = "".join(one for one in map(chr, range(0xA0, 0x3001)) if unicodedata.category(one) == "Zs")
"""Spaces beside the plain one: a wide one stands in Japanese names, one that does not break in what was pasted."""
UNFILED = {"exam_id": None, "voided": None, "version": 1}
"""A measurement of which nobody has said anything."""
LONGEST_EXAM = timedelta(days=7)
"""Longer after its beginning an exam takes no press."""
OF_A_PATIENT = ("patient_ref", "side", "clock_position", "nipple_distance_mm")


def _one_line(text: str, others: str = "") -> str:
    """Return text that a screen shows whole, of printable characters and `others`; raise `ValueError` for any else."""
    for place, character in enumerate(text, start=1):
        if not character.isprintable() and character not in JOINERS + others:
            told = f"character {place} is {character!a}"
            raise ValueError(f"must be of characters that can be printed, on one line: {told}")
    if text != text.strip():
        raise ValueError("must not begin or end with a space")
    return text


def _words(text: str) -> str:
    """Return what people wrote on one line, with any space that their script has between words."""
    return _one_line(text, SPACES)


def _lines(text: str) -> str:
    """Return text of any number of lines, which end with a line feed, however the sender ends them."""
    lines = text.replace("\r\n", "\n").split("\n")
    for line in lines:
        _one_line(line.strip(" \t" + SPACES), SPACES + "\t")
    return "\n".join(lines)


SHOWN = "Characters that can be printed, on one line, no space at its ends."
Identifier = Annotated[str, Field(min_length=1, max_length=64, description=SHOWN), AfterValidator(_one_line)]
"""An identifier, as somebody typed or scanned it: programs compare it, so it has no space but the plain one."""
Person = Annotated[str, Field(min_length=1, max_length=64, description=SHOWN), AfterValidator(_words)]
"""Who says or does something, as he calls himself."""
DistanceMm = Annotated[float, Field(ge=0.0, le=250.0, allow_inf_nan=False), AfterValidator(abs)]
"""A distance; -0 is 0, or it would be printed with its sign."""
Reason = Annotated[str, Field(min_length=1, max_length=500, description=SHOWN), AfterValidator(_words)]
ExamId = Annotated[str, Field(pattern="^[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}$")]


@dataclass(frozen=True)
class AskedExam:
    """The exam that a press is asked for, and the version of it that whoever asks has seen, None when he says none.

    `asked_at`: when (RFC 3339), None while the clock is not believed: then its exam may be of any age.
    """

    id: str
    version: int | None = None
    asked_at: str | None = None


class LesionFields(BaseModel):
    """What the operator says of an exam: side, clock position and distance (mm) from the nipple are the lesion's."""

    model_config = ConfigDict(extra="forbid", strict=True)
    side: Literal["left", "right"] | None = None
    clock_position: Annotated[int, Field(ge=1, le=12)] | None = None
    nipple_distance_mm: DistanceMm | None = None
    operator: Person | None = None
    note: Annotated[str, Field(max_length=2000), AfterValidator(_lines)] = ""


def _as_changes(schema: _Record) -> None:
    """Say of a change that what is not named stays, or a generated client would send the defaults; and what has to be.

    An exam always has a kind and an operator.
    """
    fields = schema["properties"]
    for field in fields.values():
        field.pop("default", None)
    for name in ("kind", "operator"):
        kinds = fields[name].pop("anyOf", None)
        fields[name] |= kinds[0] if kinds else {}


class ExamFields(LesionFields):
    """What may be said of an exam.

    `patient_ref` is opaque: what the hospital's PC knows the patient by. `order_number`: the order's or accession
    number.
    """

    model_config = ConfigDict(json_schema_extra=_as_changes)
    kind: ExamKind | None = None
    patient_ref: Identifier | None = None
    order_number: Identifier | None = None


class ExamContent(ExamFields):
    """A whole exam: of a patient, who has a reference, or of a phantom, which has nothing of a patient's."""

    model_config = ConfigDict(json_schema_extra=None)
    kind: ExamKind
    operator: Person

    @model_validator(mode="after")
    def _is_of_one_kind(self) -> ExamContent:
        said = [name for name in OF_A_PATIENT if getattr(self, name) is not None]
        if self.kind == "phantom" and said:
            raise ValueError(f"an exam of a phantom has no {said[0]}: leave it out")
        if self.kind == "patient" and self.patient_ref is None:
            raise ValueError("an exam of a patient needs a patient_ref")
        return self


class Exams:
    """The exams of a store; all methods may be called from any thread."""

    def __init__(
        self,
        transaction: Callable[[], AbstractContextManager[sqlite3.Connection]],
        own_study: Callable[[sqlite3.Connection, _Record], _Record],
    ) -> None:
        """Take how a transaction of the store is begun, and what returns `own_study` of an exam that was ordered.

        That is why it may not share the study it was ordered with, {} when it may.
        """
        self._transaction, self._own_study = transaction, own_study

    def make(
        self,
        content: ExamContent,
        once: AskedOnce | None = None,
        also: Callable[[sqlite3.Connection, str], None] = lambda db, exam_id: None,
        issuer: str | None = None,
    ) -> _Record:
        """Keep a new exam and return it; of a request that was obeyed before, what it was answered with then.

        `also` keeps what belongs to the exam's id in the same transaction; `issuer` is who has issued the patient's
        reference, None when nobody says so.

        Raises `ReusedKey` for another request's key.
        """
        with self._transaction() as db:
            if once and (kept := first_answer(db, once)):
                return kept
            exam = self._new_exam(db, content, issuer, also)
            if once:
                keep_answer(db, once, exam)
        return exam

    def make_like(
        self,
        like: AskedExam,
        said: _Record,
        once: AskedOnce | None = None,
        also: Callable[[sqlite3.Connection, str], None] = lambda db, exam_id: None,
    ) -> _Record:
        """Keep a new exam of the patient and order of another one, of which all else is `said`; return it as `make`.

        Raises as `require_open`, for it goes on with that exam; `InvalidRequest`, and `ReusedKey`.
        """
        with self._transaction() as db:
            if once and (kept := first_answer(db, once)):
                return kept
            require_open(db, like)
            other = exam_of(db, like.id)
            same = {name: other[name] for name in ("kind", "patient_ref", "order_number")}
            exam = self._new_exam(db, exam_content({**said, **same}), other["patient_issuer"], also)
            if once:
                keep_answer(db, once, exam)
        return exam

    def _new_exam(
        self,
        db: sqlite3.Connection,
        content: ExamContent,
        issuer: str | None,
        also: Callable[[sqlite3.Connection, str], None],
    ) -> _Record:
        """Keep an exam with its entry in the audit; return it."""
        said, at = content.model_dump(), utc_now()
        cursor = db.execute("INSERT INTO exam (id, version, record) VALUES (?, 1, '{}')", (str(uuid.uuid4()),))
        [(exam_id,)] = db.execute("SELECT id FROM exam WHERE seq = ?", (cursor.lastrowid,))
        exam = {"id": exam_id, "seq": cursor.lastrowid, "version": 1, "made_at": at, "changed_at": at, **said}
        also(db, exam_id)
        apart = self._own_study(db, exam)
        exam |= apart
        db.execute("UPDATE exam SET record = ? WHERE id = ?", (json.dumps(exam), exam_id))
        of_issuer = {"patient_issuer": issuer} if issuer else {}
        if issuer:
            db.execute("INSERT INTO patient_issuer VALUES (?, ?, ?)", (exam_id, content.patient_ref, issuer))
        append(db, "exam_made", exam_id, by=content.operator, after=said | of_issuer | apart)
        return exam | {"patient_issuer": issuer or None}

    def exam(self, exam_id: str, version: int | None = None) -> _Record:
        """Return an exam; raise `UnknownResource`, or `StaleVersion` when it is not of the version that was seen."""
        with self._transaction() as db:
            return exam_of(db, exam_id, version)

    def exams(
        self,
        *,
        kind: ExamKind = "patient",
        patient_ref: str | None = None,
        order_number: str | None = None,
        before_seq: int,
        limit: int,
    ) -> list[_Record]:
        """Return the exams of one kind, of a patient or an order where one is given, newest first."""
        asked = {"kind": kind, "patient_ref": patient_ref, "order_number": order_number}
        wanted = {name: value for name, value in asked.items() if value is not None}
        where = "".join(f" AND json_extract(record, '$.{name}') = ?" for name in wanted)
        query = f"SELECT record, issuer FROM {WITH_ISSUER} WHERE seq < ?{where} ORDER BY seq DESC LIMIT ?"
        with self._transaction() as db:
            return [told_exam(*row) for row in db.execute(query, (before_seq, *wanted.values(), limit))]

    def change(
        self, exam_id: str, changes: _Record, *, version: int, by: str, reason: str, once: AskedOnce | None = None
    ) -> _Record:
        """Change fields of an exam; return it as it is then, with the next version; of what was asked before, as then.

        Raises as `exam`, `InvalidRequest` when the whole is no exam any more, and `ReusedKey`.
        """
        with self._transaction() as db:
            if once and (kept := first_answer(db, once)):
                return kept
            exam = exam_of(db, exam_id, version)
            before = {name: exam[name] for name in ExamContent.model_fields}
            after = exam_content({**before, **changes}).model_dump()
            changed = [name for name in before if after[name] != before[name]]
            if not changed:
                return exam
            kept = {name: value for name, value in exam.items() if name != "patient_issuer"}
            kept |= {**after, "version": version + 1, "changed_at": utc_now()}
            apart = self._own_study(db, kept)
            kept |= apart
            db.execute("UPDATE exam SET version = ?, record = ? WHERE id = ?", (version + 1, json.dumps(kept), exam_id))
            seen, exam = exam, exam_of(db, exam_id)
            if seen["patient_issuer"] != exam["patient_issuer"]:
                changed.append("patient_issuer")
            was, now = ({name: one[name] for name in changed} for one in (seen, exam))
            append(db, "exam_changed", exam_id, by=by, reason=reason, before=was, after={**now, **apart})
            if once:
                keep_answer(db, once, exam)
        return exam

    def move(
        self,
        measurement_id: str,
        exam_id: str | None,
        *,
        version: int,
        by: str,
        reason: str,
        once: AskedOnce | None = None,
    ) -> None:
        """Say that a measurement belongs to another exam, or to none; what was measured stays.

        Where it belongs there already, or what was asked before by its key, nothing changes and nobody is told.

        Raises `UnknownResource` for either, `StaleVersion` when the measurement was moved or voided meanwhile, and
        `ReusedKey`.
        """
        with self._transaction() as db:
            if _was_done(db, once):
                return
            filing = _filing(db, measurement_id, version)
            if exam_id is not None:
                exam_of(db, exam_id)
            if exam_id == filing["exam_id"]:
                return
            _file(db, measurement_id, {**filing, "exam_id": exam_id})
            was, now = {"exam_id": filing["exam_id"]}, {"exam_id": exam_id}
            append(db, "measurement_moved", measurement_id, by=by, reason=reason, before=was, after=now)

    def void(self, measurement_id: str, *, version: int, by: str, reason: str, once: AskedOnce | None = None) -> None:
        """Say that a measurement does not count, and why; it stays readable. What was asked before changes nothing.

        Raises as `move`, and `InvalidRequest` for one that is void already.
        """
        with self._transaction() as db:
            if _was_done(db, once):
                return
            filing = _filing(db, measurement_id, version)
            if filing["voided"]:
                raise InvalidRequest(f"The measurement {measurement_id} is void already.", "Nothing is left to do.")
            voided = {"at": utc_now(), "by": by, "reason": reason}
            _file(db, measurement_id, {**filing, "voided": voided})
            append(
                db,
                "measurement_voided",
                measurement_id,
                by=by,
                reason=reason,
                before={"voided": None},
                after={"voided": voided},
            )


def _was_done(db: sqlite3.Connection, once: AskedOnce | None) -> bool:
    """Return whether an act was asked for before; of one that was not, note that it is done. Raises `ReusedKey`."""
    if once is None:
        return False
    if first_answer(db, once) is not None:
        return True
    keep_answer(db, once, {})
    return False


def filed(exam_id: str | None, voided: str | None, version: int | None) -> _Record:
    """Return what a row of `filing` says of its measurement, also when there is none."""
    if version is None:
        return dict(UNFILED)
    return {"exam_id": exam_id, "voided": voided and json.loads(voided), "version": version}


def exam_content(said: _Record) -> ExamContent:
    """Return an exam of its fields; raise `InvalidRequest` when they are none."""
    try:
        return ExamContent.model_validate(said)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, ("exam", *first["loc"])))
        raise InvalidRequest(f"{where}: {first['msg']}.", "Correct the field; no exam was made or changed.") from None


def told_exam(record: str, issuer: str | None) -> _Record:
    """Return an exam of its row, with who has issued the patient's reference, None where nobody has said so."""
    return {**json.loads(record), "patient_issuer": issuer}


def exam_of(db: sqlite3.Connection, exam_id: str, version: int | None = None) -> _Record:
    """Return an exam; raises as `Exams.exam`."""
    row = db.execute(f"SELECT record, issuer FROM {WITH_ISSUER} WHERE exam.id = ?", (exam_id,)).fetchone()
    if row is None:
        raise UnknownResource(f"There is no exam {exam_id}.", "Use the id that the API gave.")
    exam = told_exam(*row)
    _require_version("exam", exam_id, exam["version"], version)
    return exam


def require_open(db: sqlite3.Connection, asked: AskedExam) -> None:
    """Raise `ExamTooOld` when nobody goes on with an exam any more; raises as `Exams.exam` as well."""
    made_at = exam_of(db, asked.id, asked.version)["made_at"]
    if asked.asked_at is None:
        return
    if datetime.fromisoformat(asked.asked_at) - datetime.fromisoformat(made_at) > LONGEST_EXAM:
        cause = f"The exam {asked.id} was begun at {made_at}, more than {LONGEST_EXAM.days} days ago."
        raise ExamTooOld(cause, "Begin a new exam, and press for that one.")


def _filing(db: sqlite3.Connection, measurement_id: str, version: int) -> _Record:
    if not db.execute("SELECT 1 FROM measurement WHERE id = ?", (measurement_id,)).fetchone():
        raise UnknownResource(f"There is no measurement {measurement_id}.", "Use the id that the API gave.")
    query = "SELECT exam_id, voided, version FROM filing WHERE measurement_id = ?"
    filing = filed(*(db.execute(query, (measurement_id,)).fetchone() or (None, None, None)))
    _require_version("measurement", measurement_id, filing["version"], version)
    return filing


def _file(db: sqlite3.Connection, measurement_id: str, filing: _Record) -> None:
    voided = json.dumps(filing["voided"]) if filing["voided"] else None
    row = measurement_id, filing["exam_id"], voided, filing["version"] + 1
    db.execute("INSERT OR REPLACE INTO filing VALUES (?, ?, ?, ?)", row)


def _require_version(what: str, identifier: str, present: int, seen: int | None) -> None:
    if seen is not None and seen != present:
        cause = f"The {what} {identifier} has the version {present}: it was changed since the version {seen} was read."
        raise StaleVersion(cause, "Look at it as it is now, and decide anew.")
