"""What the verbs share: messages on the error stream, progress bars, the option of a cluster, refusals of files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from device.files.shipped import MODELS, SOURCE_TREE
from device.measurement.quantities import Bound, InvalidQuantity

if TYPE_CHECKING:
    from host_tools.calibration.gates import Gate

Scheduler = Annotated[
    str | None,
    typer.Option(help="Dask cluster to compute on, tcp://HOST:PORT; a worker uses one thread."),
]
PAGE = ".md"
note = Console(stderr=True, highlight=False)


def progress(what: str) -> Progress:
    """Return a bar that counts `what`, on the error stream."""
    text = TextColumn(what)
    return Progress(text, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn(), console=note)


def note_left_out(scenes: int, data: Path) -> None:
    """Say how many scenes of a data set cannot be used; nothing when all can."""
    if scenes:
        note.print(f"{scenes} scenes of {data}, failed or without a number, are left out.", soft_wrap=True)


def source_tree(purpose: str) -> Path:
    """Return the root of the source tree; raise `InvalidQuantity` in an installed package, whose files stay as made."""
    if SOURCE_TREE is None:
        bound = "in its source tree"
        raise InvalidQuantity("host_tools", "an installed package", bound, f"clone the repository to {purpose}")
    return SOURCE_TREE


def own_models(name: str) -> Path:
    """Return the folder in models/ that a verb writes unless told another; raise as `source_tree`."""
    source_tree("write its own models, or name another folder with --out")
    return MODELS / name


def require_writable(path: Path | None, suffixes: tuple[str, ...]) -> None:
    """Refuse a file that could not be written before minutes are spent on what it would hold."""
    if path and path.suffix.lower() not in suffixes:
        raise InvalidQuantity("file", path, f"of type {', '.join(suffixes)}", "give it another name")
    if path and not path.parent.is_dir():
        raise InvalidQuantity("folder", path.parent, "a folder that exists", "make it first")
    if path and path.suffix.lower() == PAGE:  # written beside, and renamed
        _require_ours(path.parent)
        require_writable_folder(path.parent / "results")
    elif path:
        _require_ours(path if path.exists() else path.parent)


def require_writable_folder(path: Path) -> None:
    """Refuse a folder, there already or to be made, that could not be written to, as `require_writable` does a file."""
    there = next(one for one in (path, *path.absolute().parents) if one.exists())
    if not there.is_dir():
        raise InvalidQuantity("folder", there, "a folder, not a file", "name another one with --out")
    _require_ours(there)


def _require_ours(path: Path) -> None:
    if not os.access(path, os.W_OK):
        raise InvalidQuantity("out", path, "writable by who runs this", "name another one, or change its rights")


LARGEST_PLAIN_RATIO = 0.2


def ratio_of(text: str) -> float:
    """Return 0.005 for "0.5%" or "0.005"; raise `InvalidQuantity` for a bare 1, by which most mean one per cent."""
    is_percent = text.endswith("%")
    try:
        value = float(text.removesuffix("%")) / (100 if is_percent else 1)
    except ValueError:
        value = -1.0
    bound = Bound(0.0, 1.0 if is_percent else LARGEST_PLAIN_RATIO, "", low_included=False)
    if not bound.holds(value):
        raise InvalidQuantity("tolerance", repr(text), f"a ratio {bound}, or per cent", "give for example 0.5%")
    return value


def problem_record(problem: InvalidQuantity) -> dict[str, str]:
    """Return what is wrong as JSON object."""
    value = str(problem.value)
    return {"quantity": problem.quantity, "value": value, "bound": problem.bound, "action": problem.action}


def gate_line(gate: Gate) -> str:
    """Return a gate's quantity, value and bound, each in its column."""
    return f"{gate.quantity:48} {gate.value:<10.4g} {gate.bound}"


def print_rows(rows: Sequence[tuple[str, ...]]) -> None:
    """Print a table of texts, each column as wide as its widest."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        print("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())
