"""Every sentence that an operator can meet on the screen, as docs/screen_words.md shows them.

`python -m device.web.screen.screen_words > docs/screen_words.md` writes that page from device/web/static/words.
"""

from __future__ import annotations

import json
from pathlib import Path

WORDS = Path(__file__).parents[1] / "static" / "words"
LANGUAGES = {"en": "English", "de": "German"}
HEAD = """# What the screen says

This page answers which sentences an operator can meet, in each language.
Written by `python -m device.web.screen.screen_words > docs/screen_words.md` from `device/web/static/words/`.
A word in braces stands for a figure or a name.
"""


def words_of(name: str) -> dict[str, str]:
    """Return the words of a language by their keys, or the daemon's own sentences (`sentences`)."""
    found: dict[str, str] = json.loads((WORDS / f"{name}.json").read_text(encoding="utf-8"))
    return found


def page() -> str:
    """Return the page: a table for each group of keys."""
    words = {language: words_of(language) for language in LANGUAGES}
    groups: dict[str, list[str]] = {}
    for key in words["en"]:
        groups.setdefault(key.partition(".")[0], []).append(key)
    parts = [HEAD]
    for group, keys in groups.items():
        rows = [f"| `{key}` | {' | '.join(words[language][key] for language in LANGUAGES)} |" for key in keys]
        names = " | ".join(LANGUAGES.values())
        parts.append("\n".join([f"## {group}", "", f"| key | {names} |", "|---|---|---|", *rows, ""]))
    return "\n".join(parts)


if __name__ == "__main__":
    print(page(), end="")
