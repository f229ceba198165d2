"""Ellipsoids and what any test could tell: a round lump is its own twin, a stretched spot lies as far as it is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from device.measurement.fit_press import PressPosterior
from device.measurement.press_parameters import HIGH, LOW
from device.measurement.press_surrogate import CONTRAST_COLUMNS, OFFSET
from device.measurement.profile_model import ProfileModel
from device.measurement.quantities import Inclusion
from device.measurement.ring_means import RINGS
from device.measurement.round_spot import stretched
from host_tools.inverse.press_samples import exact_presses
from host_tools.study import oblong_lumps
from host_tools.study.just_outside import at_nominal
from host_tools.study.oblong_lumps import WIDTH_RATIO, Oblong, draw_oblong, nearest_round_twin, spoken, twin_of

LUMP = Oblong(Inclusion(8.0, 5.0, 80.0), 2.0, 1.5, is_across=True)


@pytest.fixture(scope="module")
def model():
    return ProfileModel.load(Path(__file__).parents[3] / "models" / "standard")


def test_the_long_axis_lies_along_the_offset_or_across_it():
    along = replace(LUMP, is_across=False)
    for lump, x, y in ((LUMP, 1.0, 2.0), (along, 2.0, 1.0)):
        place = lump.scene().placement
        assert (place.offset_x_mm, place.offset_y_mm) == (1.5, 0.0)
        assert (place.width_ratio_x, place.width_ratio_y) == (x, y)
    assert list(spoken(LUMP))[3:] == ["2.00", "1.5", "across"]


def test_lumps_are_drawn_inside_the_trained_ranges_and_spheres_come_last():
    lumps = draw_oblong(200, 20, np.random.default_rng(1))
    values = np.array([lump.inclusion.as_tuple() for lump in lumps])
    assert ((LOW[:3] <= values) & (values <= HIGH[:3])).all()
    ratios, offsets_mm = (np.array([getattr(one, name) for one in lumps]) for name in ("width_ratio", "offset_mm"))
    assert (ratios[200:] == 1.0).all()
    assert (WIDTH_RATIO[0] <= ratios[:200]).all()
    assert (ratios[:200] <= WIDTH_RATIO[1]).all()
    assert offsets_mm.max() <= HIGH[OFFSET]
    assert np.mean(offsets_mm < HIGH[OFFSET] / 2) == pytest.approx(0.25, abs=0.08)  # even over the disk
    assert 60 < sum(lump.is_across for lump in lumps) < 160


def test_tables_of_an_ellipsoid_hold_it_off_the_axis_and_are_the_probes_own_otherwise(tables, monkeypatch):
    asked = []
    monkeypatch.setattr(oblong_lumps, "solved_lump", lambda scene, table: asked.append((scene, table)) or table)
    found = LUMP.on(tables)
    assert found.centred is tables.centred
    assert asked == [(LUMP.scene(), tables.off_axis)]


def test_a_round_lump_is_its_own_twin_and_is_flagged_as_seldom_as_any(tables, model):
    """The tables' own lump under the middle, in place of a solved one: what is left is the polynomials' error."""
    sphere = Oblong(Inclusion(9.0, 5.0, 60.0), 1.0, 0.0, is_across=False)
    twin = nearest_round_twin(sphere, tables, model, "standard", seed=0)
    assert twin.deviations < 1.5
    assert (twin.inclusion.size_mm, twin.inclusion.depth_mm) == pytest.approx((9.0, 5.0), rel=0.02)


def test_a_stretched_spot_lies_as_far_from_round_as_its_stretch_weighs(tables, model):
    """On the axis no round lump has a second harmonic: the distance is that of the stretch alone, 0.1 of r df/dr."""
    rows, second = exact_presses(tables, at_nominal(Inclusion(9.0, 5.0, 60.0))[None])
    posterior = PressPosterior(rows[0], model.answers.surrogate, model.answers.noise["standard"])
    pattern = 0.1 * stretched(rows[0, :CONTRAST_COLUMNS].reshape(-1, RINGS))
    across = np.stack([np.zeros_like(second[0]), pattern])
    (best, round_deviations), (_, found) = (
        twin_of(posterior, harmonics, model, "standard", seed=0)
        for harmonics in (np.stack([second[0], np.zeros_like(second[0])]), across)
    )
    weight = np.linalg.solve(model.round_spot.covariance(best, "standard"), pattern)
    assert found > 4
    assert found == pytest.approx(np.hypot(round_deviations, np.sqrt(weight @ pattern)), rel=0.03)
