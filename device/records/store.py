"""Measurements and press jobs in SQLite, recordings beside it: a .zip each, or a folder of an earlier release.

A recording is on the disk before its row is, and the row before the press is called done: `database` says how that
lasts. A job that a restart interrupted says so. Of a damaged database what can be read is shown, and nothing written.
"""

from __future__ import annotations

import errno
import fcntl
import json
import logging
import os
import sqlite3
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from device.errors import DamagedStoreError, DiskFullError, InterruptedPress, StorageError, UnknownResource
from device.files.durable import is_disk_read_only
from device.files.recording_file import FrameEncoder, png_of, remove_recording, write_recording
from device.measurement.recording.recording import Recording
from device.records.asked_once import AskedOnce, first_answer, keep_answer
from device.records.audit import Audit, append, utc_now
from device.records.database import open_database, open_to_read
from device.records.disk import Disk, LocalDisk, read_uncached
from device.records.exams import UNFILED, AskedExam, Exams, filed, require_open
from device.records.listing import Listing
from device.records.manifest import Fingerprint, fingerprint_of, note_kept
from device.records.outbox import Outbox, own_study
from device.records.recordings import RECORDINGS, KeptRecordings, StartFindings
from device.records.retention import Retention
from device.records.saved import Unsaved, unsaved
from device.records.tokens import Tokens

log = logging.getLogger(__name__)

StoredRecord = dict[str, Any]
ENDED = ("done", "rejected", "cancelled", "failed")
BROKEN_OFF, PRESS_AGAIN = "The daemon was restarted during the press:", "press again."


class Store:
    """The device's memory. All methods may be called from any thread."""

    def __init__(self, folder: Path, disk: Disk | None = None, *, to_read: bool = False) -> None:
        """Open or create; with `to_read` only read what is there, also beside a daemon.

        Raises `StorageError` when the folder cannot be written or holds no database, and `NewerDataError` when a newer
        release wrote it, before anything in it is changed. Of a damaged database what can be read is shown: see
        `require_whole`.
        """
        self.folder, self._disk, self._lock = folder, disk or LocalDisk(), threading.Lock()
        self.findings, self._ended_late = StartFindings(), dict[str, StoredRecord]()
        self.revision = 0
        """Is another one whenever something was kept since; to be looked at from any thread, for nothing."""
        with ExitStack() as opened:
            self._db, self._damage = self._opened_to_read(opened) if to_read else self._open(opened)
            self.exams, self.audit = Exams(self._transaction, own_study), Audit(self._transaction)
            self.tokens = Tokens(self._transaction)
            self.listing = Listing(self._transaction)
            self.outbox = Outbox(self._transaction)
            self.recordings = KeptRecordings(folder, self._transaction)
            self.retention = Retention(folder, self._transaction, self.recordings, lambda: self.free_mb)
            broken_off = [] if to_read else self._records("SELECT record FROM press WHERE ended = 0")
            self.interrupted = tuple(map(_broken_off, broken_off))
            if not (self._damage or to_read):
                self._put_in_order()
            self._opened = opened.pop_all()

    def _open(self, opened: ExitStack) -> tuple[sqlite3.Connection, DamagedStoreError | None]:
        try:
            (self.folder / RECORDINGS).mkdir(parents=True, exist_ok=True)
            self._take(opened)
            database = open_database(self.folder)
            opened.enter_context(closing(database.connection))
        except (OSError, sqlite3.Error) as error:
            remedy = "Free the disk or correct the setting `data`, then start the daemon again."
            raise StorageError(f"The store {self.folder} cannot be opened: {error}.", remedy) from error
        return database.connection, database.damage

    def _opened_to_read(self, opened: ExitStack) -> tuple[sqlite3.Connection, DamagedStoreError | None]:
        try:
            database = open_to_read(self.folder)
        except sqlite3.Error as error:
            remedy = "Correct the setting `data`, or run this as root or as the daemon's user."
            raise StorageError(f"The store {self.folder} cannot be read: {error}.", remedy) from error
        opened.enter_context(closing(database.connection))
        return database.connection, database.damage

    def _take(self, opened: ExitStack) -> None:
        """Hold the folder for this process: a second daemon on it would end the first one's presses."""
        lock_file = opened.enter_context((self.folder / "lock").open("w"))
        try:
            fcntl.flock(lock_file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            remedy = "Stop it, or give this one another folder with the setting `data`."
            raise StorageError(f"The store {self.folder} is in use by another daemon.", remedy) from None

    def _put_in_order(self) -> None:
        """End what the daemon before has left; a disk that is full just now puts that off, and stops nothing."""
        self._ended_late = {job["id"]: job for job in self.interrupted}
        try:
            self._end_interrupted()
        except DiskFullError as error:
            log.error("%s %s", error.code, error)
        try:
            self.findings = self.recordings.look_through()
        except OSError as error:
            raise StorageError(
                f"The recordings of {self.folder} cannot be read: {error}.", "Check the disk."
            ) from error

    def _end_interrupted(self) -> None:
        while self._ended_late:
            press_id, job = next(iter(self._ended_late.items()))
            self.save_press(job)
            self._ended_late.pop(press_id, None)

    def require_whole(self) -> None:
        """Raise `DamagedStoreError` when only a part of the database can be read: then nothing is measured."""
        if self._damage:
            raise self._damage

    @contextmanager
    def _transaction(self, on_kept: Callable[[], None] = lambda: None) -> Iterator[sqlite3.Connection]:
        """Keep all that is done with it or nothing; `on_kept` is called before anybody else reads what was kept."""
        try:
            with self._lock:
                with self._db:
                    yield self._db
                on_kept()
            self.revision = self._db.total_changes
        except (OSError, sqlite3.Error) as error:
            self.require_whole()
            kind = DiskFullError if _is_full(error) else StorageError
            remedy = "Free the disk, and let no other program hold the database."
            raise kind(f"The disk did not take the record: {error}.", remedy) from error

    def _records(self, query: str, *values: object) -> list[StoredRecord]:
        with self._transaction() as db:
            return [json.loads(row[-1]) for row in db.execute(query, values)]

    def require_space(self, free_mb: float) -> None:
        """Raise `DiskFullError` when less than `free_mb` (1e6 bytes) is left, `StorageError` when nobody can say.

        Raises as `require_whole` as well. What a full disk has put off at the start is done once there is space.
        """
        self.require_whole()
        left_mb = self.free_mb
        if left_mb < free_mb:
            cause = f"The disk of {self.folder} has {left_mb:.0f} MB left, below {free_mb:g} MB."
            raise DiskFullError(cause, "Save them with `python -m device backup FOLDER`, then free space.")
        self._end_interrupted()

    def unsaved(self) -> Unsaved:
        """Return what no backup holds now; raise `StorageError` when nobody can say."""
        with self._transaction() as db:
            return unsaved(db, self.folder, utc_now())

    @property
    def free_mb(self) -> float:
        """Return the space that is left, in 1e6 bytes; raise `StorageError` when nobody can say."""
        try:
            return self._disk.free_bytes(self.folder) / 1e6
        except OSError as error:
            raise StorageError(f"The disk of {self.folder} is gone: {error}.", "Check the disk.") from error

    def read_back(self, content: bytes) -> bytes:
        """Write a file as a recording's is written, read it and remove it; raise `StorageError` or `DiskFullError`."""
        path = self.folder / "self-test.tmp"
        try:
            with self._disk.file(path) as file:
                file.write(content)
            return read_uncached(path)
        except OSError as error:
            kind = DiskFullError if _is_full(error) else StorageError
            raise kind(f"A file could not be written and read: {error}.", "Free space, or check the disk.") from error
        finally:
            with suppress(OSError):  # a read-only disk refuses that too, and its fault is already under way
                path.unlink(missing_ok=True)

    def prove(self, *, writing: bool) -> None:
        """Read the database, and write and commit when asked to; raise `StorageError` when the disk refuses either.

        A disk with errors is shut by the kernel: that is told without a write, which wears a card.
        """
        if os.statvfs(self.folder).f_flag & os.ST_RDONLY or is_disk_read_only(self.folder):
            raise StorageError(f"The disk of {self.folder} can only be read.", "Restart the probe; check its card.")
        with self._transaction() as db:
            db.execute("SELECT count(*) FROM counter").fetchone()
            if writing:
                db.execute(
                    "INSERT OR REPLACE INTO counter VALUES ('proofs', 1 + coalesce("
                    "(SELECT value FROM counter WHERE name = 'proofs'), 0))"
                )

    def save_press(self, job: StoredRecord, once: AskedOnce | None = None, exam: AskedExam | None = None) -> None:
        """Keep the state of a press job, and with it that it is the answer to a request that is obeyed once.

        Raises as `require_open` when the exam that it is asked for is not there, not as its client has seen it, or too
        old. A press that was kept once is never asked again: its measurement stays in the exam.
        """
        with self._transaction() as db:
            if exam:
                require_open(db, exam)
            _keep_press(db, job)
            if once:
                keep_answer(db, once, job)

    def answer_to(self, once: AskedOnce) -> StoredRecord | None:
        """Return what a request was answered with the first time, or None; raise `ReusedKey` when it was another."""
        with self._transaction() as db:
            return first_answer(db, once)

    def press(self, press_id: str) -> StoredRecord:
        """Return a press job; raise `UnknownResource` when there is none of that id."""
        found = self._records("SELECT record FROM press WHERE id = ?", press_id)
        if not found:
            raise _unknown("press", press_id)
        return self._ended_late.get(press_id, found[0])

    def last_press(self) -> StoredRecord | None:
        """Return the press job that changed last, None when there was none."""
        found = self._records("SELECT record FROM press ORDER BY rowid DESC LIMIT 1")
        return self._ended_late.get(found[0]["id"], found[0]) if found else None

    def add_measurement(
        self,
        record: StoredRecord,
        recording: Recording,
        *,
        exam_id: str | None = None,
        encode: FrameEncoder = png_of,
        picture: bytes = b"",
        ended: StoredRecord | None = None,
        on_kept: Callable[[], None] = lambda: None,
    ) -> StoredRecord:
        """Keep a recording, its picture and its measurement, of an exam if given; return it with its sequence number.

        `encode` may know PNGs of the frames that were made before. `ended` is the press that the measurement ends: both
        are kept or none, so that no measurement is of a press that failed. `on_kept` is called before anybody reads it.
        """
        self.require_whole()
        path = self.recordings.place_of(recording.id)
        self.write_out(recording, path, encode=encode, picture=picture)
        try:
            written = _fingerprint(path)
            with self._transaction(on_kept) as db:
                cursor = db.execute("INSERT INTO measurement (id, record) VALUES (?, ?)", (record["id"], "{}"))
                whole = {"id": record["id"], "seq": cursor.lastrowid, **record}
                db.execute("UPDATE measurement SET record = ? WHERE id = ?", (json.dumps(whole), record["id"]))
                note_kept(db, recording.id, written)
                if exam_id:
                    db.execute("INSERT INTO filing VALUES (?, ?, NULL, 1)", (record["id"], exam_id))
                if ended:
                    _keep_press(db, ended)
        except StorageError:
            remove_recording(path)
            raise
        return whole | UNFILED | {"exam_id": exam_id}

    def write_out(
        self, recording: Recording, path: Path, *, encode: FrameEncoder = png_of, picture: bytes = b""
    ) -> None:
        """Write a recording to a new .zip or folder, durably, and remember nothing of it; raise `StorageError`."""
        try:
            write_recording(recording, path, encode=encode, picture=picture, opened=self._disk.file)
        except OSError as error:
            kind = DiskFullError if _is_full(error) else StorageError
            raise kind(f"The recording could not be written: {error}.", "Free space on the disk.") from error

    def measurement(self, measurement_id: str) -> StoredRecord:
        """Return a measurement; raise `UnknownResource` when there is none of that id."""
        found = self._measurements("id = ?", measurement_id)
        if not found:
            raise _unknown("measurement", measurement_id)
        return found[0]

    def measurements(self, *, before_seq: int, limit: int, exam_id: str | None = None) -> list[StoredRecord]:
        """Return the newest measurements before a sequence number, newest first, all or those of an exam."""
        if exam_id is None:
            return self._measurements("seq < ? ORDER BY seq DESC LIMIT ?", before_seq, limit)
        return self._measurements("seq < ? AND exam_id = ? ORDER BY seq DESC LIMIT ?", before_seq, exam_id, limit)

    def _measurements(self, where: str, *values: object) -> list[StoredRecord]:
        """Return measurements as they were taken, each with what was said of it since."""
        query = "SELECT record, exam_id, voided, version FROM measurement LEFT JOIN filing ON measurement_id = id"
        with self._transaction() as db:
            rows = db.execute(f"{query} WHERE {where}", values)
            return [{**json.loads(record), **filed(*filing)} for record, *filing in rows]

    def add_light_on_s(self, seconds: float) -> None:
        """Add to the time that the LEDs have been on in their life."""
        with self._transaction() as db:
            db.execute("INSERT OR IGNORE INTO counter VALUES ('light_on_s', 0)")
            db.execute("UPDATE counter SET value = value + ? WHERE name = 'light_on_s'", (seconds,))

    @property
    def light_on_s(self) -> float:
        """Return how long the LEDs have been on in their life, as far as it was kept."""
        with self._transaction() as db:
            return float(sum(row[0] for row in db.execute("SELECT value FROM counter WHERE name = 'light_on_s'")))

    def recording_path(self, recording_id: str) -> Path:
        """Return where a recording lies, a .zip or a folder; raises as `KeptRecordings.path`."""
        return self.recordings.path(recording_id)

    def close(self) -> None:
        """Close the database and let go of the folder."""
        with self._lock:
            self._opened.close()


def _fingerprint(path: Path) -> Fingerprint:
    try:
        return fingerprint_of(path)
    except OSError as error:
        raise StorageError(f"The recording cannot be read back: {error}.", "Check the disk.") from error


def _unknown(what: str, identifier: str) -> UnknownResource:
    return UnknownResource(f"There is no {what} {identifier}.", "Use the id that the API gave.")


def _broken_off(job: StoredRecord) -> StoredRecord:
    """Return a press as it has ended when the daemon did before it; nobody knows how long its LEDs were on."""
    return job | {
        "state": "failed",
        "light_on_s": None,
        "code": InterruptedPress.code,
        "reason": f"{BROKEN_OFF} {PRESS_AGAIN}",
    }


def _keep_press(db: sqlite3.Connection, job: StoredRecord) -> None:
    """Keep the state of a press, and write into the audit that it began, and how it ended."""
    kept = db.execute("SELECT ended FROM press WHERE id = ?", (job["id"],)).fetchone()
    if kept is None:
        log.info("press id=%s state=%s mode=%s", job["id"], job["state"], job.get("mode"))
        append(db, "press_begun", job["id"], after={name: job.get(name) for name in ("mode", "exam_id")})
    if job["state"] in ENDED and not (kept and kept[0]):
        ended = (*(job.get(name) for name in ("id", "state", "mode", "code", "measurement_id")),)
        log.info("press id=%s state=%s mode=%s code=%s measurement_id=%s", *ended)
        append(
            db, "press_ended", job["id"], after={name: job.get(name) for name in ("state", "code", "measurement_id")}
        )
    row = job["id"], job["state"] in ENDED, json.dumps(job)
    db.execute("INSERT OR REPLACE INTO press VALUES (?, ?, ?)", row)


def _is_full(error: Exception) -> bool:
    """Return whether an error of the file system or of SQLite says that no space is left."""
    if isinstance(error, OSError):
        return error.errno in (errno.ENOSPC, errno.EDQUOT)
    return getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL
