"""A change as a notice: what was done, to which record, and where it is read. It names no patient, order or person.

Form and signature are those of Standard Webhooks (https://www.standardwebhooks.com), which has libraries that verify
them in most languages: `webhook-id`, `webhook-timestamp`, and HMAC-SHA256 over both and the body.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import hmac
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.errors import WebhookFailed
from device.records.listing import Change

API = "/api/v1"
PREFIX = "whsec_"
FEWEST_BYTES, MOST_BYTES = 24, 64
"""Of a secret, by Standard Webhooks."""
READ_BY_ALL = 0o007
MAKE_ONE = (
    'Make one: (umask 027; echo "whsec_$(openssl rand -base64 32)" > FILE), let the daemon\'s group read it, and '
    "give the receiver the same."
)
TYPES = {
    "press_ended": "measurement.taken",
    "measurement_moved": "measurement.moved",
    "measurement_voided": "measurement.voided",
    "exam_made": "exam.made",
    "exam_changed": "exam.changed",
}
"""What a notice of each kind of the audit's entries is called."""


@dataclass(frozen=True)
class Notice:
    """What is posted: its id, which stays the same however often it is sent, and its body."""

    id: str
    type: str
    body: bytes


def notice_of(change: Change, serial: str) -> Notice:
    """Return the notice of a change on the probe `serial`; its record is told as it is now."""
    kind = TYPES[change.what]
    said = {"type": kind, "timestamp": change.at, "data": {"serial": serial, **_data(change)}}
    return Notice(change.hash, kind, json.dumps(said).encode())


def _data(change: Change) -> dict[str, Any]:
    record, path = change.record, f"{API}/{change.kind}s/{change.record['id']}"
    told = {"number": change.number, "id": record["id"], "href": path, "version": record["version"]}
    if change.kind == "exam":
        return {**told, "kind": record["kind"]}
    of_measurement = {name: record.get(name) for name in ("taken_at", "mode", "exam_id")}
    of_estimate = {name: record["estimate"][name] for name in ("status", "simulated")}
    return {**told, **of_measurement, **of_estimate, "voided": record["voided"] is not None}


def signed_headers(notice: Notice, secret: bytes, at_s: int) -> dict[str, str]:
    """Return the headers of a notice that is sent at a time (s since 1970)."""
    signed = f"{notice.id}.{at_s}.".encode() + notice.body
    signature = base64.b64encode(hmac.digest(secret, signed, hashlib.sha256)).decode()
    return {"webhook-id": notice.id, "webhook-timestamp": str(at_s), "webhook-signature": f"v1,{signature}"}


def read_secret(file: Path) -> bytes:
    """Return the secret of a file; raise `WebhookFailed` when there is none, or everybody on the probe may read it."""
    try:
        mode, text = file.stat().st_mode, file.read_text(encoding="ascii").strip()
        secret = base64.b64decode(text.removeprefix(PREFIX), validate=True)
    except OSError as error:
        raise WebhookFailed(f"The secret {file} cannot be read: {error.strerror}.", MAKE_ONE) from None
    except (UnicodeDecodeError, binascii.Error):
        raise WebhookFailed(f"The secret {file} is not written in base64.", MAKE_ONE) from None
    if not text.startswith(PREFIX) or not FEWEST_BYTES <= len(secret) <= MOST_BYTES:
        cause = f"The secret {file} must be `{PREFIX}` and {FEWEST_BYTES} to {MOST_BYTES} bytes in base64."
        raise WebhookFailed(cause, MAKE_ONE)
    if mode & READ_BY_ALL:
        raise WebhookFailed(f"Everybody may read the secret {file}.", f"Forbid it: chmod o= {file}; or make another.")
    return secret
