"""Which recordings the settings' rule deletes now, over REST: shown before the daemon follows it once an hour."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel, ConfigDict

from device.config import Config
from device.instrument.watch.recordings_watch import retention_rule
from device.records.store import Store
from device.web.contract import answers


class RetentionSettings(BaseModel):
    """The rule: None of both is never."""

    model_config = ConfigDict(extra="forbid")
    keep_days: float | None
    free_mb: float | None
    saved_first: bool


class DueRecording(BaseModel):
    """A recording that the rule deletes, and why."""

    model_config = ConfigDict(extra="forbid")
    recording_id: str
    measurement_id: str
    taken_at: str
    size_bytes: int
    why: str


class DueRecordings(BaseModel):
    """What the rule deletes now, oldest first; `held_back` recordings wait for a backup, the last is of `saved_at`."""

    model_config = ConfigDict(extra="forbid")
    rule: RetentionSettings
    saved_at: str | None
    removals: list[DueRecording]
    held_back: int
    size_bytes: int


def add_retention(app: FastAPI, api: str, config: Callable[[], Config], store: Store) -> None:
    """Add the route below `api` that shows what the rule of the settings deletes."""

    @app.get(f"{api}/retention", responses=answers(200, DueRecordings), tags=["device"])
    def get_retention() -> dict[str, Any]:
        """Return which recordings the settings' rule deletes now; it changes nothing."""
        return store.retention.plan(retention_rule(config())).as_record()
