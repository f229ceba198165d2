"""What frames tell about the light: levels that can be computed by hand."""

import numpy as np
import pytest

from device.errors import AmbientLightError, DarkSideError, NoContrastError, StuckLightError
from device.instrument.acquisition.light_check import (
    DimmingWatch,
    growth_ratio,
    require_contrast,
    require_dark,
    require_every_side,
)
from device.measurement.recording.tactile_image import Frame

X = np.linspace(-1, 1, 64)[None, :] * np.ones((48, 1))
Y = np.linspace(-1, 1, 48)[:, None] * np.ones((1, 64))
LEVELS = (50.0, 47.0, 50.0, 47.0)


def frame(counts, force_n=0.5):
    return Frame(np.rint(np.broadcast_to(counts, (48, 64))).astype(np.uint8), "reference", 0.0, force_n, (0.0,) * 4)


def test_a_frame_up_to_the_limit_is_dark():
    require_dark(frame(12), 12.0)


@pytest.mark.parametrize(("side", "towards"), [("+x", X), ("-x", -X), ("+y", Y), ("-y", -Y)])
def test_light_from_one_side_is_a_side_that_cannot_be_switched_off(side, towards):
    with pytest.raises(StuckLightError, match=f"brighter at \\{side}: that side") as fault:
        require_dark(frame(30 + 20 * towards), 12.0)
    assert fault.value.code == "E204"


def test_light_from_everywhere_is_foreign_light():
    with pytest.raises(AmbientLightError, match="has 30 counts, above 12, everywhere") as fault:
        require_dark(frame(30), 12.0)
    assert fault.value.code == "E205"


def test_sides_down_to_the_least_ratio_are_lit():
    require_every_side((50.0, 15.0, 50.0, 50.0), 0.3)


@pytest.mark.parametrize(
    ("levels", "names"),
    [
        ((50.0, 14.9, 50.0, 50.0), r"No light from \+y although"),
        ((50.0, 0.0, 50.0, -0.1), r"No light from \+y and -y although"),
        ((1.9, 1.9, 1.9, 1.9), r"No light from \+x and \+y and -x and -y although"),
    ],
)
def test_a_side_without_light_is_named_with_what_was_measured(levels, names):
    with pytest.raises(DarkSideError, match=names) as fault:
        require_every_side(levels, 0.3)
    assert fault.value.code == "E203"
    assert f"+x {levels[0]:.1f}" in fault.value.cause


def dimmed(ratio, sides=(0, 1, 2, 3)):
    return tuple(level * ratio if side in sides else level for side, level in enumerate(LEVELS))


def test_a_light_that_lost_a_tenth_since_the_first_presses_is_warned_of_side_by_side():
    watch = DimmingWatch(0.07, None)
    assert watch.warning(LEVELS) is None
    assert watch.warning(dimmed(0.94)) is None
    warning = DimmingWatch.warning(watch, dimmed(0.85, sides=(2,)))
    assert (warning.code, warning.severity) == ("E206", "warning")
    assert "dimmer than it was: -x 12%, above 7%" in warning.cause  # 0.85 of the mean of 1 and 0.94


def test_a_dimmed_press_does_not_become_what_is_expected():
    watch = DimmingWatch(0.07, None)
    watch.warning(LEVELS)
    assert [watch.warning(dimmed(0.9)) is None for _ in range(5)] == [False] * 5


def test_commissioned_levels_hold_from_the_first_press_on():
    watch = DimmingWatch(0.07, LEVELS)
    assert watch.warning(dimmed(0.9)).code == "E206"
    assert watch.warning(dimmed(1.1)) is None


def test_the_growth_of_a_hold_is_a_power_of_the_force():
    """Frames at one force do not tell the power; without them it is 0.65."""
    assert growth_ratio([frame(110, 0.5)] * 10, 10.0, 0.6, 0.5) == pytest.approx((0.5 / 0.6) ** 0.65, rel=1e-5)


def test_the_growth_of_a_ramp_is_that_of_its_own_frames():
    """100 f + 200 f^2 counts above dark: 100 at 0.5 N, 132 at 0.6 N."""
    forces = np.linspace(0.1, 0.6, 11)
    ramp = [frame(10 + 100 * force + 200 * force**2, force) for force in forces]
    assert growth_ratio(ramp, 10.0, 0.6, 0.5) == pytest.approx(100 / 132, abs=0.005)  # counts are whole numbers


def test_without_light_there_is_no_growth():
    assert growth_ratio([frame(11, 0.1), frame(10, 0.5)] * 5, 10.0, 0.6, 0.5) == 1.0


def test_light_in_proportion_to_the_force_is_all_contrast():
    """10 counts of dark; 20 at 0.1 N and 60 at 0.6 N: each newton brings 80, 0.6 N bring 48 of 50 counts."""
    with pytest.raises(NoContrastError, match="96% of its light, below 97%"):
        require_contrast(frame(20, 0.1), [frame(60, 0.6)], 10.0, 0.97)
    require_contrast(frame(20, 0.1), [frame(60, 0.6)], 10.0, 0.95)


def test_light_that_is_there_at_the_first_touch_is_no_contrast():
    with pytest.raises(NoContrastError, match="2% of its light, below 20%") as end:
        require_contrast(frame(60, 0.06), [frame(61, 0.5)] * 3, 10.0, 0.2)
    assert end.value.code == "E501"


def test_a_press_without_any_light_is_not_judged_by_its_contrast():
    require_contrast(frame(10, 0.1), [frame(11, 0.5)], 10.0, 0.2)
