"""picamera2's interface in the camera's process; each call is answered by a `VirtualPicamera2` in the daemon.

Everything above it is the code of a real probe, and so is what becomes of it: where the camera's library would crash,
this process is killed.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from functools import partial
from multiprocessing.connection import Client
from typing import Any

from device.simulation.chips.camera_server import Call, RequestNumber
from device.simulation.chips.faulty_frames import CameraCrash


class RemotePicamera2:
    """The camera at the address of a `CameraServer`: every method and attribute of `VirtualPicamera2`."""

    def __init__(self, address: str) -> None:
        self._connection = Client(address, family="AF_UNIX")

    @property
    def camera_controls(self) -> dict[str, tuple[Any, Any, Any]]:
        """Limits and default of each control."""
        controls: dict[str, tuple[Any, Any, Any]] = self.ask(Call(None, "camera_controls"))
        return controls

    def __getattr__(self, name: str) -> Callable[..., Any]:
        return partial(self._call, name)

    def close(self) -> None:
        """Give the camera up."""
        self._connection.close()

    def ask(self, call: Call) -> Any:
        """Return what the daemon answers; raise what it raises."""
        self._connection.send(call)
        answer = self._connection.recv()
        if isinstance(answer, CameraCrash):
            os.kill(os.getpid(), signal.SIGKILL)
        if isinstance(answer, Exception):
            raise answer
        return RemoteRequest(self, answer.number) if isinstance(answer, RequestNumber) else answer

    def _call(self, name: str, *arguments: Any, **options: Any) -> Any:
        return self.ask(Call(None, name, arguments, tuple(options.items())))


class RemoteRequest:
    """A frame that the daemon holds: `make_array`, `get_metadata` and `release` of `VirtualRequest`."""

    def __init__(self, camera: RemotePicamera2, number: int) -> None:
        self._camera, self._number = camera, number

    def __getattr__(self, name: str) -> Callable[..., Any]:
        return partial(self._call, name)

    def _call(self, name: str, *arguments: Any) -> Any:
        return self._camera.ask(Call(self._number, name, arguments))
