"""The picture of a press shows what the corrected images of its frames show, in true proportions."""

import struct
import zlib
from dataclasses import replace

import cv2
import numpy as np
import pytest

from device.files.shipped import SIMULATED_PROBE
from device.instrument.press.picture import WIDTH_PX, tactile_png
from device.measurement.parameters import HIGH, LOW
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.recording import Recording
from device.measurement.recording.tactile_image import FULL_CONTRAST
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
    shade = np.clip(contrast / FULL_CONTRAST * 255, 0, 255).astype(np.float32)
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


def chunks(png: bytes) -> dict[bytes, bytes]:
    """Return the chunks of a PNG, each with a right checksum, by kind."""
    found, at = {}, 8
    while at < len(png):
        (length,), kind = struct.unpack(">I", png[at : at + 4]), png[at + 4 : at + 8]
        content = png[at + 8 : at + 8 + length]
        assert struct.unpack(">I", png[at + 8 + length : at + 12 + length]) == (zlib.crc32(kind + content),)
        found[kind], at = content, at + 12 + length
    return found


def test_it_says_its_scale_and_what_its_brightest_colour_means(recording):
    said = chunks(tactile_png(recording))
    across, down, unit = struct.unpack(">IIB", said[b"pHYs"])
    camera = recording.camera
    assert (across, unit) == (down, 1)
    assert 1000 * WIDTH_PX / across == pytest.approx(camera.width_px * camera.mm_per_px_x, rel=0.01)
    assert said[b"tEXt"] == f"full_contrast\0{FULL_CONTRAST:g}".encode()


@pytest.mark.parametrize("role", ["dark", "reference", "press"])
def test_without_frames_of_a_role_there_is_no_picture(recording, role):
    without = replace(recording, frames=tuple(frame for frame in recording.frames if frame.role != role))
    with pytest.raises(InvalidQuantity, match=f"{role} frames"):
        tactile_png(without)
