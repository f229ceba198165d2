"""Ellipsoids and what any test could tell: a round one is its own nearest, a stretched spot lies as far as it is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from device.files.bundle_file import read_ramp_model
from device.measurement.parameters import HIGH, LOW, normalise
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.ellipticity import stretched
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, OFFSET
from device.measurement.recording.ring_means import RINGS
from host_tools.press_models.press_samples import exact_presses
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
def model():
    return read_ramp_model(Path(__file__).parents[3] / "models" / "standard")


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
def test_a_round_inclusion_is_its_own_nearest_beside_the_axis_too(tables, model, offset_mm):
    """The tables' own inclusion in place of an ellipsoid: what is left is the polynomials' error."""
    assert round_deviations(tables, press_at(offset_mm), model, "standard") < 1.5


def press_at(offset_mm):
    parameters = at_nominal(Inclusion(9.0, 5.0, 60.0))
    parameters[-1] = offset_mm
    return parameters


def distance(tables, model, offset_mm, along, across):
    """Return how far a press lies from round, a pattern added along and across; and the length of the pattern."""
    rows, second = exact_presses(tables, press_at(offset_mm)[None])
    posterior = PressPosterior(rows[0], model.answers.surrogate, model.answers.noise["standard"])
    pattern = 0.1 * stretched(rows[0, :CONTRAST_COLUMNS].reshape(-1, RINGS))
    harmonics = np.stack([second[0] + along * pattern, across * pattern])
    best, found = nearest_round(posterior, harmonics, normalise(press_at(offset_mm)[None])[0], model, "standard")
    weight = np.linalg.solve(model.ellipticity.covariance(best, "standard"), pattern)
    return found, float(np.sqrt(weight @ pattern))


def test_a_spot_stretched_across_the_offset_lies_as_far_from_round_as_its_stretch_weighs(tables, model):
    """No round inclusion has a second harmonic there: 0.1 of r df/dr, with what the polynomials miss."""
    round_deviations, _ = distance(tables, model, 0.0, along=0.0, across=0.0)
    found, length = distance(tables, model, 0.0, along=0.0, across=1.0)
    assert found > 4
    assert found == pytest.approx(np.hypot(round_deviations, length), rel=0.03)


def test_a_spot_stretched_along_the_offset_has_a_round_inclusion_nearer_than_its_stretch(tables, model):
    """Another place, depth or skin makes a part of it."""
    found, length = distance(tables, model, 1.5, along=1.0, across=0.0)
    assert 0.5 * length < found < 0.97 * length


@pytest.mark.parametrize("false_flags", [0.0125, 0.05])
def test_a_test_flags_as_many_as_the_length_of_two_gaussians_passes_what_is_usual(false_flags):
    """The length of two of deviation one is Rayleigh's; one of them shifted by four, by drawing them."""
    limit = np.sqrt(-2 * np.log(false_flags))
    drawn = np.random.default_rng(2).normal(0, 1, (2, 200_000))
    assert np.mean(np.hypot(*drawn) > limit) == pytest.approx(false_flags, rel=0.05)
    found = most_flagged(np.array([0.0, 4.0]), false_flags)
    assert found[0] == pytest.approx(false_flags)
    assert found[1] == pytest.approx(np.mean(np.hypot(drawn[0] + 4.0, drawn[1]) > limit), abs=0.003)
