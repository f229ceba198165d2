"""Simulated phantoms are recorded by the same probe as the daemon simulates: otherwise a calibration would not hold."""

from device.config import simulated_config
from device.instrument import capture
from host_tools import phantom


def test_phantoms_are_recorded_with_the_simulated_probes_settings():
    config = simulated_config()
    camera = config.camera
    assert config.serial == phantom.SERIAL
    assert (camera.height_px, camera.width_px) == (phantom.CAMERA.height_px, phantom.CAMERA.width_px)
    assert camera.scale == phantom.CAMERA.scale
    assert (camera.exposure_us, camera.gain) == (phantom.CAMERA.exposure_us, phantom.CAMERA.gain)
    assert config.light.ratio == phantom.LIT
    assert (config.press.target_n, config.press.frames) == (phantom.TARGET_N, phantom.PRESS_FRAMES)
    assert capture.UNLOADED_FRAMES == phantom.UNLOADED_FRAMES
