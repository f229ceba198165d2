"""A model's card as another one, with its hash: the device then reads it for what it says."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from device.measurement.bundle import CARD_FILE, CARD_HASH_FILE, card_hash


def edit_card(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Change the card of the bundle in a folder."""
    card = json.loads((folder / CARD_FILE).read_text(encoding="utf-8"))
    change(card)
    write_card(folder, json.dumps(card))


def write_card(folder: Path, text: str) -> None:
    """Write a text as the card of the bundle in a folder."""
    (folder / CARD_FILE).write_text(text, encoding="utf-8")
    (folder / CARD_HASH_FILE).write_bytes(card_hash(text.encode()))
