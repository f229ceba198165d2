"""What the daemon knows of the hospital: the one door to this room. It imports DICOM's libraries when first needed."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from datetime import date
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from device.config import DicomSection
from device.dicom.sender import Sender
from device.dicom.subject import OrderedStudy, is_ordered, require_writable
from device.errors import DeviceError, NotSetUp, UnknownResource, WorklistBusy
from device.records.asked_once import AskedOnce
from device.records.audit import utc_now
from device.records.exams import AskedExam, exam_content
from device.records.outbox import COUNTS
from device.records.store import Store, StoredRecord

if TYPE_CHECKING:
    from device.dicom.delivery import Delivery
    from device.dicom.objects import DicomWriter
    from device.dicom.outgoing import Outgoing
    from device.dicom.worklist import ScheduledStep, WorklistQuery

MOST_QUERIES = 2
"""Queries of the worklist at once: each may last most of a minute, and has a worker thread of the web for as long."""
SHOWN_FOR_MIN = 15
"""An exam is begun of a step that was asked for so long ago at most (minutes), by a clock that nobody sets."""
MOST_ANSWERS = 50
"""Answers that are kept: the newest one of so many different queries."""


class Hospital:
    """Exams in the hospital's formats, and the way to its archive; all methods may be called from any thread."""

    def __init__(
        self,
        settings: DicomSection,
        store: Store,
        picture_of: Callable[[Path], bytes],
        tell: Callable[[DeviceError | None], None] = lambda fault: None,
        is_busy: Callable[[], bool] = lambda: False,
        is_clock_steady: Callable[[], bool] = lambda: True,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Take the settings, the store, who returns the picture (a PNG) of a kept recording, and whom to tell faults.

        Nothing is sent before `start`, nor while the probe is busy with a press; names are erased by a steady clock.
        `clock` (s), which nobody sets, says how long ago a step of the worklist was shown.
        """
        self._settings, self._store, self._picture_of = settings, store, picture_of
        self._tell, self._is_busy, self._is_clock_steady = tell, is_busy, is_clock_steady
        self._shown, self._queries = ShownSteps(clock), threading.Semaphore(MOST_QUERIES)

    def start(self) -> None:
        """Begin to send what waits, if there is an archive, and to erase names in any case."""
        self._sender.start()

    def close(self) -> None:
        """End sending; what waits is sent after the next start."""
        self._sender.close()

    def files_of(self, exam_id: str) -> bytes:
        """Return an exam as DICOM files in one .zip; raises as `exam_zip`."""
        from device.dicom.exam_files import exam_zip

        return exam_zip(self._store, self._writer, exam_id)

    def send(self, exam_id: str, *, version: int, by: str) -> dict[str, str]:
        """Queue an exam as it was seen in a version; return and raise as `Outgoing.queue`.

        Raises `NotSetUp` when no archive is set.
        """
        if self._settings.archive_host is None:
            raise NotSetUp("No archive is set.", "Set dicom.archive_host, its port and its title.")
        missing = self._outgoing.queue(exam_id, version=version, by=by)
        self._sender.wake()
        return missing

    def objects_of(self, exam_id: str) -> list[StoredRecord]:
        """Return the objects of an exam that were ever to be at the archive, oldest first."""
        self._store.exams.exam(exam_id)
        return [_told(row) for row in self._store.outbox.of_exam(exam_id)]

    def scheduled(self, day: date | None, patient_ref: str | None, order_number: str | None) -> list[dict[str, Any]]:
        """Return what the worklist has, of a day, a patient or an order; raises as `scheduled_steps`.

        Raises `NotSetUp` when no worklist is set, and `WorklistBusy` at once while it is asked twice.
        """
        if self._settings.worklist_host is None:
            raise NotSetUp("No worklist is set.", "Set dicom.worklist_host, its port and its title.")
        from device.dicom.association import worklist_of
        from device.dicom.worklist import WorklistQuery, scheduled_steps

        remote = worklist_of(self._settings)
        assert remote is not None  # as its host is set
        query = WorklistQuery(day, patient_ref, order_number)
        with self._one_query():
            asked_s = self._shown.now_s()
            steps = scheduled_steps(remote, self._settings, query)
        self._shown.keep(query, steps, asked_s)
        return [step.as_record() for step in steps]

    def begin_exam(self, step_id: str, said: dict[str, Any], once: AskedOnce | None = None) -> StoredRecord:
        """Make an exam of a step that was shown, and of what the operator says beside; return it.

        Raises `UnknownResource` for a step that was not shown within 15 minutes, or that a newer answer has not,
        `InvalidRequest` when patient or order are none that an exam can have, and `ReusedKey`.
        """
        if once and (kept := self._store.answer_to(once)):
            return kept
        step = self._shown.step(step_id)
        order = step.order
        whose = {"kind": "patient", "patient_ref": order.patient_ref, "order_number": order.order_number or None}
        content = exam_content({**said, **whose})
        require_writable(content.model_dump())
        told = asdict(order)
        patient = told.pop("patient")
        outbox, issuer = self._store.outbox, patient.get("issuer") or None
        keep = lambda db, exam_id: outbox.order(db, exam_id, told, patient, step.scheduled_at)  # noqa: E731
        return self._store.exams.make(content, once, keep, issuer)

    def begin_another(
        self, exam_id: str, said: dict[str, Any], *, version: int, once: AskedOnce | None = None
    ) -> StoredRecord:
        """Make an exam of the patient and order of another one, as it was seen in a version; return it.

        Raises as `Exams.make_like`, and `UnknownResource` when the worklist has its order no longer, as it has shown.
        That it was shown lately is not asked for: whoever began the exam has seen it, and the patient is still here.
        """
        if once and (kept := self._store.answer_to(once)):
            return kept
        outbox, exams = self._store.outbox, self._store.exams
        exam, ordered = exams.exam(exam_id, version), outbox.ordered(exam_id)
        like = AskedExam(exam_id, version, utc_now() if self._is_clock_steady() else None)
        order = OrderedStudy(**ordered[0]) if ordered else None
        if order is None or not is_ordered(exam, order):
            return exams.make_like(like, said, once)
        self._shown.require_still_there(order, outbox.scheduled_at(exam_id))
        return exams.make_like(like, said, once, lambda db, new_id: outbox.order_as(db, new_id, exam_id))

    def as_record(self) -> dict[str, Any]:
        """Return where archive and worklist are, how many objects are in which state, and what is wrong."""
        said, counts = self._settings, self._store.outbox.counts()
        state = self._sender.state
        return {
            "own_title": said.own_title,
            "archive": _place(said.archive_host, said.archive_port, said.archive_title),
            "worklist": _place(said.worklist_host, said.worklist_port, said.worklist_title),
            "send_phantoms": said.send_phantoms,
            "objects": counts,
            "fault": state.fault.as_record() if state.fault else None,
            "next_try_at": state.next_try_at,
        }

    @contextmanager
    def _one_query(self) -> Iterator[None]:
        if not self._queries.acquire(blocking=False):  # whoever waited here would keep a thread from other requests
            cause = f"The worklist is asked {MOST_QUERIES} times at once already, and no more than that."
            raise WorklistBusy(cause, f"Ask again in {WorklistBusy.wait_s} s, or begin the exam without the worklist.")
        try:
            yield
        finally:
            self._queries.release()

    @cached_property
    def _sender(self) -> Sender:
        days, deliver = (
            self._settings.demographics_days,
            self._delivery if self._settings.archive_host is not None else None,
        )
        return Sender(
            self._store.outbox,
            deliver,
            keep_patients_days=days,
            tell=self._tell,
            is_busy=self._is_busy,
            is_clock_steady=self._is_clock_steady,
        )

    @cached_property
    def _writer(self) -> DicomWriter:
        from device.dicom.objects import DicomWriter

        return DicomWriter(self._store, self._picture_of, self._settings.institution)

    @cached_property
    def _outgoing(self) -> Outgoing:
        from device.dicom.outgoing import Outgoing

        return Outgoing(self._store, self._writer, with_phantoms=self._settings.send_phantoms)

    def _delivery(self) -> Delivery:
        from device.dicom.association import archive_of
        from device.dicom.delivery import Delivery

        archive = archive_of(self._settings)
        assert archive is not None  # or there were no sender
        return Delivery(self._settings, archive, self._store, self._outgoing)


def _told(row: StoredRecord) -> StoredRecord:
    about = row.pop("about")  # what is written again is no answer to anybody
    told = {name: value for name, value in row.items() if name not in COUNTS}
    return {**told, "kind": about["kind"], "study_uid": about["study_uid"]}


def _place(host: str | None, port: int, title: str) -> dict[str, Any] | None:
    return None if host is None else {"host": host, "port": port, "title": title}


@dataclass(frozen=True)
class WorklistAnswer:
    """What the worklist had, by the steps' ids, when it was asked (s)."""

    asked_s: float
    steps: dict[str, ScheduledStep]


class ShownSteps:
    """Steps of the worklist of which an exam may be begun; all methods may be called from any thread.

    A hospital cancels orders and merges patients all day, and does not tell the probe: what was shown in the morning is
    no order of the afternoon, and neither is what a newer answer ought to have and has not.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock, self._lock = clock, threading.Lock()
        self._answers: dict[WorklistQuery, WorklistAnswer] = {}

    def now_s(self) -> float:
        """Return the time that a query is asked at (s)."""
        return self._clock()

    def keep(self, query: WorklistQuery, steps: list[ScheduledStep], asked_s: float) -> None:
        """Keep the whole answer to a query that was asked at a time; it stands for every older answer to the same."""
        with self._lock:
            known = self._answers.get(query)
            if known is None or known.asked_s <= asked_s:  # two at once need not answer in the order of asking
                self._answers[query] = WorklistAnswer(asked_s, {step.id: step for step in steps})
            since_s = self._recent_since_s()
            newest = self._newest_first()[:MOST_ANSWERS]
            self._answers = {query: one if one.asked_s >= since_s else _nameless(one) for query, one in newest}

    def step(self, step_id: str) -> ScheduledStep:
        """Return a step; raise `UnknownResource` when it was not shown lately, or is no more."""
        with self._lock:
            since_s = self._recent_since_s()
            answers = [one for one in self._newest_first() if one[1].asked_s >= since_s]
        for older, (_, answer) in enumerate(answers):
            if step := answer.steps.get(step_id):
                if any(query.ought_to_have(step.order, step.scheduled_at) for query, _ in answers[:older]):
                    break
                return step
        cause = f"The worklist has not shown the step {step_id} within {SHOWN_FOR_MIN} minutes, or has it no longer."
        raise UnknownResource(cause, "Ask for the worklist again, and choose a step that it has now.")

    def require_still_there(self, order: OrderedStudy, scheduled_at: str) -> None:
        """Raise `UnknownResource` when the newest answer that ought to have an order has it no longer.

        However long ago that answer is; of what no answer says anything it is there. Names do not count.
        """
        with self._lock:
            answers = self._newest_first()
        for query, answer in answers:
            if any(replace(step.order, patient={}) == order for step in answer.steps.values()):
                return
            if query.ought_to_have(order, scheduled_at):
                cause = f"The worklist has the order {order.order_number or order.study_uid} no longer."
                raise UnknownResource(cause, "Ask for the worklist again, and choose a step that it has now.")

    def _recent_since_s(self) -> float:
        return self._clock() - 60.0 * SHOWN_FOR_MIN

    def _newest_first(self) -> list[tuple[WorklistQuery, WorklistAnswer]]:
        return sorted(self._answers.items(), key=lambda one: -one[1].asked_s)


def _nameless(answer: WorklistAnswer) -> WorklistAnswer:
    """Return an answer without who the patients are: no exam is begun of it any more."""
    steps = {name: replace(step, order=replace(step.order, patient={})) for name, step in answer.steps.items()}
    return replace(answer, steps=steps)
