"""Ellipsoids and what any test could tell: a round one is its own nearest, a stretched spot lies as far as it is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_surrogate import LinearRows, white_noise

from device.files.bundle_file import read_ramp_model
from device.measurement.parameters import HIGH, LOW, PARAMETERS, normalise
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.ellipticity import stretched
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.radial_profile import COLUMNS, CONTRAST, SECOND
from device.measurement.ramp_modes.surrogate import OFFSET
from device.measurement.recording.ring_means import RINGS
from host_tools.press_models.press_samples import profile_rows
from host_tools.scores import ellipsoids
from host_tools.scores.ellipsoids import (
    WIDTH_RATIO,
    Oblong,
    draw_oblong,
    most_flagged,
    nearest_round,
    round_deviations,
    spoken,
)
from host_tools.scores.just_outside import at_nominal

INCLUSION = Oblong(Inclusion(8.0, 5.0, 80.0), 2.0, 1.5, is_across=True)


@pytest.fixture(scope="module")
def answers():
    return read_ramp_model(Path(__file__).parents[3] / "models" / "standard").answers


def test_the_long_axis_lies_along_the_offset_or_across_it():
    along = replace(INCLUSION, is_across=False)
    for inclusion, x, y in ((INCLUSION, 1.0, 2.0), (along, 2.0, 1.0)):
        place = inclusion.scene().placement
        assert (place.offset_x_mm, place.offset_y_mm) == (1.5, 0.0)
        assert (place.width_ratio_x, place.width_ratio_y) == (x, y)
    assert list(spoken(INCLUSION))[3:] == ["2.00", "1.5", "across"]


def test_inclusions_are_drawn_inside_the_trained_ranges():
    inclusions = draw_oblong(200, np.random.default_rng(1))
    values = np.array([oblong.inclusion.as_tuple() for oblong in inclusions])
    assert ((LOW[:3] <= values) & (values <= HIGH[:3])).all()
    ratios, offsets_mm = (np.array([getattr(one, name) for one in inclusions]) for name in ("width_ratio", "offset_mm"))
    assert (WIDTH_RATIO[0] <= ratios).all()
    assert (ratios <= WIDTH_RATIO[1]).all()
    assert offsets_mm.max() <= HIGH[OFFSET]
    assert np.mean(offsets_mm < HIGH[OFFSET] / 2) == pytest.approx(0.25, abs=0.08)  # even over the disk
    assert 60 < sum(oblong.is_across for oblong in inclusions) < 140


def test_tables_of_an_ellipsoid_hold_it_off_the_axis_and_are_the_probes_own_otherwise(tables, monkeypatch):
    asked = []
    monkeypatch.setattr(ellipsoids, "stretched_inclusion", lambda scene, table: asked.append((scene, table)) or table)
    found = INCLUSION.on(tables)
    assert found.centred is tables.centred
    assert asked == [(INCLUSION.scene(), tables.off_axis)]


@pytest.mark.parametrize("offset_mm", [0.0, 1.5, 2.0])
def test_a_round_inclusion_is_its_own_nearest_beside_the_axis_too(tables, answers, offset_mm):
    """The tables' own inclusion in place of an ellipsoid: what is left is the polynomials' error."""
    assert round_deviations(tables, press_at(offset_mm), answers) < 1.5


def press_at(offset_mm):
    parameters = at_nominal(Inclusion(9.0, 5.0, 60.0))
    parameters[-1] = offset_mm
    return parameters


def distance(tables, answers, offset_mm, along):
    """Return how far a press lies from round, a pattern added along its offset; and the length of the pattern."""
    (row,) = profile_rows(tables, press_at(offset_mm)[None])
    pattern = np.zeros(COLUMNS)
    pattern[SECOND] = along * 0.1 * stretched(row[CONTRAST].reshape(-1, RINGS))
    row += pattern
    length = np.linalg.norm(np.linalg.solve(np.linalg.cholesky(answers.noise.covariance(row)), pattern))
    posterior = PressPosterior(row, answers.surrogate, answers.noise, direction_rad=np.zeros(1))
    return nearest_round(posterior, normalise(press_at(offset_mm)[None])[0])[1], float(length)


def test_a_stretched_spot_on_the_axis_lies_as_far_from_round_as_its_stretch(tables, answers):
    """0.1 of r df/dr: no round inclusion there has a second harmonic, but for what the polynomials miss."""
    unstretched, _ = distance(tables, answers, 0.0, along=0.0)
    found, length = distance(tables, answers, 0.0, along=1.0)
    assert found > 2 * unstretched
    assert abs(found - length) < unstretched  # the triangle's inequality


def test_a_stretched_spot_beside_it_has_a_round_inclusion_nearer_than_its_stretch(tables, answers):
    """Another place, depth or skin makes a part of it; on the axis a thousandth, here some 3 %."""
    found, length = distance(tables, answers, 1.5, along=1.0)
    assert 0.5 * length < found < 0.98 * length


def test_the_nearest_round_inclusion_of_a_linear_press_is_that_of_linear_algebra():
    """What no coordinate explains of a row is what is left of it."""
    slopes = np.random.default_rng(5).normal(0.0, 0.01, (len(PARAMETERS), COLUMNS))
    truth, added = np.full(len(PARAMETERS), 0.1), np.random.default_rng(6).normal(0.0, 0.01, COLUMNS)
    added[CONTRAST] = 0.0
    row = truth @ slopes + added
    posterior = PressPosterior(row, LinearRows(slopes), white_noise(0.05))
    best, found = nearest_round(posterior, truth)
    design = posterior.residuals_and_jacobian(truth[None])[1][0]
    left = posterior.residuals(truth)
    moved = -np.linalg.lstsq(design, left, rcond=None)[0]
    np.testing.assert_allclose(best, truth + moved, atol=1e-4)
    assert found == pytest.approx(np.linalg.norm(left + design @ moved), rel=1e-5)


@pytest.mark.parametrize("false_flags", [0.0125, 0.05])
def test_a_test_flags_as_many_as_the_length_of_two_gaussians_passes_what_is_usual(false_flags):
    """The length of two of deviation one is Rayleigh's; one of them shifted by four, by drawing them."""
    limit = np.sqrt(-2 * np.log(false_flags))
    drawn = np.random.default_rng(2).normal(0, 1, (2, 200_000))
    assert np.mean(np.hypot(*drawn) > limit) == pytest.approx(false_flags, rel=0.05)
    found = most_flagged(np.array([0.0, 4.0]), false_flags)
    assert found[0] == pytest.approx(false_flags)
    assert found[1] == pytest.approx(np.mean(np.hypot(drawn[0] + 4.0, drawn[1]) > limit), abs=0.003)
