"""The frames of a press to PNGs, by a thread of its own while the hand still presses.

At the last frame nearly nothing is left to encode. OpenCV encodes without Python's lock, so it is another core's work.
At most the frames that the press keeps are held; which these are is said anew with every frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor

from device.files.recording_file import png_of
from device.measurement.recording.tactile_image import Frame


class EncodedFrames:
    """PNGs of the frames of the press under way. Its methods are for the procedure's thread alone."""

    def __init__(self) -> None:
        self._encoder = ThreadPoolExecutor(max_workers=1, thread_name_prefix="encoder")
        self._pngs: dict[int, tuple[Frame, Future[bytes]]] = {}

    def follow(self, frames: Sequence[Frame], *, are_all: bool = False) -> None:
        """Encode these frames and forget every other one.

        Unless they `are_all` there will be, the newest waits for the next one: a frame that is nearer to its force may
        take its place.
        """
        newest = None if are_all else max(frames, key=lambda frame: frame.t_s, default=None)
        wanted = {id(frame): frame for frame in frames if frame is not newest}
        for key in self._pngs.keys() - wanted.keys():
            self._pngs.pop(key)[1].cancel()
        for key in wanted.keys() - self._pngs.keys():
            self._pngs[key] = wanted[key], self._encoder.submit(png_of, wanted[key])

    def png_of(self, frame: Frame) -> bytes:
        """Return a frame as PNG; waits for it when it is still being made, and makes it when nobody asked for it."""
        _, png = self._pngs.get(id(frame), (frame, None))
        return png.result() if png else png_of(frame)

    @property
    def held(self) -> int:
        """How many frames are held at present."""
        return len(self._pngs)

    def clear(self) -> None:
        """Forget every frame."""
        self.follow(())

    def close(self) -> None:
        """End the thread."""
        self.clear()
        self._encoder.shutdown()
