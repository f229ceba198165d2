"""Markdown to its sentences: prose only, without tables, code, headings, figures and what code writes."""

from __future__ import annotations

import re
from collections.abc import Iterator

FENCE = re.compile(r"^```.*?^```[^\n]*$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
CODE = re.compile(r"`[^`]*`")
NO_PROSE = ("|", "#", ">", "![")
ITEM = re.compile(r"^\s*(?:[-*]|\d+\.)\s+")
END = re.compile(r"(?<=[.?!])\s+(?=[A-Z*\"(0-9])|(?<=\w\.)\s+(?=(?:systemd|picamera2|host_tools)\b)")
SHORT = re.compile(r"\b(?:e\.g|i\.e|cf|vs|Phil|Trans|Proc|Fig|No|p|pp|J|C|H|Soc|ed|rev|approx)\.$")


def paragraphs(text: str) -> Iterator[str]:
    """Yield each paragraph or list item as one line; links as their words, code as one word."""
    part: list[str] = []
    for line in [*FENCE.sub("", text).splitlines(), ""]:
        is_item = bool(ITEM.match(line))
        if not line.strip() or line.lstrip().startswith(NO_PROSE) or is_item:
            if part:
                yield " ".join(part)
            part = []
        if line.strip() and not line.lstrip().startswith(NO_PROSE):
            part.append(ITEM.sub("", line).strip())


def sentences(text: str) -> Iterator[str]:
    """Yield the sentences of Markdown; a full stop or question mark ends one, a colon or semicolon does not."""
    for paragraph in paragraphs(text):
        kept = ""
        for piece in END.split(CODE.sub("Code", LINK.sub(r"\1", paragraph))):
            kept = f"{kept} {piece}".strip()
            if SHORT.search(kept):
                continue
            yield kept
            kept = ""
        if kept:
            yield kept


def words(sentence: str) -> int:
    """Return how many words a sentence has; numbers and symbols between spaces count."""
    return len([word for word in sentence.split() if any(letter.isalnum() for letter in word)])
