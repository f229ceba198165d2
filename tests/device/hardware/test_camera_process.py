"""The camera in a process of its own: frames and errors as if it were here, and no way to hang or to stay behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import scripted_camera
from daemon_process import ROOT
from scripted_camera import SHAPE, memory_of, scripted_process

from device.errors import CameraError, CameraProcessError, LateFrameError
from device.hardware import camera_process
from device.hardware.camera_process import CameraProcess
from device.hardware.restart_limit import RestartLimit
from device.measurement.quantities import InvalidQuantity


@pytest.fixture
def opened() -> Iterator[Callable[..., CameraProcess]]:
    """Opens scripted cameras, and closes them at the end."""
    cameras: list[CameraProcess] = []

    def open_one(**script: int) -> CameraProcess:
        cameras.append(scripted_process(**script))
        return cameras[-1]

    yield open_one
    for camera in cameras:
        camera.close()


@pytest.fixture
def hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(camera_process, "GRACE_S", 0.1)


def is_running(pid: int | None) -> bool:
    """Whether a process of ours is there; one that was waited for is not."""
    assert pid is not None
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def level(camera: CameraProcess, timeout_s: float = 5.0) -> int:
    return int(camera.capture(begun_after_s=0.0, timeout_s=timeout_s).counts[0, 0])


def test_it_opens_while_nobody_waits_and_one_that_is_closed_before_leaves_nothing_behind():
    begun = CameraProcess(scripted_camera.hanging_opener, shape=SHAPE, limit=RestartLimit(0, 60.0))
    pid, memory = begun.pid, memory_of(begun)
    assert is_running(pid)
    begun.close()
    assert not is_running(pid)
    assert not memory.exists()


def test_a_camera_that_rests_gives_the_next_frame_when_it_is_asked_for(opened):
    camera = opened()
    assert level(camera) == 1
    camera.rest()
    camera.rest()
    assert level(camera) == 2


def test_a_process_that_died_while_its_camera_rested_is_told_by_the_next_rest_and_replaced(opened):
    camera = opened()
    os.kill(camera.pid, signal.SIGKILL)
    with pytest.raises(CameraProcessError, match="exit code -9"):
        camera.rest()
    assert level(camera) == 1


def test_frames_come_from_another_process_with_their_times(opened):
    camera = opened()
    assert camera.pid != os.getpid()
    for number in range(1, 10):
        frame = camera.capture(begun_after_s=100.0 + number, timeout_s=0.5)
        np.testing.assert_array_equal(frame.counts, np.full(SHAPE, number, np.uint8))
        assert (frame.exposure_start_s, frame.exposure_us, frame.gain) == (100.0 + number, 0.5e6, 1.0)


def test_an_error_of_the_camera_arrives_as_it_was_raised_and_the_process_goes_on(opened):
    camera = opened(fails_at=2)
    pid = camera.pid
    level(camera)
    with pytest.raises(LateFrameError) as raised:
        level(camera)
    assert (raised.value.cause, raised.value.remedy) == ("Frames are late.", "Wait.")
    assert level(camera) == 3
    assert camera.pid == pid


def test_a_camera_that_cannot_be_opened_says_why_here():
    limit = RestartLimit(3, 60.0)
    with pytest.raises(CameraError, match="There is no camera. Buy one."):
        CameraProcess(scripted_camera.absent_camera, shape=SHAPE, limit=limit).require_open()
    with pytest.raises(InvalidQuantity, match="exposure_us is 3.0, but must be at least 0 and at most 2 us: shorten"):
        CameraProcess(scripted_camera.misconfigured_camera, shape=SHAPE, limit=limit).require_open()


def test_a_process_that_hangs_is_ended_and_another_one_started(opened, hurried):
    camera = opened(hangs_at=2)
    hung = camera.pid
    level(camera)
    with pytest.raises(CameraProcessError, match="did not answer within 0.2 s"):
        level(camera, timeout_s=0.1)
    assert not is_running(hung)
    assert level(camera) == 1
    assert camera.pid not in (None, hung)


def test_a_process_that_dies_in_a_call_is_replaced(opened):
    camera = opened(dies_at=2)
    level(camera)
    with pytest.raises(CameraProcessError, match="ended with exit code -9"):
        level(camera)
    assert level(camera) == 1


def test_a_process_that_died_between_two_calls_is_replaced(opened):
    camera = opened()
    os.kill(camera.pid, signal.SIGKILL)
    with pytest.raises(CameraProcessError, match="ended with exit code -9"):
        level(camera)
    assert level(camera) == 1


def test_a_process_that_dies_again_and_again_is_not_started_for_ever(opened):
    camera = opened(dies_at=1, max_restarts=2)
    for _ in range(3):
        with pytest.raises(CameraProcessError, match="exit code"):
            level(camera)
    for _ in range(2):
        with pytest.raises(CameraProcessError, match="was started again 2 times within 60 s, in vain. Check the"):
            level(camera)
    assert camera.pid is None


def test_a_camera_that_hangs_while_it_is_opened_is_given_up(monkeypatch):
    monkeypatch.setattr(camera_process, "START_TIMEOUT_S", 0.3)
    with pytest.raises(CameraProcessError, match="did not answer within 0.3 s"):
        CameraProcess(scripted_camera.hanging_opener, shape=SHAPE, limit=RestartLimit(3, 60.0)).require_open()


def test_a_process_that_does_not_end_by_itself_is_killed_at_the_end(monkeypatch, hurried):
    monkeypatch.setattr(camera_process, "CLOSE_TIMEOUT_S", 0.1)
    camera = scripted_process()
    pid = camera.pid
    os.kill(pid, signal.SIGSTOP)
    camera.close()
    assert not is_running(pid)


def test_a_closed_camera_has_no_process_no_memory_and_gives_no_frame(opened):
    camera = opened()
    pid, memory = camera.pid, memory_of(camera)
    level(camera)
    camera.close()
    assert not memory.exists()
    assert not is_running(pid)
    with pytest.raises(CameraError, match="is closed"):
        level(camera)


def test_the_process_imports_neither_web_server_nor_network():
    with pytest.raises(CameraError) as raised:
        CameraProcess(
            scripted_camera.camera_that_tells_what_is_imported, shape=SHAPE, limit=RestartLimit(0, 60.0)
        ).require_open()
    imported = set(raised.value.cause.split())
    assert "device.hardware.camera_worker" in imported
    assert imported.isdisjoint({"fastapi", "uvicorn", "onnxruntime", "scipy", "cv2", "smbus2"})


def program(*arguments: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'tests'}"}
    command = [sys.executable, *arguments]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_a_daemon_that_is_killed_leaves_no_camera_process_and_no_memory_behind():
    """The pipes of its output end only with the last process that has them, here one that hangs in the camera."""
    with program(str(ROOT / "tests" / "scripted_camera.py")) as daemon:
        pid, memory = daemon.stdout.readline().split()
        assert int(pid) != daemon.pid
        daemon.kill()
        assert daemon.communicate(timeout=60) == ("", "")
    assert not Path(memory).exists()


def test_a_daemon_that_ends_well_leaves_no_warning_of_leaked_memory():
    script = "import scripted_camera as s; c = s.scripted_process(); c.capture(begun_after_s=0, timeout_s=5); c.close()"
    with program("-c", script) as daemon:
        assert daemon.communicate(timeout=60) == ("", "")


def test_a_daemon_that_forgets_to_close_its_camera_ends_all_the_same():
    script = "import scripted_camera as s; c = s.scripted_process()"
    with program("-c", script) as daemon:
        assert daemon.communicate(timeout=60) == ("", "")
