"""Mode quick on probes of random tolerances: what is counted, and that a probe's own training answers its presses."""

import numpy as np
import pytest
from told_answers import told_presses

from device.files.bundle_file import read_quick_model, read_ramp_model
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.recording.ring_means import RINGS
from host_tools.press_models.press_derivatives import load_derivatives
from host_tools.press_models.quick_training import QuickBudget
from host_tools.scenes.phantom_set import BLOCKS_NEEDED, read_phantoms
from host_tools.scores.foreign_presses import probe_part
from host_tools.scores.foreign_probes import foreign_world
from host_tools.scores.one_thing import held_presses
from host_tools.scores.one_thing.held_presses import _benchmarks, _tables, foreign_holds, held_presses_chapter
from host_tools.scores.one_thing.press_answers import COMMISSIONED, SHIPPED, DesignToTry
from host_tools.scores.scored_presses import tolerant


@pytest.fixture(scope="module")
def design(tables):
    ramps, quick = read_ramp_model(MODELS / "standard"), read_quick_model(MODELS / "quick")
    return DesignToTry(ramps, quick, load_derivatives(SIMULATED_PROBE), tables)


def test_what_is_answered_must_be_covered_and_what_is_refused_need_not():
    one = {SHIPPED: told_presses(1, refused=9), COMMISSIONED: told_presses(8, wrong=2, refused=10)}
    judged = {(bench.case, bench.quantity): bench for bench in _benchmarks([one, one])}
    assert [bench.passed for bench in judged.values()] == [False, True]
    refused = {SHIPPED: told_presses(1), COMMISSIONED: told_presses(0, refused=9)}
    assert not list(_benchmarks([refused]))
    hard, _, of_each = _tables([one, one])
    assert [row[:3] for row in hard.rows] == [(SHIPPED, "20", "2"), (COMMISSIONED, "40", "20")]
    assert [row[0] for row in of_each.rows] == ["1", "2"]


def test_a_press_has_a_patient_a_hand_and_noise_of_its_own_and_comes_again(design):
    probe, camera = probe_part(foreign_world(1, 3)), 1e-6 * np.eye(RINGS)
    first, again = (foreign_holds(design, probe, camera, 3, 7) for _ in range(2))
    rows = [np.array([one.row for one in holds.held]) for holds in (first, again)]
    np.testing.assert_array_equal(*rows)
    assert len(np.unique(rows[0][:, 0])) == 3
    noisier = foreign_holds(design, probe, 1e4 * camera, 3, 7)
    assert np.abs(noisier.held[0].row - rows[0][0]).max() > 0.02


@pytest.mark.long
@pytest.mark.study
def test_a_probe_becomes_a_row(design, monkeypatch):
    monkeypatch.setattr(held_presses, "own_answers", lambda design, *_: tolerant(design.shared))
    monkeypatch.setattr(held_presses, "CAMERA", 24)
    phantoms = read_phantoms(SIMULATED_PROBE / "phantoms.toml", blocks_needed=BLOCKS_NEEDED)
    budget = QuickBudget(recordings=24, trained_on=1_000, members=2, steps=300, belts_of=1_600, evaluated=1_600)
    chapter = held_presses_chapter(design, phantoms, probes=1, presses=24, budget=budget, jobs=1)
    assert chapter.facts | {"false_alarms": 0} == {"probes": 1, "presses": 24, "false_alarms": 0}
    assert chapter.facts["false_alarms"] <= 2
    assert [row[0] for row in chapter.tables[0].rows] == [SHIPPED, COMMISSIONED]
    known = {f"{name} covered, determined (at least)" for name in ("size_mm", "depth_mm")}
    known |= {"presses without an inclusion that have numbers"}
    assert {one.quantity for one in chapter.benchmarks} <= known
    assert chapter.benchmarks
