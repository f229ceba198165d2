"""What runs in the camera's own process: open the camera, then answer each request with a frame or an error.

Only the frame's number and times go through the pipe, its counts through the ring. The process ends when the other end
of the pipe is closed, and also while the camera's library hangs when the daemon dies: nothing else may keep the camera.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from multiprocessing import parent_process
from multiprocessing.connection import Connection

from device.errors import DeviceError
from device.hardware.frame_ring import FrameRing
from device.hardware.interfaces import Camera
from device.measurement.quantities import InvalidQuantity

CameraOpener = Callable[[], Camera]
"""Opens the camera inside the process: picklable, so a function of a module or a `partial` of one."""


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
    with closing(camera):
        pipe.send(Ready())
        for request in _requests(pipe):
            pipe.send(_answer(camera, ring, request))


def _requests(pipe: Connection) -> Iterator[CaptureRequest | RestRequest]:
    with suppress(EOFError, ConnectionResetError):
        while True:
            yield pipe.recv()


def _answer(
    camera: Camera, ring: FrameRing, request: CaptureRequest | RestRequest
) -> CaptureReply | Ready | DeviceError:
    try:
        if isinstance(request, RestRequest):
            camera.rest()
            return Ready()
        frame = camera.capture(begun_after_s=request.begun_after_s, timeout_s=request.timeout_s)
    except DeviceError as error:
        return error
    return CaptureReply(ring.write(frame.counts), frame.exposure_start_s, frame.exposure_us, frame.gain)


def _end_with_the_daemon() -> None:
    """End this process with its parent, whatever the main thread hangs in (unless it holds Python's lock)."""
    daemon = parent_process()
    if daemon is not None:
        daemon.join()
        os._exit(1)
