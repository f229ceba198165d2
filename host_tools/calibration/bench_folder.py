"""Frames that a bench took, a folder of images and a table of forces, to a recording as the probe's own software makes.

The table has a line for each frame: which file, what it shows, the force and the time. How the frames were taken is in
the probe's file and in `PressOnBench`. Everything that is wrong is named at once, each with its line.
Source of the form: docs/own_probe.md, "Frames from a bench".
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import Any, Literal, cast, get_args

import cv2
import numpy as np

from device.files.recording_file import require_room_for
from device.files.toml_record import InvalidRecord
from device.measurement.estimate import SATURATED_RATIO
from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.recording.led_sides import LedRatio
from device.measurement.recording.recording import CameraSettings, RecordedCell, Recording
from device.measurement.recording.tactile_image import Counts, Frame, Role
from host_tools.calibration.gates import zero_gates
from host_tools.scenes.probe import Probe

NEEDED = ("file", "role", "force_n", "t_s")
LEDS = ("led_x", "led_y", "led_minus_x", "led_minus_y")
"""Brightness of the sides, 0 to 1 of their full: all four columns or none, which says that all were full on."""
OPTIONAL = ("ramp", *LEDS)
ROLES = get_args(Role)
ACTION = "correct the table"
AS_CSV = "save it with commas and decimal points"
SEPARATORS = {";": "';'", "\t": "tabs"}
"""What spreadsheets part values by where the comma is that of numbers."""
SENSOR_BITS = 8, 10, 12
WITHOUT_LOSS = b"\x89PNG\r\n\x1a\n", b"II*\0", b"MM\0*"
"""How a PNG begins (its specification, 5.2), and a TIFF in either order of bytes (TIFF 6.0, section 2)."""
FORCES_N = Bound(-0.1, 5.0, "N")
"""An untouched face's force may drift below nothing; what lies beyond is no hand's, and most likely of another unit."""

TableLine = Mapping[str, str]


@dataclass(frozen=True)
class PressOnBench:
    """What a table of frames does not say: the press' name, when it began (RFC 3339), and how the camera was set."""

    id: str
    started_at: str
    exposure_us: float
    gain: float
    software: str = "bench"

    def __post_init__(self) -> None:
        try:
            has_zone = datetime.fromisoformat(self.started_at).tzinfo is not None
        except ValueError:
            has_zone = False
        if not has_zone:
            bound, action = "a time of RFC 3339 with its zone", "write it as 2026-11-02T09:30:00+01:00"
            raise InvalidQuantity("started_at", repr(self.started_at), bound, action)


def bench_recording(folder: Path, table: Path, press: PressOnBench, probe: Probe) -> Recording:
    """Return the recording that a table of frames (CSV) and the folder of their images make.

    Images are mono PNG or TIFF of the size and depth of the probe's file. Raises `InvalidQuantity`, with all
    `problems`, for a column that is missing or unknown, for each line that is no frame, for missing roles, and for more
    frames than memory holds.
    """
    rows = _rows(table)
    require_room_for(len(rows), _camera(press, probe, 16))
    problems: list[InvalidQuantity] = []
    frames: list[Frame] = []
    for number, row in rows.items():
        try:
            frames.append(_frame(row, folder, probe))
        except InvalidQuantity as error:
            found = f"{table.name}, line {number}: {error.quantity}"
            problems.append(InvalidQuantity(found, error.value, error.bound, error.action))
    if not problems:
        problems = [*_missing_roles(frames), *_there_twice(rows, frames, table), *_of_two_depths(frames, rows)]
    if problems:
        raise InvalidRecord(problems)
    ordered = sorted(_at_the_top(frames, probe.camera.bits), key=lambda frame: frame.t_s)
    recording = Recording(
        id=press.id,
        serial=probe.serial,
        software=press.software,
        started_at=press.started_at,
        camera=_camera(press, probe, 8 if ordered[0].counts.dtype == np.uint8 else 16),
        frames=tuple(ordered),
        cell=RecordedCell(probe.cell.counts_per_n),
    )
    if problems := [problem for gate in zero_gates(recording) if (problem := gate.problem)]:
        raise InvalidRecord(problems)
    return recording


def _there_twice(rows: Mapping[int, TableLine], frames: Sequence[Frame], table: Path) -> Iterator[InvalidQuantity]:
    """Yield each line whose image is an earlier line's, by its name or by its pixels: no camera takes one frame twice.

    A name that a spreadsheet has filled down gives the force of one frame to another, which reads as two inclusions.
    Dark frames of a good camera may be alike.
    """
    known: dict[str | bytes, int] = {}
    for (number, row), frame in zip(rows.items(), frames, strict=True):
        name, pixels = row["file"].strip(), frame.counts.tobytes()
        before = known.get(name) or (None if frame.role == "dark" else known.get(pixels))
        if before is not None:
            found = f"{table.name}, line {number}: image"
            yield InvalidQuantity(found, f"{name}, that of line {before}", "another in each line", ACTION)
        known |= {name: number, pixels: number}


def _of_two_depths(frames: Sequence[Frame], rows: Mapping[int, TableLine]) -> Iterator[InvalidQuantity]:
    """Yield that images are of 8 and of 16 bit, with those of the rarer depth."""
    by_depth: dict[Any, list[str]] = {}
    for frame, row in zip(frames, rows.values(), strict=True):
        by_depth.setdefault(frame.counts.dtype, []).append(row["file"].strip())
    if len(by_depth) > 1:
        rarer: list[str] = min(by_depth.values(), key=len)
        action = f"save all alike; the rarer are {', '.join(sorted(set(rarer))[:5])}"
        yield InvalidQuantity("images", "of 8 and of 16 bit", "of one depth", action)


def _camera(press: PressOnBench, probe: Probe, bits: Literal[8, 16]) -> CameraSettings:
    camera = probe.camera
    return CameraSettings(
        camera.width_px,
        camera.height_px,
        bits,
        camera.mm_per_px_x,
        camera.mm_per_px_y,
        press.exposure_us,
        press.gain,
    ).seen_as(probe.geometry)


def _rows(table: Path) -> dict[int, TableLine]:
    """Return the lines of a table by their numbers, without those that are empty throughout, as a spreadsheet adds.

    Raises `InvalidQuantity` when it cannot be read, or for its columns.
    """
    try:
        with table.open(newline="", encoding="utf-8-sig") as file:  # a spreadsheet begins its files with a mark
            reader = csv.DictReader(file, strict=True)
            columns = [name.strip() for name in reader.fieldnames or ()]
            reader.fieldnames = columns
            numbered = [(reader.line_num, row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InvalidQuantity(str(table), error, "a table of comma separated values, UTF-8", ACTION) from error
    if problems := list(_of_columns(columns, table)):
        raise InvalidRecord(problems)
    rows: dict[int, TableLine] = {number: row for number, row in numbered if not _is_empty(row)}
    if not rows:
        raise InvalidQuantity(f"frames in {table}", 0, "at least one line below the names", "add a line for each frame")
    return rows


def _is_empty(row: Mapping[str | None, str | list[str] | None]) -> bool:
    """Return whether nothing stands in a line, whose surplus values are a list, and missing ones None."""
    return not any("".join(value or ()).strip() for value in row.values())


def _of_columns(columns: Sequence[str], table: Path) -> Iterator[InvalidQuantity]:
    known = (*NEEDED, *OPTIONAL)
    if len(columns) == 1 and (found := next((name for mark, name in SEPARATORS.items() if mark in columns[0]), None)):
        yield InvalidQuantity(f"first line of {table}", f"parted by {found}", "parted by commas", AS_CSV)
        return
    for name in NEEDED:
        if name not in columns:
            yield InvalidQuantity(
                f"column {name} of {table}", "missing", "there", f"name the columns {', '.join(known)}"
            )
    for name in columns:
        if name not in known or columns.count(name) > 1:
            found = "unknown" if name not in known else "there twice"
            yield InvalidQuantity(
                f"column {name or '(no name)'} of {table}", found, f"one of {', '.join(known)}", ACTION
            )
    given = [name for name in LEDS if name in columns]
    if given and len(given) < len(LEDS):
        yield InvalidQuantity(f"columns of LEDs in {table}", ", ".join(given), f"{', '.join(LEDS)}, or none", ACTION)


def _frame(row: TableLine, folder: Path, probe: Probe) -> Frame:
    if None in row or None in row.values():
        raise InvalidQuantity("values", "too many or too few", "one for each column", ACTION)
    role = row["role"].strip()
    if role not in ROLES:
        raise InvalidQuantity("role", repr(role), f"one of {', '.join(ROLES)}", "say what the frame shows")
    ramp = _number(row, "ramp") if row.get("ramp", "").strip() else 0.0
    if not ramp.is_integer():
        raise InvalidQuantity("ramp", ramp, "a whole number", "number the presses on the lesion from 0")
    counts = _counts(row["file"].strip(), folder, probe)
    leds = _leds(row, is_dark=role == "dark")
    force_n = _number(row, "force_n")
    require("force_n", force_n, FORCES_N, "give the force of the press in newtons")
    return Frame(counts, cast(Role, role), _number(row, "t_s"), force_n, leds, int(ramp))


def _leds(row: TableLine, *, is_dark: bool) -> LedRatio:
    """Return the sides' brightness; raise `InvalidQuantity` for a dark frame that the table says is lit."""
    if LEDS[0] not in row:
        return cast(LedRatio, (0.0 if is_dark else 1.0,) * len(LEDS))
    leds = tuple(_number(row, name) for name in LEDS)
    if is_dark and any(leds):
        found = ", ".join(f"{led:g}" for led in leds)
        raise InvalidQuantity("LEDs of a dark frame", found, "0, 0, 0, 0", "take dark frames with all LEDs off")
    return cast(LedRatio, leds)


def _number(row: TableLine, name: str) -> float:
    try:
        value = float(row[name])
    except ValueError:
        raise InvalidQuantity(name, repr(row[name]), "a number with a point", ACTION) from None
    if not np.isfinite(value):
        raise InvalidQuantity(name, value, "a finite number", ACTION)
    return value


def _counts(name: str, folder: Path, probe: Probe) -> Counts:
    """Return an image of the folder as the camera gave it; raise for one of another size, depth or with colours."""
    parts = PurePosixPath(name).parts
    if not parts or PurePosixPath(name).is_absolute() or ".." in parts:
        raise InvalidQuantity("file", repr(name), "a path inside the folder", ACTION)
    try:
        content = (folder / name).read_bytes()
    except OSError as error:
        bound = f"a file of {folder} that can be read"
        raise InvalidQuantity("file", f"{name} ({error.strerror})", bound, "name the frame's file") from None
    is_ours = content.startswith(WITHOUT_LOSS)  # OpenCV reads JPEG, too, whose loss reads as a second inclusion
    counts = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED) if is_ours else None
    if counts is None:
        raise InvalidQuantity("file", name, "a PNG or TIFF", "save frames without loss")
    camera = probe.camera
    if counts.shape != (camera.height_px, camera.width_px) or counts.dtype not in (np.uint8, np.uint16):
        kind = "mono" if counts.ndim == 2 else f"{counts.shape[2]} colours"
        found = f"{name}: {kind}, {counts.shape[1]} x {counts.shape[0]} px of {counts.dtype}"
        bound = f"mono, {camera.width_px} x {camera.height_px} px as in the probe's file, of 8 or 16 bit"
        raise InvalidQuantity("file", found, bound, "save the frames as the camera gives them")
    return cast(Counts, counts)


def _at_the_top(frames: Sequence[Frame], sensor_bits: int) -> list[Frame]:
    """Return frames of 16 bit whose sensor's bits lie at the top, as in a recording; many programs leave them below.

    All lie below when no count of any frame is beyond the sensor's own: a lit face is brighter than that at the top.
    What a sensor of 8 bit gave becomes frames of 8 bit, whose full scale is known. Raises `InvalidQuantity` for counts
    that a sensor of so many bits does not give.
    """
    if frames[0].counts.dtype == np.uint8:
        return list(frames)
    below = np.uint16(16 - sensor_bits)
    largest = max(int(frame.counts.max()) for frame in frames)
    _require_bits(frames, largest, sensor_bits)
    if largest < 1 << sensor_bits:
        frames = [replace(frame, counts=frame.counts << below) for frame in frames]
    if sensor_bits == 8:
        frames = [replace(frame, counts=(frame.counts >> below).astype(np.uint8)) for frame in frames]
    return list(frames)


def _require_bits(frames: Sequence[Frame], largest: int, sensor_bits: int) -> None:
    """Raise `InvalidQuantity` for counts that fill other bits than the sensor's, or are full by fewer of them."""
    bound, action = (
        f"of {sensor_bits} bits, at the lower or at the upper end",
        "correct camera.bits in the probe's file",
    )
    beside = np.uint16((1 << (16 - sensor_bits)) - 1)
    if largest >= 1 << sensor_bits and any((frame.counts & beside).any() for frame in frames):
        raise InvalidQuantity("counts of the images", f"up to {largest}", bound, action)
    fewer = [one for one in SENSOR_BITS if one < sensor_bits and largest == (1 << one) - 1]
    if fewer and max(float(np.mean(frame.counts == largest)) for frame in frames) > SATURATED_RATIO:
        raise InvalidQuantity("counts of the images", f"full at {largest}, as of {fewer[0]} bits", bound, action)


def _missing_roles(frames: Sequence[Frame]) -> list[InvalidQuantity]:
    """Return what no reader can do without: frames of each role, and a table whose times differ."""
    counts = {role: sum(frame.role == role for frame in frames) for role in ROLES}
    problems = [
        InvalidQuantity(f"{role} frames", 0, "at least 1", "take them, and add their lines to the table")
        for role, count in counts.items()
        if not count
    ]
    if len({frame.t_s for frame in frames}) < len(frames):
        action = "give each frame the time at which it was taken"
        problems.append(InvalidQuantity("t_s", "there twice", "another in each line", action))
    return problems
