"""Networks that tell the ranges of commissioned probes: what they learn from, where they go, and who asks them."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest

from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.bundle import BundleRefused
from device.measurement.parameters import normalise
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.estimate import stands_out
from device.measurement.ramp_modes.radial_profile import CONTRAST, FIRST
from device.measurement.ramp_modes.range_classifier import OWN_ENTRY, OWN_RANGE_FILE
from host_tools.commissioning import own_range as own_range_module
from host_tools.commissioning.believed_presses import believed_presses
from host_tools.commissioning.commission import limits
from host_tools.commissioning.joint_fit import Design
from host_tools.commissioning.left_out import log_odds_of
from host_tools.commissioning.own_range import noticed_outside, publish_own_range, tolerant_press_set, train_own_range
from host_tools.press_models.press_derivatives import load_derivatives
from host_tools.press_models.train_range import RangeBudget, is_outside
from host_tools.probe_tables.out_of_range_table import ASIDE_POINTS, POINTS, WideTable
from host_tools.scores.scored_presses import tolerant


@pytest.fixture(scope="module")
def model():
    return read_ramp_model(MODELS / "standard")


@pytest.fixture(scope="module")
def answers(model):
    return tolerant(Design(model.answers, load_derivatives(SIMULATED_PROBE)))


class AtTheNearestInside:
    """Stands in for polynomials around the ranges: rows of the nearest inclusion inside."""

    def __init__(self, answers: OwnAnswers) -> None:
        self._surrogate = answers.surrogate

    def rows(self, parameters, direction_rad):
        return self._surrogate.rows(np.clip(normalise(parameters), -1, 1), direction_rad)


def test_presses_are_each_of_another_probe_and_hand_whoever_draws_them(answers):
    one, again = (tolerant_press_set(AtTheNearestInside(answers), answers, 600, 3, jobs) for jobs in (1, 2))
    assert np.array_equal(one.rows, again.rows)
    assert 0.4 < is_outside(one.normalised).mean() < 0.95
    plain = answers.surrogate.rows(np.clip(one.normalised.astype(float), -1, 1), one.direction_rad)
    moved = one.rows - plain
    assert np.abs(moved[:, CONTRAST]).max() > 0.01
    bright = np.abs(plain[:, FIRST]).mean(), np.abs(one.rows[:, FIRST]).mean()
    assert bright[1] > bright[0]  # a tilt has a bright side where an inclusion has none


def test_of_a_commissioned_probe_other_networks_are_asked_than_of_the_designs_own(model, answers):
    rows = np.concatenate([one.rows for one in believed_presses(answers, 300, 5)[0]])
    own, design = log_odds_of(answers, model), log_odds_of(model.answers, model)
    assert np.array_equal(design(rows), model.ranges.log_odds(rows))
    shown = rows[[stands_out(row, answers.noise) for row in rows]]
    # Presses inside, of which the design's networks take many for outside: the limit is where those end.
    assert np.quantile(own(shown), 0.98) < 2.5 < np.quantile(design(shown), 0.98)


def test_the_limit_of_a_probe_by_tolerances_is_near_the_designs(model, answers):
    assert limits(answers, model, 1)["standard"].outside_log_odds < model.critical["standard"].outside_log_odds + 1.0


def test_without_them_a_bundle_of_the_design_commissions_nothing(answers, tmp_path):
    shutil.copytree(MODELS / "standard", tmp_path / "standard")
    (tmp_path / "standard" / OWN_RANGE_FILE).unlink()
    with pytest.raises(BundleRefused, match=f"{OWN_RANGE_FILE} is missing"):
        log_odds_of(answers, read_ramp_model(tmp_path / "standard"))


@pytest.mark.long  # a minute: presses, and networks of few
def test_tables_become_networks_in_the_bundle_that_the_design_has(model, answers, tables, tmp_path, monkeypatch):
    """Fields around the ranges stand in: those of the nearest inclusion inside, so that next to nothing is noticed."""
    centred, aside = tables.centred.lump_per_n_mm3.shape[-2:], tables.off_axis.lump_per_n_mm3.shape[-2:]
    wide = WideTable(np.zeros((2, *POINTS, *centred)), np.zeros((2, *ASIDE_POINTS, *aside)))
    monkeypatch.setattr(own_range_module, "JUDGED", 500)
    budget = RangeBudget(600, 40, 1_000, 1, 200, 0.42)
    found = train_own_range(tables, wide, answers, model.ranges, budget=budget, jobs=1)
    assert 0.0 <= found.noticed <= 1.0
    shutil.copytree(MODELS / "standard", tmp_path / "standard")
    before = json.loads((tmp_path / "standard/model.json").read_text())
    publish_own_range(tmp_path / "standard", found.trained, "host_tools train --mode commissioned")
    again = read_ramp_model(tmp_path / "standard")
    assert {name: part for name, part in again.bundle.card.items() if name != OWN_ENTRY} == {
        name: part for name, part in before.items() if name != OWN_ENTRY
    }
    assert again.bundle.card[OWN_ENTRY]["effort"]["pool"] == 1_000
    rows = np.concatenate([one.rows for one in believed_presses(answers, 20, 5)[0]])
    assert not np.array_equal(log_odds_of(answers, again)(rows), log_odds_of(answers, model)(rows))


def test_what_is_noticed_is_counted_at_the_limit_of_those_inside(answers):
    presses = tolerant_press_set(AtTheNearestInside(answers), answers, 600, 3, 1)
    assert noticed_outside(lambda rows: np.zeros(len(rows)), presses, answers, 1) == 0.0
    by_chance = noticed_outside(lambda rows: rows[:, -1] * 1e6 % 1.0, presses, answers, 1)
    assert by_chance < 0.1
