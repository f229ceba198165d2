"""What each request needs: nothing, a token that may ask, measure or look after the probe, or the probe's own screen.

A request that is not listed needs more rather than less: what only asks may be read with any token, and what changes
something wants one for looking after the probe.
"""

from __future__ import annotations

from typing import Literal

Scope = Literal["read", "measure", "admin"]
"""What a token may: ask, or also press and keep exams, or also look after the probe. Each may what those before may."""
Need = Literal["nothing", "read", "measure", "admin", "own screen"]
SCOPES: tuple[Scope, ...] = ("read", "measure", "admin")

API = "/api/v1"
PAIRING, CLAIM, TOKENS = f"{API}/pairing", f"{API}/pairing/claim", f"{API}/tokens"
SCREEN = f"{API}/screen"
PAIRING_PAGE, SECURITY_CONTACT = "/pair", "/.well-known/security.txt"
OPEN = frozenset({("GET", f"{API}/health/live"), ("POST", CLAIM), ("GET", PAIRING_PAGE), ("GET", SECURITY_CONTACT)})
"""Whoever has no token yet may see that it runs, bring the code from the probe's screen by the page for that, and read
whom to tell of a vulnerability."""
OPEN_FOLDER = "/static/"
"""The screen's own files: they are in every copy of the software."""
WORKLIST, EXAMS, DICOM_FILES = f"{API}/worklist", f"{API}/exams/", "/dicom.zip"
"""Show patients' names, which nothing else does, to whoever may begin exams: files of an exam have those of its
order."""
MEASURING = ("presses", "exams", "measurements", "self-test", "tare", "worklist")
"""What a token that may measure may change, by the first part of its path."""


def need_of(method: str, path: str) -> Need:
    """Return what a request needs, by its method and its path."""
    asked = "GET" if method == "HEAD" else method
    if (asked, path) in OPEN or (asked == "GET" and path.startswith(OPEN_FOLDER)):
        return "nothing"
    if path in (PAIRING, SCREEN):
        return "own screen"
    if path == TOKENS or path.startswith(f"{TOKENS}/"):
        return "admin"
    if path == WORKLIST or (path.startswith(EXAMS) and path.endswith(DICOM_FILES)):
        return "measure"
    if asked in ("GET", "OPTIONS"):
        return "read"
    first = path.removeprefix(f"{API}/").partition("/")[0] if path.startswith(f"{API}/") else ""
    return "measure" if first in MEASURING else "admin"


def may(scope: Scope, need: Need) -> bool:
    """Return whether a scope is enough for a need."""
    if need == "own screen":
        return False
    return need == "nothing" or SCOPES.index(scope) >= SCOPES.index(need)
