"""The support file: a zip of what a maintainer needs to know, `tsis.support/1`, without patients' data.

It is written also where no daemon starts: each section is collected by itself, in a time of its own, and one that
cannot be had says why in `summary.json`. Only the standard library is needed to begin with.
"""

from __future__ import annotations

import json
import os
import threading
import time
import zipfile
from pathlib import Path
from typing import Any

from device import __version__
from device.care.known_words import known_only
from device.care.support_sections import SECTIONS, SupportContext

SCHEMA = "tsis.support/1"
SUMMARY = "summary.json"
PRIVATE = 0o600
SECTION_S = 20.0
"""A disk that does not answer costs this, not the file."""


def write_support(file: Path, context: SupportContext) -> dict[str, str]:
    """Write the support file, over one that is there; return for each section "ok", or why it is missing.

    Raises `OSError` when the file cannot be written.
    """
    collected = {name: _collected(name, context) for name in SECTIONS}
    told = {name: reason for name, (_, reason) in collected.items()}
    made_at = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
    summary = {"schema": SCHEMA, "software": __version__, "made_at": made_at, "sections": told}
    temporary = file.with_name(file.name + ".tmp")
    temporary.unlink(missing_ok=True)
    try:
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, PRIVATE)
        with open(handle, "wb") as stream:
            with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
                archive.writestr(SUMMARY, _json(summary))
                for name, (content, _) in collected.items():
                    if content is not None:
                        archive.writestr(f"{name}.json", _json(content))
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(file)
    finally:
        temporary.unlink(missing_ok=True)
    return told


def _collected(name: str, context: SupportContext) -> tuple[dict[str, Any] | None, str]:
    """Return a section, or None, with "ok" or the reason; one that does not return is left behind."""
    ended: list[tuple[dict[str, Any] | None, str]] = []

    def collect() -> None:
        try:
            ended.append((SECTIONS[name](context), "ok"))
        except Exception as error:  # noqa: BLE001 - whatever it is, it is the reason
            ended.append((None, f"{type(error).__name__}: {known_only(str(error))}"))

    thread = threading.Thread(target=collect, name=f"support {name}", daemon=True)
    thread.start()
    thread.join(SECTION_S)
    return ended[0] if ended else (None, f"It did not come within {SECTION_S:g} s.")


def _json(value: Any) -> str:
    return json.dumps(value, indent=1, default=str)
