"""What the camera's driver takes for granted of picamera2: true of the virtual one everywhere, and of the real one.

`make test-camera-virtual` runs the same file on the real picamera2 and libcamera's virtual camera (TSIS_LIBCAMERA=1).
That camera has one processed stream instead of a raw one, and no exposure, gain or pacing: what the driver takes for
granted of these is checked on the probe itself.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from device.config_chips import RawMode
from device.errors import CameraError
from device.hardware.camera import RawMonoCamera
from device.simulation.chips.virtual_camera import VirtualPicamera2

SIZE = WIDTH_PX, HEIGHT_PX = 768, 492
BUFFERS = 4
ON_LIBCAMERA = os.environ.get("TSIS_LIBCAMERA") == "1"


@dataclass
class Subject:
    """A camera, and the stream that it has."""

    picam2: Any
    stream: str
    stream_format: str

    def configuration(self, size: tuple[int, int] = SIZE, **more: Any) -> Any:
        stream = {self.stream: {"size": size, "format": self.stream_format}}
        return self.picam2.create_video_configuration(**stream, buffer_count=BUFFERS, display=None, encode=None, **more)

    def start(self) -> None:
        self.picam2.configure(self.configuration())
        self.picam2.start()


def virtual_camera() -> Subject:
    picture = np.full((HEIGHT_PX, WIDTH_PX), 70, np.uint8)
    dark = (0.0, 0.0, 0.0, 0.0)
    picam2 = VirtualPicamera2(lambda _: picture, width_px=WIDTH_PX, height_px=HEIGHT_PX, led_ratio_at=lambda _: dark)
    return Subject(picam2, "raw", "R8")


def libcamera_camera() -> Subject:
    from virtual_libcamera import open_virtual_camera

    return Subject(open_virtual_camera(), "main", "NV12")


@pytest.fixture(params=[libcamera_camera if ON_LIBCAMERA else virtual_camera], ids=lambda make: make.__name__)
def camera(request: pytest.FixtureRequest) -> Iterator[Subject]:
    subject = request.param()
    yield subject
    subject.picam2.stop()
    subject.picam2.close()


def test_each_control_has_a_lowest_a_highest_and_a_default_value(camera):
    camera.picam2.configure(camera.configuration())
    assert all(len(limits) == 3 for limits in camera.picam2.camera_controls.values())
    assert "FrameDurationLimits" in camera.picam2.camera_controls


def test_the_configuration_says_what_the_camera_gives(camera):
    camera.picam2.configure(camera.configuration())
    given = camera.picam2.camera_configuration()[camera.stream]
    assert (given["format"], given["size"]) == (camera.stream_format, SIZE)
    assert given["stride"] >= WIDTH_PX


def test_a_size_that_the_camera_has_not_is_adjusted_without_a_word(camera):
    camera.picam2.configure(camera.configuration((640, 480)))
    assert camera.picam2.camera_configuration()[camera.stream]["size"] == SIZE


def test_a_running_camera_cannot_be_configured(camera):
    camera.start()
    with pytest.raises(RuntimeError, match="^Camera must be stopped before configuring$"):
        camera.picam2.configure(camera.configuration())


def test_a_camera_that_was_not_configured_configures_itself_when_it_is_started(camera):
    assert not camera.picam2.camera_configuration()
    camera.picam2.start()
    assert camera.picam2.camera_configuration()


def test_a_control_that_the_camera_has_not_is_refused(camera):
    camera.picam2.configure(camera.configuration())
    with pytest.raises(RuntimeError, match="^Control AwbEnable is not advertised by libcamera$"):
        camera.picam2.set_controls({"AwbEnable": False})


def test_a_request_has_a_time_stamp_of_the_monotonic_clock_that_grows(camera):
    stamps_ns = [time.monotonic_ns()]
    camera.start()
    for _ in range(2 * BUFFERS):
        request = camera.picam2.capture_request(wait=5.0)
        stamps_ns.append(request.get_metadata()["SensorTimestamp"])
        request.release()
    assert all(np.diff(stamps_ns) > 0)
    assert stamps_ns[-1] <= time.monotonic_ns()


def test_the_bytes_of_a_frame_are_those_of_the_picture(camera):
    """Grey of 40, 70 or 100; the rows are padded to the stride."""
    camera.start()
    stride = camera.picam2.camera_configuration()[camera.stream]["stride"]
    request = camera.picam2.capture_request(wait=5.0)
    data = np.asarray(request.make_array(camera.stream)).reshape(-1)
    rows = data[: HEIGHT_PX * stride].reshape(HEIGHT_PX, stride)[:, :WIDTH_PX]
    request.release()
    assert set(np.unique(rows).tolist()) <= {40, 70, 100}


def test_a_stream_that_was_not_configured_has_no_array(camera):
    camera.start()
    request = camera.picam2.capture_request(wait=5.0)
    with pytest.raises(RuntimeError, match="^Stream 'lores' is not defined$"):
        request.make_array("lores")
    request.release()


def test_a_request_can_be_released_once(camera):
    camera.start()
    request = camera.picam2.capture_request(wait=5.0)
    request.release()
    with pytest.raises(RuntimeError, match="^CompletedRequest: lock now has negative ref_count$"):
        request.release()


def test_requests_that_are_kept_starve_the_camera_until_one_is_released(camera):
    """A capture that timed out leaves a job behind, which takes the next frame unless it is cancelled."""
    camera.start()
    requests = [camera.picam2.capture_request(wait=5.0) for _ in range(BUFFERS)]
    with pytest.raises(TimeoutError):
        camera.picam2.capture_request(wait=0.2)
    camera.picam2.cancel_all_and_flush()
    requests.pop().release()
    requests.append(camera.picam2.capture_request(wait=5.0))
    for request in requests:
        request.release()


def test_a_camera_whose_exposure_cannot_be_set_is_no_camera_of_the_probe(camera):
    camera.picam2.camera_controls.pop("ExposureTime", None)
    with pytest.raises(CameraError, match="cannot be started: Control ExposureTime is not advertised by libcamera"):
        RawMonoCamera(camera.picam2, mode=RawMode.whole(*SIZE), exposure_us=4000, gain=1.0, frame_rate_hz=30.0)


def test_a_stopped_camera_can_be_configured_and_started_again(camera):
    camera.start()
    camera.picam2.capture_request(wait=5.0).release()
    camera.picam2.stop()
    camera.start()
    camera.picam2.capture_request(wait=5.0).release()
