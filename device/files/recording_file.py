"""A recording to a .zip or a folder and back: `recording.json` and lossless mono PNGs.

What is missing, not finite or contradictory is refused with the field's name. A recording is written whole or not at
all. A .zip is one file to synchronise, where a folder is one for each frame; it is stored, since PNGs are compressed
already. A picture to look at may lie in it; no number is read from that. Source: docs/contracts.md.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO

import cv2
import numpy as np

from device.files.durable import sync_directory, synced_file
from device.measurement.mode import MODES, Mode
from device.measurement.quantities import UNKNOWNS, Bound, Inclusion, InvalidQuantity, require
from device.measurement.recording.recording import GEOMETRY, REPAIR, CameraSettings, RecordedCell, Recording
from device.measurement.recording.tactile_image import Frame

SCHEMA = "tsis.recording/1"
SCAN_SCHEMA = "tsis.recording/2"
"""That of a recording with more than one press on the lesion, whose frames no reader of the first may mix."""
RECORD = "recording.json"
PICTURE = "image.png"
NUMBER = (int, float)
READABLE = 0o644
"""Rights of a file that is unpacked from a .zip; by default nobody may read it."""
MOST_BYTES = 1 << 30
"""Of all frames of a recording in memory: some three thousand of the probe's camera, where a scan takes some sixty."""
UNREADABLE = (OSError, KeyError, zipfile.BadZipFile, zlib.error)
"""What reading a file of a folder or .zip raises when it is missing or damaged."""

FileOpener = Callable[[Path], AbstractContextManager[BinaryIO]]
"""Opens a file to be written anew; when its block has ended, the content is on the disk."""
FrameEncoder = Callable[[Frame], bytes]
Files = Iterator[tuple[str, bytes]]
"""Names and contents; each content is made when it is asked for."""


@dataclass(frozen=True)
class RecordingHead:
    """Which probe took a recording, with which software and camera, and whether it was a simulated one."""

    serial: str
    software: str
    simulated: bool
    camera: CameraSettings


@dataclass(frozen=True)
class FrameForce:
    """When a frame was taken (s from the recording's start), at which force (N), in which role, and of which ramp."""

    role: str
    ramp: int
    t_s: float
    force_n: float


def png_of(frame: Frame) -> bytes:
    """Return a frame's counts as a PNG."""
    return cv2.imencode(".png", frame.counts)[1].tobytes()


def write_recording(
    recording: Recording,
    path: Path,
    *,
    encode: FrameEncoder = png_of,
    picture: bytes = b"",
    opened: FileOpener = synced_file,
) -> None:
    """Write a recording to a new file, PATH.zip, or by any other name to a new folder.

    When this returns it is on the disk; after an `OSError` or Ctrl-C nothing is left. `encode` may know PNGs that were
    made before; `picture` is the PNG that `read_picture` returns, none when it is empty.
    """
    temporary = path.with_name(path.name + ".tmp")
    remove_recording(temporary)
    write = _write_zip if path.suffix == ".zip" else _write_folder
    try:
        write(temporary, path.stem, _files_of(recording, encode, picture), opened)
        if path.is_file():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
        temporary.rename(path)
    except (OSError, KeyboardInterrupt):
        remove_recording(temporary)
        raise
    sync_directory(path.parent)


def remove_recording(path: Path) -> None:
    """Remove a recording, whole or half written, as far as the disk allows it; there may be none."""
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink(missing_ok=True)


def _files_of(recording: Recording, encode: FrameEncoder, picture: bytes) -> Files:
    for i, frame in enumerate(recording.frames):
        yield _frame_name(i), encode(frame)
    if picture:
        yield PICTURE, picture
    yield RECORD, json.dumps(_as_json(recording), indent=1).encode()


def _write_folder(temporary: Path, name: str, files: Files, opened: FileOpener) -> None:
    (temporary / "frames").mkdir(parents=True)
    for file_name, content in files:
        with opened(temporary / file_name) as file:
            file.write(content)
    for directory in (temporary / "frames", temporary):
        sync_directory(directory)


def _write_zip(temporary: Path, name: str, files: Files, opened: FileOpener) -> None:
    """Write one file with all files in a folder `name`; they have no time of their own, for a clock may be wrong."""
    temporary.parent.mkdir(parents=True, exist_ok=True)
    with opened(temporary) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for file_name, content in files:
            info = zipfile.ZipInfo(f"{name}/{file_name}")
            info.external_attr = READABLE << 16
            archive.writestr(info, content)


def read_recording(path: Path | str) -> Recording:
    """Read a folder or .zip; raise `InvalidQuantity` naming what is wrong."""
    with _files(Path(path)) as read:
        try:
            record = json.loads(read(RECORD))
        except (*UNREADABLE, ValueError) as error:
            raise InvalidQuantity("recording", path, "a folder or .zip with recording.json", REPAIR) from error
        return _from_json(record, read)


def read_head(path: Path) -> RecordingHead:
    """Read how a recording was taken, and no frame of it; raise `InvalidQuantity` naming what is wrong."""
    with _files(path) as read:
        try:
            return _head(json.loads(read(RECORD)))
        except (*UNREADABLE, ValueError) as error:
            raise InvalidQuantity("recording", path, "a folder or .zip with recording.json", REPAIR) from error


def read_forces(path: Path) -> tuple[FrameForce, ...]:
    """Read the force of every frame of a recording, and no frame; raise `InvalidQuantity` naming what is wrong."""
    with _files(path) as read:
        try:
            record = json.loads(read(RECORD))
        except (*UNREADABLE, ValueError) as error:
            raise InvalidQuantity("recording", path, "a folder or .zip with recording.json", REPAIR) from error
    entries = _field(record, "frames", list)
    return tuple(_force(entry, f"frames[{i}].") for i, entry in enumerate(entries))


def read_picture(path: Path) -> bytes | None:
    """Return the picture that lies in a recording, None when it has none; raise `InvalidQuantity` for a damaged one."""
    with _files(path) as read:
        try:
            return read(PICTURE)
        except (KeyError, FileNotFoundError):
            return None
        except UNREADABLE as error:
            raise InvalidQuantity(PICTURE, path, "a readable picture", REPAIR) from error


def _frame_name(i: int) -> str:
    return f"frames/{i:03d}.png"


def _as_json(recording: Recording) -> dict[str, Any]:
    return {
        "schema": SCAN_SCHEMA if len(recording.ramps()) > 1 else SCHEMA,
        "id": recording.id,
        "device": {"serial": recording.serial, "software": recording.software},
        "started_at": recording.started_at,
        "simulated": recording.simulated,
        "camera": recording.camera.as_record(),
        "cell": asdict(recording.cell) if recording.cell else None,
        "frames": [
            {
                "file": _frame_name(i),
                "role": frame.role,
                "t_s": frame.t_s,
                "force_n": frame.force_n,
                "led_ratio": frame.led_ratio,
                **({"ramp": frame.ramp} if frame.ramp else {}),
            }
            for i, frame in enumerate(recording.frames)
        ],
        "calibration_id": recording.calibration_id,
        "position_mm": recording.position_mm,
        "truth": asdict(recording.truth) if recording.truth else None,
        "phantom_serial": recording.phantom_serial,
        **({"mode": recording.mode} if recording.mode else {}),
    }


@contextmanager
def _files(path: Path) -> Iterator[Callable[[str], bytes]]:
    if path.suffix == ".zip" and path.is_file():
        try:
            opened = zipfile.ZipFile(path)
        except zipfile.BadZipFile as error:
            raise InvalidQuantity("recording", path, "a readable .zip", REPAIR) from error
        with opened as archive:
            root = _root_in(path, archive.namelist())
            yield lambda name: archive.read(root + name)
    else:
        yield lambda name: (path / name).read_bytes()


def _root_in(path: Path, names: Sequence[str]) -> str:
    """Return the folder of the one recording among a .zip's names, with its last slash; "" where there is none."""
    if any(PurePosixPath(name).match("recordings/*.zip") for name in names):
        action = "unpack it and name what is in recordings/"
        raise InvalidQuantity("recording", f"{path}, an export of recordings", "one recording", action)
    roots = {name.removesuffix(RECORD) for name in names if PurePosixPath(name).name == RECORD}
    if len(roots) > 1:
        raise InvalidQuantity(
            "recording", f"{path} with {len(roots)} recordings in it", "one", "unpack it and name each"
        )
    return next(iter(roots), "")


def _field(record: Any, name: str, kind: type | tuple[type, ...], where: str = "") -> Any:
    """Return a field of the right type; JSON's true is a number to Python, but not to us."""
    value = record.get(name) if isinstance(record, dict) else None
    if not isinstance(value, kind) or isinstance(value, bool):
        found = "missing" if value is None else repr(value)
        expected = "a number" if kind is NUMBER else f"of type {kind.__name__}" if isinstance(kind, type) else str(kind)
        raise InvalidQuantity(where + name, found, expected, REPAIR)
    return value


def _from_json(record: dict[str, Any], read: Callable[[str], bytes]) -> Recording:
    if _field(record, "schema", str) not in (SCHEMA, SCAN_SCHEMA):
        bound = f"{SCHEMA} or {SCAN_SCHEMA}"
        raise InvalidQuantity("schema", record["schema"], bound, "convert the recording with matching software")
    head, truth, entries = _head(record), record.get("truth"), _field(record, "frames", list)
    require_room_for(len(entries), head.camera)
    recording = Recording(
        id=_field(record, "id", str),
        serial=head.serial,
        software=head.software,
        started_at=_time(record),
        camera=head.camera,
        frames=tuple(_frame(entry, i, read) for i, entry in enumerate(entries)),
        calibration_id=_optional(record, "calibration_id", str, None),
        position_mm=_position_mm(_optional(record, "position_mm", list, [0.0, 0.0])),
        truth=Inclusion(*(_field(truth, n, NUMBER, "truth.") for n in UNKNOWNS)) if truth is not None else None,
        simulated=head.simulated,
        cell=_cell(_optional(record, "cell", dict, None)),
        phantom_serial=_optional(record, "phantom_serial", str, ""),
        mode=_mode(_optional(record, "mode", str, None)),
    )
    if record["schema"] == SCHEMA and len(recording.ramps()) > 1:
        raise InvalidQuantity("schema", SCHEMA, f"{SCAN_SCHEMA} with frames of several ramps", REPAIR)
    return recording


def _head(record: dict[str, Any]) -> RecordingHead:
    device, camera = _field(record, "device", dict), _field(record, "camera", dict)
    names = (n for n in CameraSettings.__dataclass_fields__ if n not in GEOMETRY or n in camera)
    return RecordingHead(
        serial=_field(device, "serial", str, "device."),
        software=_field(device, "software", str, "device."),
        simulated=_optional(record, "simulated", bool, False),
        camera=CameraSettings(**{n: _field(camera, n, NUMBER, "camera.") for n in names}),
    )


def _force(entry: Any, where: str) -> FrameForce:
    t_s, force_n = (float(_field(entry, name, NUMBER, where)) for name in ("t_s", "force_n"))
    return FrameForce(_field(entry, "role", str, where), int(entry.get("ramp", 0)), t_s, force_n)


def require_room_for(frames: int, camera: CameraSettings) -> None:
    """Refuse more frames than `MOST_BYTES` of memory hold, before any of them is read."""
    of_one = camera.width_px * camera.height_px * (1 if camera.bits == 8 else 2)
    most = MOST_BYTES // max(int(of_one), 1)
    require("frames of the recording", frames, Bound(0, most, "frames"), "record fewer frames, or split the recording")


def _cell(record: dict[str, Any] | None) -> RecordedCell | None:
    if record is None:
        return None
    tare = _field(record, "tare_counts", NUMBER, "cell.") if record.get("tare_counts") is not None else None
    return RecordedCell(_field(record, "counts_per_n", NUMBER, "cell."), tare)


def _time(record: dict[str, Any]) -> str:
    text = str(_field(record, "started_at", str))
    try:
        datetime.fromisoformat(text)
    except ValueError as error:
        raise InvalidQuantity("started_at", text, "a time of RFC 3339", REPAIR) from error
    return text


def _optional(record: dict[str, Any], name: str, kind: type, default: Any) -> Any:
    """Return a field that may be null or absent, then the default."""
    value = record.get(name)
    if value is not None and not isinstance(value, kind):
        raise InvalidQuantity(name, repr(value), f"of type {kind.__name__}", REPAIR)
    return default if value is None else value


def _mode(name: str | None) -> Mode | None:
    """Return the mode of a name; one that only newer software knows is none, and its frames are read without it."""
    return next((mode for mode in MODES if mode == name), None)


def _position_mm(values: list[Any]) -> tuple[float, float]:
    if len(values) != 2:
        raise InvalidQuantity("position_mm", values, "two numbers, x and y", REPAIR)
    x, y = (require("position_mm", value, Bound(-1e3, 1e3, "mm"), REPAIR) for value in values)
    return x, y


def _frame(entry: dict[str, Any], i: int, read: Callable[[str], bytes]) -> Frame:
    where = f"frames[{i}]."
    name = _field(entry, "file", str, where)
    if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts:
        raise InvalidQuantity(where + "file", name, "a path inside the recording", REPAIR)
    try:
        counts = cv2.imdecode(np.frombuffer(read(name), np.uint8), cv2.IMREAD_UNCHANGED)
    except (*UNREADABLE, cv2.error) as error:
        raise InvalidQuantity(where + "file", name, "a readable PNG", REPAIR) from error
    if counts is None:
        raise InvalidQuantity(where + "file", name, "a readable PNG", REPAIR)
    ratio = _field(entry, "led_ratio", list, where)
    if len(ratio) != 4:
        raise InvalidQuantity(where + "led_ratio", ratio, "four numbers, one a side", REPAIR)
    force_n, t_s = (_field(entry, n, NUMBER, where) for n in ("force_n", "t_s"))
    require(where + "force_n", force_n, Bound(-1e3, 1e3, "N"), REPAIR)
    ramp = _field(entry, "ramp", int, where) if "ramp" in entry else 0
    return Frame(counts, _field(entry, "role", str, where), t_s, force_n, tuple(ratio), ramp)
