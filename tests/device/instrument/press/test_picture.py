"""The picture of a press shows what the corrected images of its frames show, in true proportions."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from device.files.shipped import SIMULATED_PROBE
from device.instrument.press.picture import WIDTH_PX, tactile_png
from device.measurement.parameters import HIGH, LOW
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.recording import Recording
from device.simulation.virtual_probe import ProbeTables
from host_tools.press_models.recorded_presses import recorded_press


@pytest.fixture(scope="module", params=["quick", "standard"])
def recording(request) -> Recording:
    return recorded_press(ProbeTables.load(SIMULATED_PROBE), np.asarray((LOW + HIGH) / 2), request.param, 1)


def shades(colour: np.ndarray) -> np.ndarray:
    """Return each pixel's place in the colour map, and -1 where it is black."""
    bar = cv2.applyColorMap(np.arange(256, dtype=np.uint8), cv2.COLORMAP_VIRIDIS)[0].astype(int)
    place = {tuple(one): number for number, one in enumerate(bar)} | {(0, 0, 0): -1}
    return np.array([[place[tuple(pixel)] for pixel in row] for row in colour[::8, ::8].astype(int)])


def test_it_shows_the_mean_contrast_of_the_full_frames(recording):
    """Full frames, smoothed as much: the picture of before was made so, in ten times the time."""
    colour = cv2.imdecode(np.frombuffer(tactile_png(recording), np.uint8), cv2.IMREAD_COLOR)
    images = list(recording.press_images())
    contrast = cv2.GaussianBlur(np.mean([image.contrast for image in images], axis=0), (0, 0), 4)
    valid = np.all([image.valid for image in images], axis=0)
    shade = np.clip(contrast / contrast[valid].max() * 255, 0, 255).astype(np.float32)
    expected = cv2.resize(shade, colour.shape[1::-1], interpolation=cv2.INTER_AREA)[::8, ::8]
    inside = cv2.erode(valid.astype(np.uint8), np.ones((31, 31)))
    inside = cv2.resize(inside, colour.shape[1::-1], interpolation=cv2.INTER_NEAREST)[::8, ::8] > 0
    found = shades(colour)
    assert np.count_nonzero(inside) > 500
    assert np.abs(found - expected)[inside].mean() < 4.0
    assert np.corrcoef(found[inside], expected[inside])[0, 1] > 0.99


def test_its_pixels_are_square(recording):
    height, width = cv2.imdecode(np.frombuffer(tactile_png(recording), np.uint8), cv2.IMREAD_COLOR).shape[:2]
    camera = recording.camera
    assert width == WIDTH_PX
    face = camera.width_px * camera.mm_per_px_x / (camera.height_px * camera.mm_per_px_y)
    assert width / height == pytest.approx(face, rel=0.01)


@pytest.mark.parametrize("role", ["dark", "reference", "press"])
def test_without_frames_of_a_role_there_is_no_picture(recording, role):
    without = replace(recording, frames=tuple(frame for frame in recording.frames if frame.role != role))
    with pytest.raises(InvalidQuantity, match=f"{role} frames"):
        tactile_png(without)
