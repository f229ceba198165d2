"""What was chosen at the probe's own screen over REST, and in the page that it is sent: no other machine sees either.

The page of the own screen comes with the choices in it, so no request more stands before its first word, and no word of
another language is shown before the right one. Any other browser remembers by itself.
"""

from __future__ import annotations

import json
import threading
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel, ConfigDict

from device.access.scopes import SCREEN
from device.errors import StorageError
from device.files.screen_choices import NAME, Colours, Language, ScreenChoices, Sound, read_choices, write_choices
from device.web.contract import answers

HEAD = '<html lang="en">'
"""How each page begins in its file."""


class ScreenResource(BaseModel):
    """What was chosen at the probe's own screen, null where nothing was."""

    language: Language | None
    colours: Colours | None
    sound: Sound | None


def _as_changes(schema: dict[str, Any]) -> None:
    """Say no default of what is not named: a generated client would send it, and take a choice back."""
    for field in schema["properties"].values():
        field.pop("default", None)


class ScreenChange(BaseModel):
    """What is chosen at the probe's own screen: what is not named stays, null takes a choice back."""

    model_config = ConfigDict(extra="forbid", strict=True, json_schema_extra=_as_changes)
    language: Language | None = None
    colours: Colours | None = None
    sound: Sound | None = None


class KeptChoices:
    """The choices that a data folder keeps; without one nothing is kept, and each browser remembers by itself."""

    def __init__(self, folder: Path | None = None) -> None:
        self._folder, self._lock = folder, threading.Lock()
        self.now = read_choices(folder) if folder else ScreenChoices()

    def change(self, **changes: str | None) -> ScreenChoices:
        """Keep changes durably and return all choices; raise `StorageError`, and change nothing, when that fails."""
        if self._folder is None:
            raise StorageError("This probe keeps no choices of its screen.", "Report the daemon's log.")
        with self._lock:
            chosen = replace(self.now, **changes)  # type: ignore[arg-type]
            if chosen != self.now:
                self._keep(self._folder, chosen)
            return self.now

    def page(self, text: str) -> str:
        """Return a page for the own screen: with what was chosen, so that it is shown so from its first pixel."""
        if self._folder is None:
            return text
        colours, kept = self.now.colours or "auto", escape(json.dumps(self.now.as_record()))
        return text.replace(HEAD, f'<html lang="en" data-colours="{colours}" data-kept="{kept}">', 1)

    def _keep(self, folder: Path, chosen: ScreenChoices) -> None:
        try:
            write_choices(folder, chosen)
        except OSError as error:
            cause = f"What was chosen at the screen cannot be kept in {folder / NAME}: {error.strerror or error}."
            raise StorageError(
                cause, "It holds until the page is loaded again. Free space, then choose anew."
            ) from error
        self.now = chosen


def add_choices(app: FastAPI, choices: KeptChoices) -> None:
    """Add the routes of what is chosen at the own screen."""

    @app.get(SCREEN, responses=answers(200, ScreenResource), tags=["device"])
    def get_screen() -> dict[str, Any]:
        """Return what was chosen at the probe's own screen, there only."""
        return choices.now.as_record()

    @app.patch(SCREEN, responses=answers(200, ScreenResource), tags=["device"])
    def choose_for_screen(change: ScreenChange) -> dict[str, Any]:
        """Keep what is chosen at the probe's own screen, there only, also over a power-off."""
        return choices.change(**change.model_dump(exclude_unset=True)).as_record()
