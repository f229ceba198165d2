"""Where the bright spot lies under the face, read from drawn frames."""

import numpy as np
import pytest

from device.instrument.press.inclusion_spot import inclusion_spot_mm
from device.measurement.recording.camera_geometry import CameraGeometry
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import Frame

SCALE = PixelScale(0.25, 0.3)
X_MM, Y_MM = SCALE.coordinates_mm((80, 96))
IDEAL = CameraGeometry(SCALE)
LIT, DARK = (0.6,) * 4, (0.0,) * 4


def frames(role, forces_n, contrast=0.0, at_mm=(0.0, 0.0), seed=1):
    """Return frames of a face that is brighter by a Gaussian of 3 mm at a place."""
    rng = np.random.default_rng(seed)
    spot = 1 + contrast * np.exp(-((X_MM - at_mm[0]) ** 2 + (Y_MM - at_mm[1]) ** 2) / (2 * 3.0**2))
    found = []
    for force_n in forces_n:
        counts = 4 + 300 * force_n**0.7 * (0.6 if role != "dark" else 0.0) * spot
        noisy = np.clip(np.round(counts + rng.normal(0, 1.0, counts.shape)), 0, 255).astype(np.uint8)
        found.append(Frame(noisy, role, 0.0, force_n, DARK if role == "dark" else LIT))
    return found


BEFORE = frames("dark", [0.0] * 2)
HELD, RAMP = [0.49, 0.5, 0.51] * 3, list(np.linspace(0.06, 0.62, 10))


@pytest.mark.parametrize("forces_n", [HELD, RAMP], ids=["hold", "ramp"])
@pytest.mark.parametrize("at_mm", [(0.0, 0.0), (3.0, 0.0), (-2.0, 1.5), (0.0, -4.0)])
def test_the_spot_is_found_where_it_is_right_and_down_being_positive(forces_n, at_mm):
    """Nearer to the middle by what the window cuts off, at most a fifth at 4 mm."""
    spot_mm = inclusion_spot_mm(BEFORE, frames("reference", forces_n), frames("press", forces_n, 0.2, at_mm), IDEAL)
    assert np.abs(np.subtract(spot_mm, at_mm)).max() <= 0.1 + 0.2 * np.hypot(*at_mm)
    assert np.dot(spot_mm, at_mm) >= 0.8 * np.dot(at_mm, at_mm)


@pytest.mark.parametrize("forces_n", [HELD, RAMP], ids=["hold", "ramp"])
def test_without_an_inclusion_there_is_no_spot(forces_n):
    """Also when the two presses were not equally hard."""
    press = frames("press", [1.04 * force_n for force_n in forces_n], seed=2)
    assert inclusion_spot_mm(BEFORE, frames("reference", forces_n), press, IDEAL) is None


def test_the_spot_is_told_from_the_middle_of_the_face_which_is_not_the_images():
    shown = BEFORE, frames("reference", HELD), frames("press", HELD, 0.2, (2.0, -1.0))
    seen_mm = inclusion_spot_mm(*shown, IDEAL)
    beside_mm = inclusion_spot_mm(*shown, CameraGeometry(SCALE, axis_x_mm=0.4, axis_y_mm=-0.3))
    np.testing.assert_allclose(np.subtract(beside_mm, seen_mm), (0.4, -0.3), atol=1e-6)
