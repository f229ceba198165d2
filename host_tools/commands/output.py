"""What the verbs share: messages on the error stream, progress bars, files that are refused before work begins."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from device.measurement.quantities import InvalidQuantity

note = Console(stderr=True, highlight=False)


def progress(what: str) -> Progress:
    """Return a bar that counts `what`, on the error stream."""
    text = TextColumn(what)
    return Progress(text, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn(), console=note)


def note_left_out(scenes: int, data: Path) -> None:
    """Say how many scenes of a data set cannot be used; nothing when all can."""
    if scenes:
        note.print(f"{scenes} scenes of {data}, failed or without a number, are left out.", soft_wrap=True)


def require_writable(path: Path | None, suffixes: tuple[str, ...]) -> None:
    """Refuse a file that could not be written before minutes are spent on what it would hold."""
    if path and path.suffix.lower() not in suffixes:
        raise InvalidQuantity("file", path, f"of type {', '.join(suffixes)}", "give it another name")
    if path and not path.parent.is_dir():
        raise InvalidQuantity("folder", path.parent, "a folder that exists", "make it first")
