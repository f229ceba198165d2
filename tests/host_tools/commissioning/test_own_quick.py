"""Mode quick of a commissioned probe: what it learns from, and a bundle of its own that answers held presses."""

from dataclasses import replace

import numpy as np
import pytest

from device.files.bundle_file import read_quick_model
from device.files.shipped import MODELS
from device.measurement.mode_models import ModeModels
from device.measurement.quick_mode.profile import QUICK_FORCES_N, quick_press
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N, press_profiles, seen_presses
from device.measurement.recording.ring_means import RINGS
from host_tools.commissioning import own_quick
from host_tools.commissioning.joint_fit import Design
from host_tools.commissioning.own_quick import (
    OwnQuick,
    believed_holds,
    has_numbers,
    stands_out,
    train_own_quick,
    with_noise,
)
from host_tools.press_models.export import export_quick
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.quick_training import QuickBudget, held_harmonics
from host_tools.press_models.recorded_presses import EXACT, recorded_press
from host_tools.scores.scored_presses import tolerant

BUDGET = QuickBudget(recordings=24, trained_on=1_000, members=2, steps=300, belts_of=1_600, evaluated=1_600)


@pytest.fixture(scope="module")
def answers(model, derivatives):
    """What answers a probe of which nothing is known but its builder's tolerances."""
    return tolerant(Design(model.answers, derivatives))


def test_presses_are_the_same_however_many_workers_draw_them(answers, monkeypatch):
    monkeypatch.setattr(own_quick, "BLOCK", 4)
    one, two = (believed_holds(answers, 10, 5, jobs) for jobs in (1, 2))
    for mine, others in zip((*one[:2], *one.harmonics), (*two[:2], *two.harmonics), strict=True):
        np.testing.assert_array_equal(mine, others)
    assert one.rows.shape == (10, RINGS + 1)
    assert len(np.unique(one.normalised[:, 0])) == 10
    low_n, high_n = QUICK_FORCES_N
    assert np.all((low_n <= one.rows[:, RINGS]) & (one.rows[:, RINGS] <= high_n))


def test_probes_that_are_less_known_show_the_same_inclusion_in_more_ways(answers):
    """Of tolerances a hundredth as wide contrast scatters by less about what the forward model says."""
    narrow = replace(answers.own, covariance=1e-4 * answers.own.covariance)
    known = type(answers)(answers.surrogate, answers.noise, narrow)
    wide, close = (believed_holds(one, 40, 6, 1) for one in (answers, known))
    np.testing.assert_array_equal(wide.normalised, close.normalised)
    rows = answers.surrogate.rows(wide.normalised, np.zeros(40))
    middle = slice(0, 1)  # directions move nothing there
    exact = own_quick.quick_rows(rows, wide.rows[:, RINGS])
    away = [np.abs(one.rows - exact)[:, middle].mean() for one in (wide, close)]
    assert away[0] > 2 * away[1]


def test_how_oblong_a_hold_looks_is_read_of_a_ramp_as_of_a_frame(tables):
    """But for the frame's outermost ring, which is cut, and for light that a ramp's reference follows otherwise."""
    parameters = draw_parameters(1, np.random.default_rng(3))[0]
    ramp = recorded_press(tables, parameters, "standard", 1, levels=EXACT)
    held = recorded_press(tables, parameters, "quick", 1, levels=EXACT)
    seen = seen_presses(press_profiles(ramp))
    assert seen.across is not None
    columns = np.hstack([seen.rows, seen.across])
    row, ratio = quick_press(held)
    assert PROFILE_FORCES_N[2] < row[RINGS] < PROFILE_FORCES_N[3]
    assert held_harmonics(columns, row[[RINGS]]).elongation_ratios()[0] == pytest.approx(ratio, abs=0.1)


@pytest.fixture(scope="module")
def made(answers, tables):
    return train_own_quick(answers, tables, read_quick_model(MODELS / "quick").bundle, budget=BUDGET, jobs=1)


@pytest.fixture(scope="module")
def own(made: OwnQuick, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bundles") / "TSIS-0007-quick"
    export_quick(
        made.trained,
        folder,
        surrogate_sha256="0" * 64,
        serials=("TSIS-0007",),
        software_version="0.1.0",
        training_command="host_tools commission",
        more={"expires_at": "2027-01-02T00:00:00Z"},
        worth={"dial": {"presses": 3}},
    )
    return read_quick_model(folder)


@pytest.mark.long
def test_its_bundle_is_of_that_probe_alone_and_ends_with_the_commissioning(own, model):
    own.prove()
    models = ModeModels(read_quick_model(MODELS / "quick").bundle, own, model)
    assert models.expires_at == "2027-01-02T00:00:00Z"
    assert models.for_probe("TSIS-0007").modes == ("quick", "paper")
    assert "quick" not in models.for_probe("TSIS-0008").modes
    assert "recorded" not in own.bundle.card["modes"]["quick"]  # only phantoms were


@pytest.mark.long
def test_intervals_allow_for_all_that_the_builders_tolerances_leave_open(made):
    """Of presses that belts have not seen as many are covered as is promised, but for chance."""
    found = made.believed.evaluated
    assert 0.3 < made.believed.is_answered.mean() < 0.9
    for unknown in range(2):
        known = found.is_known[:, unknown]
        assert known.sum() > 60
        assert found.is_covered[known, unknown].mean() > 0.8
    assert not found.is_known[:, 2].any()  # one force does not tell the modulus
    assert 1e-4 < made.believed.seconds[0] < 1.0  # from frames on, not the network alone


@pytest.mark.long
def test_round_inclusions_are_seldom_called_oblong_and_tissue_without_one_seldom_gets_numbers(made, answers):
    """One in sixty of each, as belief and noise of fresh presses have it; hands alone make contrast."""
    trained, noise = made.trained, answers.noise
    camera = trained.training_set.camera
    fresh, empty = (
        with_noise(believed_holds(answers, 800, 11, 1, are_inclusion_free=are_inclusion_free), camera, noise, 12)
        for are_inclusion_free in (False, True)
    )
    assert (fresh.elongation > trained.outcome.elongation_ratio).mean() < 0.03
    assert has_numbers(trained, empty).mean() < 0.03
    assert 0.002 < stands_out(trained, empty.rows).mean() < 0.03, "two limits leave three in two hundred of 800 at most"
