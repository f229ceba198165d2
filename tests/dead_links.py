"""Fails when a Markdown file points at a file or heading that does not exist, or a module names a missing document."""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"`((?:device|host_tools|tests|models|docs|requirements)/[\w./-]+)`")
HEADING = re.compile(r"^#+\s+(.*)$", re.MULTILINE)


def _anchors(text: str) -> set[str]:
    return {re.sub(r"[^\w\- ]", "", heading).strip().lower().replace(" ", "-") for heading in HEADING.findall(text)}


def _dead(document: Path) -> list[str]:
    text, dead = document.read_text(encoding="utf-8"), []
    for target in LINK.findall(text):
        if target.startswith(("http://", "https://", "mailto:")):
            continue
        path, _, anchor = target.partition("#")
        file = (document.parent / path) if path else document
        if not file.exists() or (anchor and anchor not in _anchors(file.read_text(encoding="utf-8"))):
            dead.append(target)
    return dead + [target for target in CODE.findall(text) if not (ROOT / target).exists()]


def main() -> int:
    """Print every dead link; return 1 if there is one."""
    documents = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")]
    dead = [f"{document.relative_to(ROOT)}: {target}" for document in documents for target in _dead(document)]
    print("\n".join(dead) if dead else f"{len(documents)} documents, no dead link")
    return 1 if dead else 0


if __name__ == "__main__":
    sys.exit(main())
