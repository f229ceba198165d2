"""The support file: a zip of what a maintainer needs to know, `tsis.support/1`, without patients' data.

It is written also where no daemon starts: the sections are collected side by side, each by itself, and one that cannot
be had in time says why in `summary.json`. Only the standard library is needed to begin with.
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
from device.care.known_words import known_only, learn_words
from device.care.support_sections import SECTIONS, SupportContext

SCHEMA = "tsis.support/1"
SUMMARY = "summary.json"
PRIVATE = 0o600
WITHIN_S = 30.0
"""A disk that does not answer costs this, not the file; who shows the file waits for a minute."""
Answered = tuple[dict[str, Any] | None, str]
"""Its content, and "ok"; or None and why."""


def write_support(file: Path, context: SupportContext) -> dict[str, str]:
    """Write the support file, over one that is there; return for each section "ok", or why it is missing.

    Raises `OSError` when the file cannot be written.
    """
    collected = _collected(context)
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


def _collected(context: SupportContext) -> dict[str, Answered]:
    """Return each section by its name; one that does not return in time is left behind."""
    learn_words()
    ended: dict[str, Answered] = {}

    def collect(name: str) -> None:
        try:
            ended[name] = SECTIONS[name](context), "ok"
        except Exception as error:  # noqa: BLE001 - whatever it is, it is the reason
            ended[name] = None, f"{type(error).__name__}: {known_only(str(error))}"

    threads = [threading.Thread(target=collect, args=(name,), name=f"support {name}", daemon=True) for name in SECTIONS]
    for thread in threads:
        thread.start()
    deadline_s = time.monotonic() + WITHIN_S
    for thread in threads:
        thread.join(max(0.0, deadline_s - time.monotonic()))
    late = None, f"It did not come within {WITHIN_S:g} s."
    return {name: ended.get(name, late) for name in SECTIONS}


def _json(value: Any) -> str:
    return json.dumps(value, indent=1, default=str)
