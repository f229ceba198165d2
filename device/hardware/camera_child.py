"""One life of the camera's process, seen from the daemon: its start, its frames and its end, none waited for for ever.

The shared memory loses its name as soon as both processes have it open, so that no kill can leave it behind.
Source: Python's multiprocessing, start method "spawn": nothing of the daemon but the arguments is in the new process.
"""

from __future__ import annotations

import multiprocessing
from multiprocessing.connection import Connection
from typing import TypeVar

from device.errors import CameraProcessError, DeviceError
from device.hardware.camera_worker import CameraOpener, CaptureReply, CaptureRequest, Ready, serve_camera
from device.hardware.frame_ring import FrameRing
from device.hardware.interfaces import CameraFrame
from device.measurement.quantities import InvalidQuantity

START_TIMEOUT_S = 20.0
"""For an interpreter, picamera2 and the first configuration, on a board that is still starting other things."""
GRACE_S = 2.0
"""So much later than the frame itself may the process say that none came: on a busy board it is late, not hung."""
CLOSE_TIMEOUT_S, KILL_TIMEOUT_S = 3.0, 3.0
REMEDY = "It is started again by itself; if this stays, check the camera's ribbon cable and restart the probe."

Answer = TypeVar("Answer")
Spawn = multiprocessing.get_context("spawn")


class CameraChild:
    """A process that has the camera open. To be killed after a `CameraProcessError`, which says that it is of no use.

    Raises that error, or the `CameraError` or `InvalidQuantity` that the camera itself raised when it was opened.
    """

    def __init__(self, opener: CameraOpener, shape: tuple[int, int]) -> None:
        self._ring = FrameRing.create(shape)
        self._pipe, theirs = Spawn.Pipe()
        arguments = (theirs, self._ring.name, shape, opener)
        self._process = Spawn.Process(target=serve_camera, args=arguments, name="camera", daemon=True)
        try:
            _start(self._process, theirs)
            self._answer(Ready, START_TIMEOUT_S)
        except (DeviceError, InvalidQuantity):
            self.kill()
            raise
        finally:
            self._ring.unlink()

    @property
    def pid(self) -> int | None:
        """Number of the process."""
        return self._process.pid

    def capture(self, *, begun_after_s: float, timeout_s: float) -> CameraFrame:
        """Return a frame as `Camera.capture` does, with its errors; `CameraProcessError` when the process is gone."""
        try:
            self._pipe.send(CaptureRequest(begun_after_s, timeout_s))
        except (BrokenPipeError, ConnectionResetError) as error:
            raise self._has_ended() from error
        reply = self._answer(CaptureReply, timeout_s + GRACE_S)
        return CameraFrame(self._ring.read(reply.number), reply.exposure_start_s, reply.exposure_us, reply.gain)

    def close(self) -> None:
        """Let the process close the camera and end; kill it if it does not."""
        self._pipe.close()
        self._process.join(CLOSE_TIMEOUT_S)
        self.kill()

    def kill(self) -> None:
        """End the process at once; the kernel closes its camera."""
        self._pipe.close()
        if self._process.is_alive():
            self._process.kill()
            self._process.join(KILL_TIMEOUT_S)
        self._ring.close()

    def _answer(self, kind: type[Answer], timeout_s: float) -> Answer:
        try:
            if not self._pipe.poll(timeout_s):
                raise CameraProcessError(f"The camera's process did not answer within {timeout_s:g} s.", REMEDY)
            answer = self._pipe.recv()
        except (EOFError, ConnectionResetError) as error:
            raise self._has_ended() from error
        if isinstance(answer, DeviceError | InvalidQuantity):
            raise answer
        assert isinstance(answer, kind)
        return answer

    def _has_ended(self) -> CameraProcessError:
        self._process.join(KILL_TIMEOUT_S)
        return CameraProcessError(f"The camera's process ended with exit code {self._process.exitcode}.", REMEDY)


def _start(process: multiprocessing.process.BaseProcess, theirs: Connection) -> None:
    """Start a process and hand it its end of the pipe: with a copy here, its death would not end the pipe."""
    try:
        process.start()
    except OSError as error:
        raise CameraProcessError(f"The camera's process cannot be started: {error}.", "Restart the probe.") from error
    finally:
        theirs.close()
