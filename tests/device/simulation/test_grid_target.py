"""A printed grid: dots where they are said to be, seen by the virtual probe's own light, lens and sensor."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.simulation.grid_target import EDGE_MM, GridTarget
from device.simulation.hand import BESIDE_MM
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.scenario import Scenario, read_scenario
from device.simulation.virtual_probe import VirtualProbe
from host_tools.calibration.phantom import CAMERA

AT_MM = np.linspace(-6, 6, 601)
X_MM, Y_MM = AT_MM[None, :], AT_MM[:, None]
SHAPE = CAMERA.height_px, CAMERA.width_px


def darkness_about(target, x_mm, y_mm):
    """Return the light that dots within a millimetre take, and where its middle is."""
    near = np.hypot(X_MM - x_mm, Y_MM - y_mm) < 1.0
    dark = (1 - target.light_ratio(X_MM, Y_MM)) * near
    return dark.sum() * (AT_MM[1] - AT_MM[0]) ** 2, np.array([(dark * X_MM).sum(), (dark * Y_MM).sum()]) / dark.sum()


def test_dots_stand_on_a_turned_grid_about_the_middle_of_the_cap():
    target = GridTarget(x_mm=0.3, y_mm=-0.2, turn_deg=30.0)
    for column, row in ((0, 0), (2, 0), (0, -1), (-1, 1)):
        turned = 2.0 * (column + 1j * row) * np.exp(1j * np.pi / 6)
        expected = np.array([0.3 + turned.real, -0.2 + turned.imag])
        np.testing.assert_allclose(darkness_about(target, *expected)[1], expected, atol=1e-3)


def test_the_middle_dot_is_larger_and_ink_takes_its_share_of_the_light():
    target = GridTarget()
    for x_mm, radius_mm in ((0.0, 0.6), (2.0, 0.4)):
        area_mm2 = np.pi * (radius_mm**2 + (np.pi * EDGE_MM) ** 2 / 3)  # of a disc with a logistic edge
        assert darkness_about(target, x_mm, 0.0)[0] == pytest.approx(0.7 * area_mm2, rel=0.02)
    assert np.ptp(GridTarget(ink_ratio=1.0).light_ratio(X_MM, Y_MM)) == 0.0


ON_IT = ProbePlacement()


def counts(tables, target, force_n, place=ON_IT):
    probe = VirtualProbe(Scenario(grid=target), tables, SHAPE, CAMERA.scale)
    return probe.frame_counts(
        force_n=force_n, place=place, led_ratio=(0.6,) * 4, exposure_us=4000, gain=1.0, frame_number=1
    ).astype(float)


def test_the_virtual_probe_sees_it_once_the_cap_is_on_however_hard(tables):
    off, on, harder = (counts(tables, GridTarget(), force_n) for force_n in (0.0, 0.3, 0.6))
    np.testing.assert_array_equal(on, harder)
    assert off.mean() < 6.0 < 60.0 < on.mean()


def test_a_printed_dot_is_dark_in_the_image_and_a_blank_plate_has_none(tables):
    printed, blank = (counts(tables, replace(GridTarget(), ink_ratio=ratio), 0.3) for ratio in (0.3, 1.0))
    middle = np.s_[SHAPE[0] // 2 - 3 : SHAPE[0] // 2 + 3, SHAPE[1] // 2 - 3 : SHAPE[1] // 2 + 3]
    between = np.s_[SHAPE[0] // 2 - 30 : SHAPE[0] // 2 - 24, SHAPE[1] // 2 + 29 : SHAPE[1] // 2 + 35]
    assert (printed[middle].mean() - 4) / (blank[middle].mean() - 4) == pytest.approx(0.3, abs=0.05)
    assert printed[between].mean() == pytest.approx(blank[between].mean(), rel=0.05)


def test_beside_the_lesions_place_the_plate_is_blank(tables):
    printed, blank = (
        counts(tables, replace(GridTarget(), ink_ratio=ratio), 0.3, ProbePlacement(*BESIDE_MM)) for ratio in (0.3, 1.0)
    )
    np.testing.assert_array_equal(printed, blank)


@pytest.mark.parametrize(
    ("key", "value"), [("pitch_mm", 0.1), ("dot_mm", 1.5), ("middle_dot_mm", 0.5), ("ink_ratio", 1.2), ("x_mm", 9.0)]
)
def test_a_grid_that_cannot_be_printed_is_refused(tmp_path, key, value):
    file = tmp_path / "scene.toml"
    file.write_text(f"[grid]\n{key} = {value}\n")
    with pytest.raises(InvalidQuantity, match=f"grid.{key}"):
        read_scenario(file)


def test_linear_light_knows_no_print():
    with pytest.raises(InvalidQuantity, match="grid is given"):
        Scenario(light="linear", grid=GridTarget())
