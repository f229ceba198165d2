"""What runs in the camera's own process: open the camera, then answer each request with a frame or an error.

While one frame after the other is asked for, up to two are taken ahead, so that none is lost when the daemon is late:
the camera's library keeps only the newest, and a browser that asks for a list may hold the daemon for a frame's time.
Only the frame's number and times go through the pipe, its counts through the ring. The process ends when the other end
of the pipe is closed, and also while the camera's library hangs when the daemon dies: nothing else may keep the camera.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from multiprocessing import parent_process
from multiprocessing.connection import Connection

from device.errors import DeviceError
from device.hardware.frame_ring import FrameRing
from device.hardware.interfaces import Camera, CameraFrame
from device.measurement.quantities import InvalidQuantity

CameraOpener = Callable[[], Camera]
"""Opens the camera inside the process: picklable, so a function of a module or a `partial` of one."""
MOST_AHEAD = 2
"""With the one that is being read, and one that is being written, that fills the ring."""
FRESH_S = 0.1
"""Who asks so soon after an answer wants every frame, and a frame that was taken ahead is as good as new so long."""


@dataclass(frozen=True)
class CaptureRequest:
    """What `Camera.capture` is asked for."""

    begun_after_s: float
    timeout_s: float


@dataclass(frozen=True)
class RestRequest:
    """`Camera.rest` is asked for."""


@dataclass(frozen=True)
class CaptureReply:
    """A `CameraFrame` whose counts lie in the ring under a number."""

    number: int
    exposure_start_s: float
    exposure_us: float
    gain: float


@dataclass(frozen=True)
class Ready:
    """The camera is open, and the ring attached; or it rests."""


def serve_camera(pipe: Connection, ring_name: str, shape: tuple[int, int], opener: CameraOpener) -> None:
    """Send `Ready`, then a `CaptureReply` for every `CaptureRequest`; or, instead of either, the error it ended in."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches both processes; the daemon says when to end
    threading.Thread(target=_end_with_the_daemon, daemon=True).start()
    ring = FrameRing.attach(ring_name, shape)
    try:
        camera = opener()
    except (DeviceError, InvalidQuantity) as error:
        pipe.send(error)
        return
    with closing(camera), suppress(BrokenPipeError):  # whoever opened it has gone again
        pipe.send(Ready())
        frames = FramesAhead(camera, ring)
        for request in _requests(pipe):
            pipe.send(_answer(camera, frames, request))
            while not pipe.poll() and frames.take_one_ahead():
                pass


def _requests(pipe: Connection) -> Iterator[CaptureRequest | RestRequest]:
    with suppress(EOFError, ConnectionResetError):
        while True:
            yield pipe.recv()


def _answer(
    camera: Camera, frames: FramesAhead, request: CaptureRequest | RestRequest
) -> CaptureReply | Ready | DeviceError:
    try:
        if isinstance(request, RestRequest):
            frames.forget()
            camera.rest()
            return Ready()
        return frames.next(request)
    except DeviceError as error:
        return error


class FramesAhead:
    """The camera's frames in the ring, some of them before they are asked for."""

    def __init__(self, camera: Camera, ring: FrameRing) -> None:
        self._camera, self._ring = camera, ring
        self._ahead: deque[tuple[float, CaptureReply]] = deque()
        self._last: CaptureReply | None = None
        self._frame_s = self._answered_s = 0.0
        self._is_stream = False

    def next(self, request: CaptureRequest) -> CaptureReply:
        """Return the frame that is asked for; raises `DeviceError` as the camera does."""
        asked_s, last = time.monotonic(), self._last
        self._is_stream = last is not None and asked_s - self._answered_s < FRESH_S and _is_next(request, last)
        while self._ahead:
            taken_s, reply = self._ahead.popleft()
            if asked_s - taken_s < FRESH_S and reply.exposure_start_s >= request.begun_after_s:
                return self._answered(reply)
        return self._answered(self._taken(request.begun_after_s, request.timeout_s))

    def take_one_ahead(self) -> bool:
        """Take the next frame if it will be wanted; return whether it came in its time. Its errors are not told yet."""
        newest = self._ahead[-1][1] if self._ahead else self._last
        if newest is None or not (self._is_stream and self._frame_s > 0.0 and len(self._ahead) < MOST_AHEAD):
            return False
        try:
            reply = self._taken(newest.exposure_start_s + 1e-6, 2 * self._frame_s)
        except DeviceError:  # whoever asks for it is told
            return False
        self._ahead.append((time.monotonic(), reply))
        return True

    def forget(self) -> None:
        """Forget what was taken ahead: the stream stops."""
        self._ahead.clear()
        self._last, self._is_stream = None, False

    def _taken(self, begun_after_s: float, timeout_s: float) -> CaptureReply:
        frame: CameraFrame = self._camera.capture(begun_after_s=begun_after_s, timeout_s=timeout_s)
        number = self._ring.write(frame.counts)
        return CaptureReply(number, frame.exposure_start_s, frame.exposure_us, frame.gain)

    def _answered(self, reply: CaptureReply) -> CaptureReply:
        self._frame_s = min(reply.exposure_start_s - self._last.exposure_start_s, FRESH_S) if self._last else 0.0
        self._last, self._answered_s = reply, time.monotonic()
        return reply


def _is_next(request: CaptureRequest, last: CaptureReply) -> bool:
    """Tell whether the frame after the last is asked for, rather than one under a light that was set since."""
    return request.begun_after_s < last.exposure_start_s + last.exposure_us * 1e-6


def _end_with_the_daemon() -> None:
    """End this process with its parent, whatever the main thread hangs in (unless it holds Python's lock)."""
    daemon = parent_process()
    if daemon is not None:
        daemon.join()
        os._exit(1)
