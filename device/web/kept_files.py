"""What was kept of a press as files for a client: its picture, its recording as a .zip; and which a rule deletes now.

Both are on the disk as they are sent, so that clients cost no memory. A recording of an earlier release is a folder
without a picture: it is packed while it is sent, and one picture at a time is made of it, whoever else waits.
"""

from __future__ import annotations

import asyncio
import io
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Response
from fastapi.responses import FileResponse, StreamingResponse
from starlette.types import Receive, Scope, Send

from device.config import Config
from device.files.recording_file import FrameForce, read_forces, read_picture, read_recording
from device.instrument.press.picture import tactile_png
from device.instrument.watch.recordings_watch import retention_rule
from device.measurement.quantities import InvalidQuantity
from device.records.recordings import damaged_recording
from device.records.store import Store
from device.web.contract import answers
from device.web.schema import DueRecordings


class WholeFile(FileResponse):
    """A file that is sent whole, whatever part of it is asked for: as RFC 9110, 14.2 allows, without 206 and 416."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer as if the whole had been asked for."""
        headers = [(name, value) for name, value in scope["headers"] if name != b"range"]
        await super().__call__({**scope, "headers": headers}, receive, send)


class KeptFiles:
    """The pictures and recordings of a store's measurements. Raises as `Store.measurement` and `recording_path`."""

    def __init__(self, store: Store) -> None:
        self._store, self._making = store, asyncio.Semaphore()

    async def picture(self, measurement_id: str) -> Response:
        """Return the tactile image of a measurement; who waits for one to be made occupies no thread."""
        path = await asyncio.to_thread(self._path, measurement_id)
        try:
            png = await asyncio.to_thread(read_picture, path)
            if png is None:
                async with self._making:
                    png = await asyncio.to_thread(_made, path)
        except InvalidQuantity as error:  # of a recording of before there were hashes
            raise damaged_recording(path.stem) from error
        return Response(png, media_type="image/png")

    def recording(self, measurement_id: str) -> Response:
        """Return the recording of a measurement, sent piece by piece."""
        path = self._path(measurement_id)
        shown = {
            "ETag": f'"{path.stem}"',  # a recording never changes
            "Accept-Ranges": "none",
            "Content-Disposition": f'attachment; filename="tsis-measurement-{measurement_id}.zip"',
        }
        if path.is_file():
            return WholeFile(path, media_type="application/zip", headers=shown)
        return StreamingResponse(packed(path), media_type="application/zip", headers=shown)

    def forces(self, measurement_id: str) -> tuple[FrameForce, ...]:
        """Return the force of every frame of a measurement."""
        path = self._path(measurement_id)
        try:
            return read_forces(path)
        except InvalidQuantity as error:  # of a recording of before there were hashes
            raise damaged_recording(path.stem) from error

    def _path(self, measurement_id: str) -> Path:
        return self._store.recording_path(self._store.measurement(measurement_id)["recording_id"])


def _made(path: Path) -> bytes:
    return tactile_png(read_recording(path))


def packed(folder: Path) -> Iterator[bytes]:
    """Yield a .zip of a folder, file by file: what was yielded is not held any more."""
    window = _Window()
    with zipfile.ZipFile(window, "w", zipfile.ZIP_STORED, strict_timestamps=False) as archive:
        for path in sorted(one for one in folder.rglob("*") if one.is_file()):
            archive.write(path, path.relative_to(folder.parent))
            yield window.taken()
    yield window.taken()


class _Window(io.BytesIO):
    """The end of a file that is being written: `zipfile` goes back to the head of the present member, never further."""

    def __init__(self) -> None:
        super().__init__()
        self._before = 0

    def tell(self) -> int:
        return self._before + super().tell()

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        return self._before + super().seek(offset - self._before if whence == io.SEEK_SET else offset, whence)

    def taken(self) -> bytes:
        """Return what was written since the last time, and let go of it."""
        content = self.getvalue()
        self._before += len(content)
        super().seek(0)
        self.truncate(0)
        return content


def add_retention(app: FastAPI, api: str, config: Callable[[], Config], store: Store) -> None:
    """Add the route below `api` that shows what the rule of the settings deletes."""

    @app.get(f"{api}/retention", responses=answers(200, DueRecordings), tags=["device"])
    def get_retention() -> dict[str, Any]:
        """Return which recordings the settings' rule deletes now; it changes nothing."""
        return store.retention.plan(retention_rule(config())).as_record()
