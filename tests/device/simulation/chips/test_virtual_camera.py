"""The virtual picamera2 keeps the rules, and the wording, of the real one."""

from __future__ import annotations

import time

import numpy as np
import pytest

from device.simulation.chips.faulty_frames import LATE_CAMERA_KEEPS_EVERY
from device.simulation.chips.virtual_camera import BUFFER_COUNT, ExposureRequest, VirtualPicamera2
from device.simulation.faults import FaultTimeline, ScriptedFault

FRAME_US, EXPOSURE_US = 10_000, 2_000
CONTROLS = {"ExposureTime": EXPOSURE_US, "FrameDurationLimits": (FRAME_US, FRAME_US), "AnalogueGain": 1.52}


class Scene:
    """Remembers which exposures were rendered."""

    def __init__(self) -> None:
        self.exposures: list[ExposureRequest] = []

    def render(self, exposure: ExposureRequest) -> np.ndarray:
        self.exposures.append(exposure)
        return np.zeros((32, 64), np.uint8)


@pytest.fixture
def scene() -> Scene:
    return Scene()


@pytest.fixture
def camera(scene: Scene) -> VirtualPicamera2:
    camera = VirtualPicamera2(
        scene.render, width_px=64, height_px=32, led_ratio_at=lambda t_s: (t_s, 0.0, 0.0, 0.0), max_frame_rate_hz=120.0
    )
    camera.configure(camera.create_video_configuration(raw={"size": (64, 32), "format": "R8"}, controls=CONTROLS))
    return camera


def test_a_flushed_frame_began_at_or_after_the_flush(camera):
    camera.start()
    flush_ns = time.monotonic_ns()
    metadata = camera.capture_request(flush=flush_ns, wait=30.0).get_metadata()
    start_ns = metadata["SensorTimestamp"] - 1000 * metadata["ExposureTime"]
    assert start_ns >= flush_ns


def test_a_frame_is_delivered_only_when_its_exposure_is_over(camera):
    camera.start()
    for _ in range(3):
        request = camera.capture_request(wait=30.0)
        assert request.get_metadata()["SensorTimestamp"] <= time.monotonic_ns()
        request.release()


def test_frames_that_nobody_took_are_gone(camera, scene):
    camera.start()
    time.sleep(5 * FRAME_US * 1e-6)
    camera.capture_request(wait=30.0).make_array("raw")
    assert scene.exposures[0].frame_number >= 4


def test_the_exposure_is_rendered_with_the_light_at_its_start_and_the_scene_at_its_middle(camera, scene):
    camera.start()
    request = camera.capture_request(wait=30.0)
    request.make_array("raw")
    exposure = scene.exposures[0]
    assert exposure.t_s - exposure.led_ratio[0] == pytest.approx(EXPOSURE_US * 0.5e-6, abs=1e-7)
    assert exposure.t_s == pytest.approx(1e-9 * request.get_metadata()["SensorTimestamp"] - EXPOSURE_US * 0.5e-6)


def test_only_frames_that_are_taken_are_rendered(camera, scene):
    camera.start()
    for _ in range(2):
        request = camera.capture_request(flush=time.monotonic_ns() + 3000 * FRAME_US, wait=30.0)
        request.make_array("raw")
        request.release()
    assert len(scene.exposures) == 2
    assert scene.exposures[1].frame_number - scene.exposures[0].frame_number >= 3


def test_gain_comes_in_steps_of_a_sixteenth(camera):
    """1.52 * 16 = 24.32, so 24/16."""
    camera.start()
    assert camera.capture_request(wait=30.0).get_metadata()["AnalogueGain"] == 1.5


def test_an_exposure_cannot_outlast_its_frame(camera):
    camera.set_controls({"ExposureTime": 500_000})
    camera.start()
    assert camera.capture_request(wait=30.0).get_metadata()["ExposureTime"] == FRAME_US


def test_requests_that_are_not_released_starve_the_camera_until_one_is(camera):
    camera.start()
    requests = [camera.capture_request(wait=30.0) for _ in range(BUFFER_COUNT)]
    with pytest.raises(TimeoutError):
        camera.capture_request(wait=0.02)
    camera.cancel_all_and_flush()
    requests[0].release()
    camera.capture_request(wait=30.0)


def test_captures_that_timed_out_keep_buffers_until_they_are_cancelled(camera):
    camera.start()
    for _ in range(BUFFER_COUNT):
        with pytest.raises(TimeoutError):
            camera.capture_request(flush=time.monotonic_ns() + 10**12, wait=0.001)
    with pytest.raises(TimeoutError):
        camera.capture_request(wait=0.02)
    camera.cancel_all_and_flush()
    camera.capture_request(wait=30.0)


def test_a_stopped_camera_delivers_nothing_and_a_restarted_one_does(camera):
    camera.start()
    stale = camera.capture_request(wait=30.0)
    camera.stop()
    with pytest.raises(TimeoutError):
        camera.capture_request(wait=0.01)
    camera.start()
    stale.release()
    camera.capture_request(wait=30.0).release()


def test_what_the_sensor_does_not_have_is_adjusted_without_a_word(camera):
    camera.configure(camera.create_video_configuration(raw={"size": (640, 480), "format": "R10"}))
    configuration = camera.camera_configuration()
    assert configuration is not None
    assert configuration["raw"] == {"format": "R8", "size": (64, 32), "stride": 64}


def test_controls_of_a_running_camera_act_two_frames_later_and_the_metadata_say_so(camera):
    """The frame under way and the next are as they were: the first other one begins one to two frames later."""
    camera.start()
    before_ns = time.monotonic_ns()
    camera.set_controls({"ExposureTime": 3_000, "AnalogueGain": 4.0})
    after_ns, flush_ns, seen = time.monotonic_ns(), 1, set()
    while (3_000, 4.0) not in seen:
        request = camera.capture_request(flush=flush_ns, wait=30.0)
        metadata, flush_ns = request.get_metadata(), request.get_metadata()["SensorTimestamp"]
        request.release()
        start_ns = flush_ns - 1000 * metadata["ExposureTime"]
        seen.add((metadata["ExposureTime"], metadata["AnalogueGain"]))
        if metadata["ExposureTime"] == 3_000:
            assert start_ns > before_ns + 1000 * FRAME_US
        else:
            assert start_ns <= after_ns + 1000 * FRAME_US
    assert seen <= {(EXPOSURE_US, 1.5), (3_000, 4.0)}


def test_unpacked_formats_of_more_bits_have_two_bytes_a_pixel_the_low_one_first():
    """1023 at the top of 16 bits is 0x3FF at their low end."""
    white = np.full((32, 64), 1023 << 6, np.uint16)
    camera = VirtualPicamera2(
        lambda _: white, width_px=64, height_px=32, led_ratio_at=lambda _: (0.0,) * 4, raw_formats=("R8", "R10")
    )
    camera.configure(camera.create_video_configuration(raw={"size": (64, 32), "format": "R10"}, controls=CONTROLS))
    assert camera.camera_configuration()["raw"] == {"format": "R10", "size": (64, 32), "stride": 128}
    camera.start()
    rows = camera.capture_request(wait=30.0).make_array("raw")
    assert (rows.shape, rows.dtype) == ((32, 128), np.uint8)
    assert rows[0, :4].tolist() == [0xFF, 0x03, 0xFF, 0x03]


def test_errors_are_worded_as_the_real_ones(camera):
    configuration = camera.create_video_configuration()
    with pytest.raises(RuntimeError, match=r"^Control AwbEnable is not advertised by libcamera$"):
        camera.set_controls({"AwbEnable": False})
    with pytest.raises(RuntimeError, match=r"^Unrecognised raw format GREY$"):
        camera.configure(camera.create_video_configuration(raw={"format": "GREY"}))
    with pytest.raises(RuntimeError, match=r"^width and height should be even$"):
        camera.configure(camera.create_video_configuration(raw={"size": (63, 32)}))
    camera.start()
    with pytest.raises(RuntimeError, match=r"^Camera must be stopped before configuring$"):
        camera.configure(configuration)
    request = camera.capture_request(wait=30.0)
    with pytest.raises(RuntimeError, match=r"^Stream 'lores' is not defined$"):
        request.make_array("lores")
    request.release()
    with pytest.raises(RuntimeError, match=r"^CompletedRequest: lock now has negative ref_count$"):
        request.release()


def camera_with(fault: ScriptedFault, render=lambda exposure: np.zeros((32, 64), np.uint8)) -> VirtualPicamera2:
    """A running camera with one fault; the light is the time, so that rows can tell when they were exposed."""
    camera = VirtualPicamera2(
        render, width_px=64, height_px=32, led_ratio_at=lambda t_s: (t_s, 0.0, 0.0, 0.0), faults=FaultTimeline([fault])
    )
    camera.configure(camera.create_video_configuration(raw={"size": (64, 32), "format": "R8"}, controls=CONTROLS))
    camera.start()
    return camera


def test_a_stalled_camera_delivers_nothing_until_it_goes_on():
    start_s = time.monotonic()
    camera = camera_with(ScriptedFault("camera_stall", until_s=1.0))
    with pytest.raises(TimeoutError):
        camera.capture_request(wait=0.03)
    camera.cancel_all_and_flush()
    metadata = camera.capture_request(wait=30.0).get_metadata()
    assert metadata["SensorTimestamp"] * 1e-9 >= start_s + 1.0


def test_the_time_stamps_of_a_late_camera_skip_frames():
    camera = camera_with(ScriptedFault("camera_late"))
    stamps_ns = []
    for _ in range(3):
        request = camera.capture_request(wait=30.0)
        stamps_ns.append(request.get_metadata()["SensorTimestamp"])
        request.release()
    skipped = np.diff(stamps_ns) / (1000 * FRAME_US)
    assert (skipped % LATE_CAMERA_KEEPS_EVERY == 0).all()
    assert (skipped > 0).all()


def test_a_stale_frame_is_the_exposure_before_under_its_own_time_stamp():
    """The light is the time: what it was at the start of the exposure that is shown, one frame too early."""
    exposures: list[ExposureRequest] = []

    def remember(exposure: ExposureRequest) -> np.ndarray:
        exposures.append(exposure)
        return np.zeros((32, 64), np.uint8)

    camera = camera_with(ScriptedFault("camera_stale"), remember)
    request = camera.capture_request(flush=time.monotonic_ns() + 3000 * FRAME_US, wait=30.0)
    request.make_array("raw")
    begun_s = 1e-9 * request.get_metadata()["SensorTimestamp"] - 1e-6 * EXPOSURE_US
    assert exposures[0].led_ratio[0] == pytest.approx(begun_s - 1e-6 * FRAME_US)


def test_the_lower_half_of_a_torn_frame_is_the_exposure_before():
    def frame_number(exposure: ExposureRequest) -> np.ndarray:
        return np.full((32, 64), exposure.frame_number, np.uint8)

    camera = camera_with(ScriptedFault("camera_torn"), frame_number)
    rows = camera.capture_request(flush=time.monotonic_ns() + 3000 * FRAME_US, wait=30.0).make_array("raw")
    upper, lower = rows[:16], rows[16:]
    assert (upper[:, :64] == upper[0, 0]).all()
    assert (lower[:, :64] == upper[0, 0] - 1).all()
