"""The page's words in the languages of the screen, from the screen's own files; without them all is said in English.

What is known is written in English (device/fallback/situation.py, page.py) and looked up as it stands there: a release
whose files are damaged still says what it knows. Faults are in the operator's words, by their codes.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

WORDS = Path(__file__).parents[1] / "web" / "static" / "words"
LANGUAGES = ("en", "de")
WISH = re.compile(r"\s*([a-z]{1,8})(?:-[a-z0-9-]+)?\s*(?:;\s*q=([01](?:\.\d*)?))?\s*", re.IGNORECASE)


def wished_language(accepted: str) -> str:
    """Return the language that a browser likes best (RFC 9110, Accept-Language), the first one if it likes none."""
    wishes = [found for one in accepted.split(",") if (found := WISH.fullmatch(one))]
    liked = [(float(wish[2] or 1.0), wish[1].lower()) for wish in wishes]
    known = [one for one in liked if one[1] in LANGUAGES and one[0] > 0.0]
    return max(known, key=lambda one: one[0])[1] if known else LANGUAGES[0]


class PageWords:
    """What the page says, in one language."""

    def __init__(self, language: str = LANGUAGES[0]) -> None:
        self.language = language
        self._words = _read(language)
        self._keys = {text: key for key, text in _read(LANGUAGES[0]).items()}

    def say(self, text: str, **values: str) -> str:
        """Return an English text of the page in the language, with its {values}; one without words as it is."""
        said = self._words.get(self._keys.get(text, ""), text)
        return re.sub(r"\{(\w+)\}", lambda found: values.get(found[1], found[0]), said)

    def meaning(self, fault: Mapping[str, str]) -> str:
        """Return what a fault means, its title where its code has no words."""
        return self._words.get(f"fault.{fault['code']}.is", fault["title"])

    def remedy(self, fault: Mapping[str, str]) -> str:
        """Return what to do about a fault: what this page itself says of it, else the words of its code."""
        own = fault["remedy"]
        return self.say(own) if own in self._keys else self._words.get(f"fault.{fault['code']}.do", own)


def _read(language: str) -> dict[str, str]:
    try:
        found = json.loads((WORDS / f"{language}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return {key: text for key, text in found.items() if isinstance(text, str)} if isinstance(found, dict) else {}
