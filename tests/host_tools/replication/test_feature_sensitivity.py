"""What disturbs a recording, and the page of sensitivities: every figure on it is of the run that it is given."""

from itertools import pairwise

import numpy as np
import pytest

from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.radial_profile import ROW_NAMES, press_profile
from host_tools.replication.feature_page import page
from host_tools.replication.feature_reading import GROWTH, SHOWN
from host_tools.replication.feature_sensitivity import (
    DISTURBANCES,
    DRIFT_RATIO,
    SCENES,
    ZERO_N,
    Phantoms,
    Sensitivity,
    drifted,
    press_features,
    zeroed,
)


@pytest.fixture(scope="module")
def phantoms(tables):
    return Phantoms(SCENES[0], tables)


@pytest.fixture(scope="module")
def ramp(phantoms):
    return phantoms.record(0)


@pytest.fixture(scope="module")
def features(ramp):
    return press_features(ramp)


def test_a_drift_of_the_leds_adds_itself_to_one_and_the_contrast(ramp):
    """(1 + d) (1 + c) - 1 = c + d (1 + c), but for the pixels' own darks, which are not told apart."""
    before, after = press_profile(ramp), press_profile(drifted(ramp))
    np.testing.assert_allclose(after.contrast - before.contrast, DRIFT_RATIO * (1 + before.contrast), atol=1e-4)
    np.testing.assert_allclose(after.growth, before.growth, atol=1e-6)


def test_a_zero_error_moves_the_forces_of_its_roles_only(ramp):
    moved = zeroed(ramp, ("press",))
    for before, after in zip(ramp.frames, moved.frames, strict=True):
        assert after.force_n - before.force_n == pytest.approx(ZERO_N if before.role == "press" else 0.0)


def test_every_feature_of_the_page_is_a_number_of_a_press(features):
    assert set(SHOWN) <= set(features)
    assert set(ROW_NAMES) <= set(features)
    assert all(np.isfinite(value) for value in features.values())


@pytest.mark.parametrize("unknown", UNKNOWNS)
def test_a_step_to_the_side_stays_in_the_papers_box(tables, unknown):
    shallow = Phantoms(SCENES[1], tables)
    low, high = (getattr(shallow.beside(unknown, ratio), unknown) for ratio in (0.95, 1.05))
    value = getattr(shallow.scene, unknown)
    assert high == pytest.approx(1.05 * value)
    assert low == pytest.approx(value if unknown == "depth_mm" else 0.95 * value)


def made_up(features):
    """Return a scene whose scatter is 1 % of each feature and whose changes are 2 %; slopes 3, -2 and 0.3."""
    part = {name: abs(value) for name, value in features.items()}
    return Sensitivity(
        SCENES[0],
        value=features,
        scatter={name: 0.01 * value for name, value in part.items()},
        changes={name: {n: 0.02 * value for n, value in part.items()} for name in DISTURBANCES},
        slopes={
            unknown: {n: 0.0 if n in GROWTH else slope * value for n, value in features.items()}
            for unknown, slope in zip(UNKNOWNS, (3.0, -2.0, 0.3), strict=True)
        },
    )


def test_a_sensitivity_counts_in_scatters(features):
    one = made_up(features)
    assert one.moved("size_mm", "peak_contrast_0.40_n") == pytest.approx(30.0)
    assert one.disturbed(next(iter(DISTURBANCES)), "peak_contrast_0.40_n") == pytest.approx(2.0)
    assert not one.is_zero("peak_contrast_0.40_n")


def test_the_page_defines_and_shows_every_feature_with_the_figures_it_is_given(features):
    lines = page([made_up(features)], command="host_tools features").splitlines()
    peak = features["peak_contrast_0.40_n"]
    assert f"| `peak_contrast_0.40_n` | 1 | {peak:.4g} | 1 % | +3.00 | -2.00 | +0.30 |" in lines
    assert f"| `peak_contrast_0.40_n` |{' +2 % (2.0) |' * len(DISTURBANCES)}" in lines
    for name in SHOWN:
        assert sum(line.startswith(f"| `{name}` |") for line in lines) >= 2, name
    assert any("1 % more size or 1.5 % less depth" in line for line in lines)


def test_the_page_is_a_table_of_equal_rows(features):
    """Every row of a table has as many cells as the header above it."""
    for above, line in pairwise(page([made_up(features)], command="host_tools features").splitlines()):
        if above.startswith("|") and line.startswith("|"):
            assert above.count("|") == line.count("|"), line
