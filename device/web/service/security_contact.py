"""Where a vulnerability of this probe is reported, and until when there are updates: RFC 9116's security.txt.

Contact and day are the maker's, who sets them in the vendor's settings; without them there is no such file, rather than
one that nobody reads.
"""

from __future__ import annotations

from collections.abc import Callable

from fastapi import FastAPI
from fastapi.responses import PlainTextResponse

from device.access.scopes import SECURITY_CONTACT
from device.config import MakerSection
from device.errors import UnknownResource


def add_security_contact(app: FastAPI, maker: Callable[[], MakerSection]) -> None:
    """Add the file where RFC 9116 (section 3) wants it; whoever finds something has no token."""

    @app.get(SECURITY_CONTACT, include_in_schema=False)
    def security_contact() -> PlainTextResponse:
        return PlainTextResponse(security_text(maker()))


def security_text(maker: MakerSection) -> str:
    """Return the file; raise `UnknownResource` where nobody is named."""
    if maker.security_contact is None:
        cause = "Nobody is named to whom a vulnerability of this probe is reported."
        raise UnknownResource(cause, "Set maker.security_contact; see docs/threat_model.md.")
    lines = [
        f"Contact: {maker.security_contact}",
        f"Expires: {maker.updates_until}T23:59:59Z",
        "Preferred-Languages: en, de",
        f"# There are updates for this probe until {maker.updates_until}.",
    ]
    return "\n".join(lines) + "\n"
