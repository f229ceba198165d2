"""picamera2's interface over a socket: the same answers, errors and frames as from the virtual camera itself."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from device.simulation.chips.camera_server import CameraServer
from device.simulation.chips.remote_camera import RemotePicamera2
from device.simulation.chips.virtual_camera import BUFFER_COUNT, ExposureRequest, VirtualPicamera2
from device.simulation.faults import NO_FAULTS, FaultTimeline, ScriptedFault

CONTROLS = {"ExposureTime": 2000, "FrameDurationLimits": (10_000, 10_000), "AnalogueGain": 2.0}


def numbered(exposure: ExposureRequest) -> np.ndarray:
    return np.full((32, 64), exposure.frame_number % 256, np.uint8)


def virtual(faults: FaultTimeline = NO_FAULTS) -> VirtualPicamera2:
    return VirtualPicamera2(numbered, width_px=64, height_px=32, led_ratio_at=lambda _: (0.0,) * 4, faults=faults)


@pytest.fixture
def server() -> Iterator[CameraServer]:
    server = CameraServer(virtual)
    yield server
    server.close()


@pytest.fixture
def camera(server: CameraServer) -> Iterator[RemotePicamera2]:
    camera = RemotePicamera2(server.address)
    camera.configure(camera.create_video_configuration(raw={"size": (64, 32), "format": "R8"}, controls=CONTROLS))
    yield camera
    camera.close()


def test_configuration_and_controls_are_those_of_the_virtual_camera(camera):
    assert camera.camera_controls == virtual().camera_controls
    assert camera.camera_configuration()["raw"] == {"format": "R8", "size": (64, 32), "stride": 64}


def test_frames_come_with_their_metadata_and_are_rendered_only_when_asked_for(camera):
    camera.start()
    flush_ns = time.monotonic_ns()
    request = camera.capture_request(flush=flush_ns, wait=5.0)
    metadata, rows = request.get_metadata(), request.make_array("raw")
    request.release()
    assert metadata["SensorTimestamp"] - 1000 * metadata["ExposureTime"] >= flush_ns
    assert rows.shape == (32, 64)
    assert rows.min() == rows.max()


def test_errors_have_the_class_and_the_words_of_the_virtual_camera(camera):
    with pytest.raises(RuntimeError, match=r"^Control AwbEnable is not advertised by libcamera$"):
        camera.set_controls({"AwbEnable": False})
    camera.start()
    with pytest.raises(TimeoutError):
        camera.capture_request(flush=time.monotonic_ns() + 10**12, wait=0.01)
    camera.cancel_all_and_flush()
    request = camera.capture_request(wait=5.0)
    with pytest.raises(RuntimeError, match=r"^Stream 'lores' is not defined$"):
        request.make_array("lores")


def test_requests_hold_their_buffers_until_they_are_released(camera):
    camera.start()
    requests = [camera.capture_request(wait=5.0) for _ in range(BUFFER_COUNT)]
    with pytest.raises(TimeoutError):
        camera.capture_request(wait=0.02)
    camera.cancel_all_and_flush()
    requests[0].release()
    camera.capture_request(wait=5.0)


def test_each_connection_has_a_camera_of_its_own(server, camera):
    camera.start()
    other = RemotePicamera2(server.address)
    assert other.camera_configuration() is None
    other.close()


def test_where_the_library_would_crash_the_process_is_killed(monkeypatch):
    server = CameraServer(lambda: virtual(FaultTimeline([ScriptedFault("camera_crashed")])))
    killed: list[tuple[int, int]] = []
    monkeypatch.setattr(os, "kill", lambda pid, number: killed.append((pid, number)))
    camera = RemotePicamera2(server.address)
    with pytest.raises(Exception, match="^$"):
        camera.capture_request(wait=1.0)
    assert killed == [(os.getpid(), signal.SIGKILL)]
    camera.close()
    server.close()


def test_a_call_that_hangs_lasts_longer_than_it_was_told_to_wait_and_keeps_no_other_connection():
    now_s = [0.0]
    faults = FaultTimeline([ScriptedFault("camera_hung", until_s=1.0)], clock=lambda: now_s[0])
    server = CameraServer(lambda: virtual(faults))
    hung, other = RemotePicamera2(server.address), RemotePicamera2(server.address)

    def capture() -> None:
        with pytest.raises(TimeoutError):
            hung.capture_request(wait=0.001)

    waiting = threading.Thread(target=capture)
    waiting.start()
    assert other.camera_configuration() is None
    assert waiting.is_alive()
    now_s[0] = 1.0
    waiting.join()
    hung.close()
    other.close()
    server.close()


def test_a_closed_server_leaves_no_socket_behind():
    server = CameraServer(virtual)
    folder = Path(server.address).parent
    assert folder.exists()
    server.close()
    assert not folder.exists()
