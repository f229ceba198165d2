"""Images of grids to dots: drawn ones, whose places are known on paper."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.recording import CameraSettings, Recording
from device.measurement.recording.tactile_image import Frame
from device.simulation.grid_target import GridTarget
from host_tools.calibration.grid_dots import seen_grid

CAMERA = CameraSettings(
    width_px=400, height_px=300, bits=8, mm_per_px_x=0.06, mm_per_px_y=0.07, exposure_us=4000.0, gain=1.0
)
X_MM, Y_MM = CAMERA.scale.coordinates_mm((300, 400))
R_MM = np.hypot(X_MM, Y_MM)
LIGHT = np.where(R_MM < 11.0, 40 + 140 / (1 + np.exp((R_MM - 7.0) / 0.4)), 0.0)
"""It falls in a step, as where the light of an LED begins, and ends at the rim."""
LIT = (0.6,) * 4


def drawn(target, light=LIGHT, noise=1.0, **roles):
    """Return a recording of a grid; `roles` replace the light of some frames."""
    rng = np.random.default_rng(1)

    def frame(role, shown):
        noisy = np.clip(np.rint(4 + shown + noise * rng.standard_normal(shown.shape)), 0, 255)
        return Frame(noisy.astype(np.uint8), role, 0.0, 0.0 if role == "dark" else 0.5, LIT)

    shown = {"dark": 0 * light, "reference": light, "press": light * target.light_ratio(X_MM, Y_MM)} | roles
    frames = [frame(role, of) for role, of in shown.items() if of is not None for _ in range(4)]
    return Recording("grid", "TSIS-0007", "1", "2026-01-01T00:00:00Z", CAMERA, tuple(frames))


@pytest.mark.parametrize("turn_deg", [-38.0, 0.0, 7.0])
def test_every_dot_that_is_lit_is_found_where_it_was_drawn(turn_deg):
    target = GridTarget(x_mm=0.31, y_mm=-0.17, turn_deg=turn_deg)
    found = seen_grid(drawn(target), 2.0)
    turned = 2.0 * (found.number @ np.array([1, 1j])) * np.exp(1j * np.deg2rad(turn_deg))
    expected = np.stack([0.31 + turned.real, -0.17 + turned.imag], axis=1)
    np.testing.assert_allclose(found.image_mm, expected, atol=0.012)
    assert np.sqrt(np.mean((found.image_mm - expected) ** 2)) < 0.003
    assert len(found.number) >= 55
    assert len({tuple(number) for number in found.number}) == len(found.number)


def test_frames_of_the_untouched_face_are_no_blank_plate():
    recording = drawn(GridTarget())
    untouched = replace(recording.frames[4], counts=recording.frames[0].counts, force_n=0.0)
    with_these = replace(recording, frames=(*recording.frames, untouched, untouched))
    np.testing.assert_array_equal(seen_grid(with_these, 2.0).image_mm, seen_grid(recording, 2.0).image_mm)


def without_force(recording, roles=("reference", "press")):
    """Return a recording whose cell feels nothing of the caps in frames of these roles."""
    frames = tuple(replace(one, force_n=0.02) if one.role in roles else one for one in recording.frames)
    return replace(recording, frames=frames)


def test_where_no_cap_is_felt_all_lit_frames_beside_show_the_blank_plate():
    recording = drawn(GridTarget(x_mm=0.2))
    felt_nothing = without_force(recording)
    unlit = replace(recording.frames[0], role="reference", led_ratio=(0.0,) * 4)
    with_unlit = replace(felt_nothing, frames=(*felt_nothing.frames, unlit))
    for found in (felt_nothing, with_unlit):
        np.testing.assert_array_equal(seen_grid(found, 2.0).image_mm, seen_grid(recording, 2.0).image_mm)


@pytest.mark.parametrize(
    ("recording", "quantity"),
    [
        (drawn(GridTarget(pitch_mm=2.5)), "distance of the grid's dots"),
        (drawn(GridTarget(pitch_mm=4.0)), "dots of the grid"),
        (drawn(GridTarget(ink_ratio=1.0)), "dots of the grid"),
        (drawn(GridTarget(middle_dot_mm=0.8)), "middle dot of the grid"),
        (drawn(GridTarget(x_mm=2.0, y_mm=4.5), light=np.where(Y_MM < 4.6, LIGHT, 0.0)), "middle dot of the grid"),
        (drawn(GridTarget(), press=LIGHT), "dots of the grid"),
        (drawn(GridTarget(), reference=None), "reference frames"),
        (without_force(drawn(GridTarget()), ("reference",)), "reference frames"),
        (drawn(GridTarget(), dark=None), "dark frames"),
        (drawn(GridTarget(), reference=3 * LIGHT), "saturated pixels of reference frames"),
        (drawn(GridTarget(), light=LIGHT / 40), "dots of the grid"),
    ],
    ids=[
        "wider",
        "few",
        "blank",
        "no-middle",
        "dark-middle",
        "no-grid",
        "no-blank",
        "untouched",
        "no-dark",
        "saturated",
        "dim",
    ],
)
def test_what_is_no_grid_of_the_pitch_is_refused_by_name(recording, quantity):
    with pytest.raises(InvalidQuantity) as refused:
        seen_grid(recording, 2.0)
    assert refused.value.quantity == quantity


def test_dots_that_stand_anywhere_are_no_grid():
    rng = np.random.default_rng(3)
    shown = LIGHT.copy()
    for column in range(-5, 6):
        for row in range(-4, 5):
            at_mm = 2.0 * np.array([column, row]) + rng.uniform(-0.55, 0.55, 2) * ((column, row) != (0, 0))
            radius_mm = 0.6 if (column, row) == (0, 0) else 0.4
            shown[np.hypot(X_MM - at_mm[0], Y_MM - at_mm[1]) < radius_mm] *= 0.3
    with pytest.raises(InvalidQuantity, match="dots on one square grid|distance of the grid's dots"):
        seen_grid(drawn(GridTarget(), press=shown), 2.0)
