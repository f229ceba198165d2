"""What was chosen at the probe's own screen, `screen.json` in the data folder: language, colours, sound; nothing else.

The browser of the panel keeps its profile in memory, and forgets with the power (systemd/tsis-kiosk.service). Who
examines, and whose exam is open, are no part of it. The fallback reads it, too: standard library only.
"""

from __future__ import annotations

import json
import logging
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal, get_args

from device.files.durable import write_durably

log = logging.getLogger(__name__)

NAME = "screen.json"
Language = Literal["en", "de"]
Colours = Literal["auto", "light", "dark"]
Sound = Literal["on", "off"]
ALLOWED = {"language": get_args(Language), "colours": get_args(Colours), "sound": get_args(Sound)}


@dataclass(frozen=True)
class ScreenChoices:
    """What the screen speaks, how it looks and whether it sounds; None is no choice: the browser's own holds."""

    language: Language | None = None
    colours: Colours | None = None
    sound: Sound | None = None

    def as_record(self) -> dict[str, str | None]:
        """Return them as JSON object."""
        return asdict(self)


def read_choices(folder: Path) -> ScreenChoices:
    """Return what a data folder keeps; a file that cannot be read, or a value that is none, is no choice and logged."""
    path = folder / NAME
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        found = {name: kept.get(name) for name in ALLOWED}
    except FileNotFoundError:
        return ScreenChoices()
    except (OSError, ValueError, AttributeError, RecursionError) as error:
        log.warning("What was chosen at the screen, %s, cannot be read and counts as no choice: %s.", path, error)
        return ScreenChoices()
    return ScreenChoices(**{name: value for name, value in found.items() if _is_choice(path, name, value)})


def _is_choice(path: Path, name: str, value: object) -> bool:
    """Return whether a value is one of the allowed; another one, as of a newer release, is logged."""
    if value is not None and value not in ALLOWED[name]:
        allowed = ", ".join(ALLOWED[name])
        log.warning("%s says %s %.40r, which is none of %s, and counts as no choice.", path, name, value, allowed)
        return False
    return value is not None


def write_choices(folder: Path, choices: ScreenChoices) -> None:
    """Keep choices durably in a data folder; raise `OSError` when the disk does not take them."""
    write_durably(folder / NAME, json.dumps(choices.as_record()).encode())
