"""Which presses are judged, how the shares are counted, and that each press is of its own inclusion."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, Quantity
from device.measurement.ramp_modes.noise import ErrorLevels
from host_tools.press_models.recorded_presses import recorded_press
from host_tools.scores import ellipsoids
from host_tools.scores.ellipsoids import ELLIPSOIDS, SKINS, _benchmark, draw_oblong, most_flagged, oblong_chapter, skins
from host_tools.scores.outside import FALSE_AT_MOST

PRESSES = SKINS * ELLIPSOIDS


def test_only_presses_that_a_test_could_tell_are_judged():
    """Of forty far from round two are answered; nearer ones do not count."""
    apart = np.where(np.arange(PRESSES) < 40, 6.0, 2.0)
    refused = apart > 2
    refused[[3, 7]] = False
    benchmark = _benchmark(apart, refused)
    assert benchmark.measured == pytest.approx(38 / 40)
    assert benchmark.passed
    assert "(40 presses)" in benchmark.case
    refused[11] = False
    assert not _benchmark(apart, refused).passed
    assert not _benchmark(np.full(len(apart), 2.0), refused).passed  # none is left to be judged


def test_four_deviations_are_what_a_test_tells_nearly_always():
    assert most_flagged(3.8, FALSE_AT_MOST) < 0.95 < most_flagged(4.1, FALSE_AT_MOST)


def made_presses():
    inclusions = draw_oblong(ELLIPSOIDS, np.random.default_rng(2))
    return inclusions, skins(inclusions, np.random.default_rng(3))


def test_presses_of_an_inclusion_are_on_skins_of_their_own_and_at_its_own_place():
    inclusions, parameters = made_presses()
    assert len(parameters) == PRESSES
    np.testing.assert_array_equal(parameters[SKINS, :3], inclusions[1].inclusion.as_tuple())
    assert (parameters[SKINS : 2 * SKINS, -1] == inclusions[1].offset_mm).all()
    assert len(np.unique(parameters[:SKINS, 3])) == SKINS


def test_each_press_turns_its_inclusion_to_another_side(tables, monkeypatch):
    sides = []

    def recorded(inclusion, tables, *, seed, protocol, **_):
        sides.append(np.arctan2(protocol.place.y_mm, protocol.place.x_mm))
        raise StopIteration

    monkeypatch.setattr("host_tools.press_models.recorded_presses.phantom_recording", recorded)
    for number, one in enumerate(made_presses()[1][:8]):
        with pytest.raises(StopIteration):
            recorded_press(tables, one, "standard", number, levels=ErrorLevels())
    assert np.ptp(sides) > np.pi / 2


def test_the_chapter_counts_what_each_mode_refuses(monkeypatch, tables):
    """Everything is refused in standard, nothing in quick; solves and recordings are words."""
    monkeypatch.setattr(ellipsoids, "in_parallel", lambda work, count, jobs: [work(i) for i in range(count)])
    monkeypatch.setattr(ellipsoids.Oblong, "on", lambda inclusion, tables: inclusion)
    monkeypatch.setattr(ellipsoids, "recorded_press", lambda inclusion, *_, **__: inclusion)
    monkeypatch.setattr(ellipsoids, "round_deviations", lambda *_: 10.0)
    value = Quantity(10.0, 9.0, 11.0, 1.0, True)
    answered = Estimate(value, value, value, "ok", "", "standard", "m", "0", "c", True, {})

    def answer(inclusion, mode):
        return replace(answered, size_mm=UNKNOWN_QUANTITY) if mode == "standard" else answered

    chapter = oblong_chapter(answer, None, tables)
    assert [(one.measured, one.passed) for one in chapter.benchmarks] == [(1.0, True)]
    shares, each = chapter.tables
    assert shares.rows == (("standard", "100.0%", "100.0%"), ("quick", "0.0%", "-"))
    assert len(each.rows) == ELLIPSOIDS
    assert each.rows[0][-3:] == ("10.0", "100%", "100%")
