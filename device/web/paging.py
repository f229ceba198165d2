"""What a list can be asked for: which page, and which records; and how a page says where the next one begins.

A parameter that the API does not have is refused: a filter with a misspelt name would answer with everybody's records.
"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated, Any, TypedDict

from pydantic import AfterValidator, AwareDatetime, BaseModel, BeforeValidator, ConfigDict, Field

from device.instrument.status import JobState
from device.measurement.estimate import EstimateStatus
from device.measurement.mode import Mode
from device.records.audit import recorded
from device.records.exams import ExamId, ExamKind
from device.records.listing import NEWEST, Page, Wanted


def _as_text(said: Any) -> Any:
    """Refuse numbers, which would be taken for seconds since 1970."""
    if isinstance(said, str) and said[4:5] != "-":
        raise ValueError("must be a time of RFC 3339 with its offset, as 2026-01-02T03:04:05Z")
    return said


def _in_utc(moment: datetime) -> datetime:
    try:
        return moment.astimezone(UTC)
    except OverflowError:
        raise ValueError("must be a time of the years 1 to 9999 in UTC") from None


Moment = Annotated[AwareDatetime, BeforeValidator(_as_text), AfterValidator(_in_utc)]


def _is_number(said: str) -> str:
    if int(said) > NEWEST:
        raise ValueError("must be the `next` of an answer")
    return said


Cursor = Annotated[str, Field(pattern="^[1-9][0-9]{0,18}$"), AfterValidator(_is_number)]


class PageQuery(BaseModel):
    """Which page: `cursor` is the `next` of the one before; `before_seq` that of clients from before there was one."""

    model_config = ConfigDict(extra="forbid")
    cursor: Cursor | None = Field(default=None, description="The `next` of the page before.")
    before_seq: Annotated[int, Field(ge=1, le=NEWEST)] = Field(default=NEWEST, description="Use `cursor` instead.")
    limit: Annotated[int, Field(ge=1, le=200)] = 20

    @property
    def before(self) -> int:
        """Below which number the records of this page are."""
        return int(self.cursor) if self.cursor else self.before_seq


class _Times(TypedDict):
    since: str | None
    until: str | None


class TimedQuery(BaseModel):
    """Of which time; `to` is not in it any more."""

    model_config = ConfigDict(extra="forbid")
    since: Moment | None = Field(default=None, alias="from", description="RFC 3339 with its offset.")
    until: Moment | None = Field(default=None, alias="to", description="RFC 3339 with its offset; not in it any more.")

    @property
    def times(self) -> _Times:
        """The same as records have it."""
        return {"since": _recorded(self.since), "until": _recorded(self.until)}


class MeasurementFilter(TimedQuery):
    """Measurements of an exam, a time, a mode, and of what became of them."""

    exam_id: ExamId | None = None
    mode: Mode | None = None
    outcome: EstimateStatus | None = Field(default=None, description="The status of the estimate.")
    after_seq: Annotated[int, Field(ge=0, le=NEWEST)] | None = Field(
        default=None, description="Those kept after the measurement of this `seq`, for who comes back for what is new."
    )

    @property
    def wanted(self) -> Wanted:
        """The same for the store."""
        return Wanted(
            exam_id=self.exam_id, mode=self.mode, outcome=self.outcome, after_seq=self.after_seq, **self.times
        )


class MeasurementQuery(MeasurementFilter, PageQuery):
    """A page of measurements."""


class PressQuery(TimedQuery, PageQuery):
    """A page of presses: of the exam they were asked for, by when that was."""

    exam_id: ExamId | None = None
    mode: Mode | None = None
    outcome: JobState | None = Field(default=None, description="The state.")

    @property
    def wanted(self) -> Wanted:
        """The same for the store."""
        return Wanted(exam_id=self.exam_id, mode=self.mode, outcome=self.outcome, **self.times)


class ExamQuery(TimedQuery, PageQuery):
    """A page of exams, those of patients unless told otherwise, by when they were made."""

    kind: ExamKind = "patient"
    patient_ref: str | None = Field(default=None, description="Of every issuer, unless `patient_issuer` says which.")
    patient_issuer: str | None = Field(default=None, description="Empty: exams of no known issuer.")
    order_number: str | None = None


class AuditQuery(TimedQuery, PageQuery):
    """A page of the audit, of all or of one subject, by when it was done."""

    subject: Annotated[str, Field(min_length=1)] | None = None


def _recorded(moment: datetime | None) -> str | None:
    return None if moment is None else recorded(moment)


def page_of(name: str, page: Page) -> dict[str, Any]:
    """Return a page as its answer: the records by their name, and the cursor of the next page."""
    return {name: page.records, "next": None if page.next_before is None else str(page.next_before)}


def paged(name: str, records: list[dict[str, Any]], limit: int) -> dict[str, Any]:
    """Return as `page_of` what was asked for with one record more than the page has, each with its `seq`."""
    more = len(records) > limit
    return page_of(name, Page(records[:limit], records[limit - 1]["seq"] if more else None))
