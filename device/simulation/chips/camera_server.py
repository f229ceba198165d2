"""The virtual camera for another process: a Unix socket in the daemon, where hand, light and faults are.

Each connection has a camera of its own, as each process on a board opens its own Picamera2; it is closed when the
connection ends, as the kernel does for a process that dies. Calls and answers are pickled, so the socket lies in a
folder of this user alone.
"""

from __future__ import annotations

import itertools
import os
import socketserver
import threading
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from device.simulation.chips.faulty_frames import CameraCrash
from device.simulation.chips.virtual_camera import VirtualPicamera2, VirtualRequest

LOOK_EVERY_S = 0.05


@dataclass(frozen=True)
class Call:
    """A method of the camera, or of the request of that number, or the name of an attribute."""

    request_number: int | None
    name: str
    arguments: tuple[Any, ...] = ()
    options: tuple[tuple[str, Any], ...] = ()


@dataclass(frozen=True)
class RequestNumber:
    """Stands for a `VirtualRequest`, which stays in the daemon."""

    number: int


class CameraServer:
    """Serves cameras at `address` until it is closed."""

    def __init__(self, open_camera: Callable[[], VirtualPicamera2]) -> None:
        self._folder = TemporaryDirectory(prefix="tsis-camera-")
        self.address = str(Path(self._folder.name) / "socket")
        self._server = _Server(self.address, open_camera)
        self._thread = threading.Thread(target=self._server.serve_forever, args=(LOOK_EVERY_S,), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Take no more connections; those that there are end with their processes."""
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()
        self._folder.cleanup()


class _Server(socketserver.ThreadingUnixStreamServer):
    daemon_threads = True

    def __init__(self, address: str, open_camera: Callable[[], VirtualPicamera2]) -> None:
        self.open_camera = open_camera
        super().__init__(address, _Session)


class _Session(socketserver.BaseRequestHandler):
    """One connection: one camera, and the requests that are out."""

    server: _Server

    def handle(self) -> None:
        """Answer calls until the other process closes its end or dies."""
        self._numbers = itertools.count(1)
        self._requests: dict[int, VirtualRequest] = {}
        with (
            Connection(os.dup(self.request.fileno())) as connection,
            closing(self.server.open_camera()) as camera,
            suppress(EOFError, ConnectionError),
        ):
            while True:
                connection.send(self._answer(camera, connection.recv()))

    def _answer(self, camera: VirtualPicamera2, call: Call) -> Any:
        subject = camera if call.request_number is None else self._requests[call.request_number]
        try:
            answer = getattr(subject, call.name)
            if callable(answer):
                answer = answer(*call.arguments, **dict(call.options))
        except (RuntimeError, TimeoutError, CameraCrash) as error:
            return error
        if isinstance(answer, VirtualRequest):
            number = next(self._numbers)
            self._requests[number] = answer
            return RequestNumber(number)
        if call.name == "release" and call.request_number is not None:
            del self._requests[call.request_number]
        return answer
