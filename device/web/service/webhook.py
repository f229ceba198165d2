"""How far the hospital's address for notices was told of what was measured and changed."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel, ConfigDict

from device.web.contract import answers
from device.web.schema import Fault, Instant
from device.webhook.notifier import Notifier


class WebhookStatus(BaseModel):
    """Where notices go (host and port), and how far: all null where no address is set.

    `told` is the `seq` of the audit's entry of the last notice that was taken, `newest` that of the newest entry, which
    need not have a notice. `fault`: why the address has not got what it is to have; `next_try_at`: when it is tried
    again.
    """

    model_config = ConfigDict(extra="allow")
    address: str | None
    told: int | None
    newest: int | None
    fault: Fault | None
    next_try_at: Instant | None


def add_webhook(app: FastAPI, api: str, notifier: Notifier | None) -> None:
    """Add the route below `api` that says what the address has not got yet."""

    @app.get(f"{api}/webhook", responses=answers(200, WebhookStatus), tags=["hospital"])
    def get_webhook() -> dict[str, Any]:
        """Say how far the hospital's address for notices was told of measurements and exams."""
        return notifier.as_record() if notifier else dict.fromkeys(WebhookStatus.model_fields)
