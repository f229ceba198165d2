"""The page asks for every module of the screen at once, so that none waits for another to name it; and for no other."""

from __future__ import annotations

import re
from pathlib import Path

from daemon_process import ROOT

STATIC = ROOT / "device" / "web" / "static"
PAGE = (STATIC / "index.html").read_text(encoding="utf-8")


def imported(module: Path, known: dict[Path, None]) -> dict[Path, None]:
    """Add a module and all that it imports to those that are known."""
    if module not in known:
        known[module] = None
        for name in re.findall(r'from "(\.[^"]+)"', module.read_text(encoding="utf-8")):
            imported((module.parent / name).resolve(), known)
    return known


def test_the_page_names_every_module_that_it_will_need() -> None:
    needed = imported(STATIC.resolve() / "screen.js", {})
    named = re.findall(r'<link rel="modulepreload" href="/static/([^"]+)">', PAGE)
    assert named == sorted(str(one.relative_to(STATIC.resolve())) for one in needed if one.name != "screen.js")


def test_the_page_is_of_the_probes_own_files_alone() -> None:
    asked = re.findall(r'(?:href|src)="([^"#][^"]*)"', PAGE)
    assert {one for one in asked if not one.startswith(("/", "data:"))} == set()
    for path in [one for one in asked if one.startswith("/static/")]:
        assert (STATIC / path.removeprefix("/static/")).is_file(), path
