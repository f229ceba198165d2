"""The camera in a process of its own: when its library hangs or dies, that process is ended and another one started.

A frame that is lost that way is not made up for: the call that waited for it raises, within its own deadline, and the
next call starts the process again. How often it may is bounded, so that a broken camera is a fault and not a loop.
Source: Python's multiprocessing, start method "spawn": nothing of the daemon but the arguments is in the new process.
"""

from __future__ import annotations

import logging
import multiprocessing
import threading
from multiprocessing.connection import Connection
from typing import TypeVar

from device.errors import CameraError, CameraProcessError, DeviceError
from device.hardware.camera_worker import CameraOpener, CaptureReply, CaptureRequest, Ready, RestRequest, serve_camera
from device.hardware.frame_ring import FrameRing
from device.hardware.interfaces import CameraFrame
from device.hardware.restart_limit import RestartLimit
from device.measurement.quantities import InvalidQuantity

log = logging.getLogger(__name__)
WorkerAnswer = TypeVar("WorkerAnswer")
Spawn = multiprocessing.get_context("spawn")
START_TIMEOUT_S = 20.0
"""For an interpreter, picamera2 and the first configuration, on a board that is still starting other things."""
GRACE_S = 2.0
"""So much later than the frame itself may the process say that none came: on a busy board it is late, not hung."""
CLOSE_TIMEOUT_S, KILL_TIMEOUT_S = 3.0, 3.0
WINDOW_S = 60.0
REMEDY = "Check the camera's ribbon cable, then restart the probe."
CHILD_REMEDY = "It is started again by itself; if this stays, check the camera's ribbon cable and restart the probe."


class CameraProcess:
    """A camera that another process has open. Implements `Camera`; may be closed from any thread."""

    def __init__(self, opener: CameraOpener, *, shape: tuple[int, int], limit: RestartLimit) -> None:
        """Start to open the camera of frames [height_px, width_px], and wait for nothing: see `require_open`."""
        self._opener, self._shape, self._limit = opener, shape, limit
        self._lock = threading.Lock()
        self._is_closed = False
        self._child: CameraChild | None = CameraChild(opener, shape)

    def require_open(self) -> None:
        """Return once the camera is open; raise what the opener raises, or `CameraProcessError`."""
        with self._lock:
            self._ready_child()

    @property
    def pid(self) -> int | None:
        """Number of the camera's process; None while there is none."""
        return self._child.pid if self._child else None

    def capture(self, *, begun_after_s: float, timeout_s: float) -> CameraFrame:
        """Return the next frame whose exposure began at or after `begun_after_s` (s, monotonic).

        Raises `CameraError` when none comes within `timeout_s`, `CameraProcessError` when the process hangs or has
        ended; the next call starts it again, which may take longer, and raises it too when that is too often.
        """
        with self._lock:
            child = self._ready_child()
            try:
                return child.capture(begun_after_s=begun_after_s, timeout_s=timeout_s)
            except CameraProcessError:
                self._child = None
                child.kill()
                raise

    def rest(self) -> None:
        """Stop the stream until the next frame is asked for; raises `CameraProcessError` as `capture` does.

        A process that is gone has nothing to stop: the next frame starts it again.
        """
        with self._lock:
            try:
                if self._child:
                    self._child.rest()
            except CameraProcessError:
                child, self._child = self._child, None
                if child:
                    child.kill()
                raise

    def _ready_child(self) -> CameraChild:
        child, self._child = self._child or self._restarted(), None
        child.require_ready()  # or it is killed already
        self._child = child
        return child

    def _restarted(self) -> CameraChild:
        if self._is_closed:
            raise CameraError("The camera is closed.", "Restart the probe.")
        if not self._limit.allows_one():
            often = f"{self._limit.max_restarts} times within {self._limit.window_s:g} s"
            raise CameraProcessError(f"The camera's process was started again {often}, in vain.", REMEDY)
        log.warning("the camera's process is started again")
        return CameraChild(self._opener, self._shape)

    def close(self) -> None:
        """End the process and its camera; waits for a capture under way, which has its deadline."""
        with self._lock:
            self._is_closed = True
            if self._child:
                self._child.close()
                self._child = None


class CameraChild:
    """One life of the camera's process: its start, its frames and its end, none of them waited for without limit.

    It opens the camera while the daemon goes on with its own start. To be killed after a `CameraProcessError`, which
    says that it is of no use. The shared memory loses its name as soon as both processes have it open, so that no kill
    can leave it behind.
    Raises that error, or the `CameraError` or `InvalidQuantity` that the camera itself raised when it was opened.
    """

    def __init__(self, opener: CameraOpener, shape: tuple[int, int]) -> None:
        self._ring = FrameRing.create(shape)
        self._pipe, theirs = Spawn.Pipe()
        arguments = (theirs, self._ring.name, shape, opener)
        self._process = Spawn.Process(target=serve_camera, args=arguments, name="camera", daemon=True)
        self._is_ready, self._has_name = False, True
        self._failure = _start(self._process, theirs)

    def require_ready(self) -> None:
        """Wait until the camera is open, once."""
        if self._is_ready:
            return
        try:
            if self._failure:
                raise self._failure
            self._answer(Ready, START_TIMEOUT_S)
            self._is_ready = True
        except (DeviceError, InvalidQuantity):
            self.kill()
            raise
        finally:
            self._take_name_away()

    def _take_name_away(self) -> None:
        if self._has_name:
            self._ring.unlink()
            self._has_name = False

    def rest(self) -> None:
        """Have the stream stopped; raises as `capture`."""
        self._send(RestRequest())
        self._answer(Ready, GRACE_S)

    @property
    def pid(self) -> int | None:
        """Number of the process."""
        return self._process.pid

    def capture(self, *, begun_after_s: float, timeout_s: float) -> CameraFrame:
        """Return a frame as `Camera.capture` does, with its errors; `CameraProcessError` when the process is gone."""
        self._send(CaptureRequest(begun_after_s, timeout_s))
        reply = self._answer(CaptureReply, timeout_s + GRACE_S)
        return CameraFrame(self._ring.read(reply.number), reply.exposure_start_s, reply.exposure_us, reply.gain)

    def close(self) -> None:
        """Let the process close the camera and end; kill it if it does not."""
        self._pipe.close()
        if not self._failure:
            self._process.join(CLOSE_TIMEOUT_S)
        self.kill()

    def kill(self) -> None:
        """End the process at once; the kernel closes its camera."""
        self._pipe.close()
        self._take_name_away()
        if not self._failure and self._process.is_alive():
            self._process.kill()
            self._process.join(KILL_TIMEOUT_S)
        self._ring.close()

    def _send(self, request: CaptureRequest | RestRequest) -> None:
        try:
            self._pipe.send(request)
        except (BrokenPipeError, ConnectionResetError) as error:
            raise self._has_ended() from error

    def _answer(self, kind: type[WorkerAnswer], timeout_s: float) -> WorkerAnswer:
        try:
            if not self._pipe.poll(timeout_s):
                raise CameraProcessError(f"The camera's process did not answer within {timeout_s:g} s.", CHILD_REMEDY)
            answer = self._pipe.recv()
        except (EOFError, ConnectionResetError) as error:
            raise self._has_ended() from error
        if isinstance(answer, DeviceError | InvalidQuantity):
            raise answer
        assert isinstance(answer, kind)
        return answer

    def _has_ended(self) -> CameraProcessError:
        self._process.join(KILL_TIMEOUT_S)
        return CameraProcessError(f"The camera's process ended with exit code {self._process.exitcode}.", CHILD_REMEDY)


def _start(process: multiprocessing.process.BaseProcess, theirs: Connection) -> CameraProcessError | None:
    """Start a process and hand it its end of the pipe: with a copy here, its death would not end the pipe."""
    try:
        process.start()
    except OSError as error:
        return CameraProcessError(f"The camera's process cannot be started: {error}.", "Restart the probe.")
    finally:
        theirs.close()
    return None
