"""Which ellipsoids are judged, how the shares are counted, and that each press is of its own lump."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, Quantity
from host_tools.study import mode_oblong
from host_tools.study.just_outside import Twin
from host_tools.study.mode_oblong import ELLIPSOIDS, SKINS, SPHERES, _judged, oblong_chapter, skins
from host_tools.study.oblong_lumps import draw_oblong

LUMPS = ELLIPSOIDS + SPHERES


def test_only_ellipsoids_that_a_test_could_tell_are_judged():
    """Two of three could be: one is refused always, one in nine of ten presses."""
    could, refused = np.array([0.3, 0.95, 1.0]), np.array([0.0, 1.0, 0.9, 0.5])
    benchmark = _judged("standard", could, refused)
    assert benchmark.measured == pytest.approx(0.95)
    assert benchmark.passed
    assert f"({2 * SKINS})" in benchmark.case
    assert not _judged("standard", could, refused - 0.01).passed
    assert not _judged("standard", 0.5 * could, refused).passed  # none is left to be judged


def test_presses_of_a_lump_are_on_skins_of_their_own_and_at_its_own_place():
    lumps = draw_oblong(ELLIPSOIDS, SPHERES, np.random.default_rng(2))
    parameters = skins(lumps, np.random.default_rng(3))
    assert len(parameters) == SKINS * LUMPS
    np.testing.assert_array_equal(parameters[SKINS, :3], lumps[1].inclusion.as_tuple())
    assert (parameters[:, -1] == 0).all()
    assert len(np.unique(parameters[:SKINS, 3])) == SKINS


def test_the_chapter_counts_ellipsoids_and_spheres_apart(monkeypatch, tables):
    """Ellipsoids are refused in standard, nothing in precise; solves and recordings are words."""
    monkeypatch.setattr(mode_oblong, "in_parallel", lambda work, count, jobs: [work(i) for i in range(count)])
    monkeypatch.setattr(mode_oblong.Oblong, "on", lambda lump, tables: lump)
    monkeypatch.setattr(mode_oblong, "recorded_press", lambda lump, *_, **__: lump)
    monkeypatch.setattr(mode_oblong, "nearest_round_twin", lambda lump, *_, **__: Twin(lump.inclusion, 9.0))
    value = Quantity(10.0, 9.0, 11.0, 1.0, True)
    answered = Estimate(value, value, value, "ok", "", "standard", "m", "0", "c", True, {})

    def answer(lump, mode):
        oblong = mode == "standard" and lump.width_ratio > 1
        return replace(answered, size_mm=UNKNOWN_QUANTITY) if oblong else answered

    chapter = oblong_chapter(answer, None, tables)
    assert [(one.measured, one.passed) for one in chapter.benchmarks] == [(1.0, True), (0.0, False)]
    shares, each = chapter.tables
    assert shares.rows == (
        ("standard", "100.0%", "100.0%", "0.0%"),
        ("precise", "0.0%", "100.0%", "0.0%"),
        ("quick", "0.0%", "-", "0.0%"),
    )
    assert len(each.rows) == 2 * ELLIPSOIDS
    assert each.rows[0][-3:] == ("9.0", "100%", "100%")
