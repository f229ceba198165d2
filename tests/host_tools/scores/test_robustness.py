"""What is asked of commissioned probes: press by press beside the same probe known exactly, soft inclusions apart."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from told_answers import scored_presses, told_presses

from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.ramp_modes.commissioned.row_derivatives import DIRECTIONS, MEAN, NAMES, STD
from device.measurement.ramp_modes.radial_profile import COLUMNS, CONTRAST, FORCES
from device.measurement.ramp_modes.surrogate import OFFSET
from host_tools.commissioning.commission import limits
from host_tools.commissioning.joint_fit import FLOOR, PROBE, Design
from host_tools.press_models.press_derivatives import load_derivatives, world_changed
from host_tools.press_models.recorded_presses import EXACT
from host_tools.scores.foreign_presses import (
    STIFFEST_SKIN,
    foreign_presses,
    press_part,
    pressed_again,
    probe_part,
)
from host_tools.scores.foreign_probes import foreign_world
from host_tools.scores.robustness import (
    COMMISSIONED,
    GOALS,
    GROUPS,
    KNOWN,
    KNOWN_SCANS,
    OTHER_GOALS,
    SCANS,
    SHIPPED,
    InclusionFree,
    TriedProbe,
    _chapter,
    benchmarks,
    known_probe,
    of_group,
    pairs_of,
    true_directions,
)
from host_tools.scores.scored_presses import FIGURES, joined, scored

FIT = SimpleNamespace(levels=SimpleNamespace(model_ratio=0.003), believed=SimpleNamespace(discrepancy_ratio=0.02))


def tried(found, known, number=1, scans=None):
    shipped = replace(found, is_answered=np.zeros(len(found.number), bool))
    scores = {
        SHIPPED: shipped,
        COMMISSIONED: found,
        KNOWN: known,
        SCANS: found if scans is None else scans,
        KNOWN_SCANS: known,
    }
    return TriedProbe(number, scores, FIT, {COMMISSIONED: InclusionFree(40, 6, 1), SCANS: InclusionFree(20, 4, 0)})


def by_quantity(trials, goals=GOALS, group=GROUPS[0]):
    whole = benchmarks(group, trials, goals)
    return {one.quantity.removesuffix(" (at least)"): one for one in whole if one.case == f"{COMMISSIONED}, {group}"}


def test_errors_are_compared_on_the_presses_that_both_answer():
    truth = [(8.0, 6.0)] * 4
    found = scored_presses([(9.0, 6.0), (7.0, 7.0), (14.0, 6.0), (8.0, 6.0)], truth)
    known = scored_presses([(8.5, 6.0), (7.5, 6.5), (8.0, 6.0), (8.0, 6.0)], truth)
    known = replace(known, is_answered=np.array([True, True, False, True]))
    assert pairs_of([tried(found, known)]).rmse_ratio() == pytest.approx([2.0, 2.0])
    nothing = replace(found, is_answered=np.zeros(4, bool))
    assert np.isnan(pairs_of([tried(nothing, known)]).rmse_ratio()).all()


def test_answers_are_counted_of_what_the_known_probe_answers():
    found, known = (scored_presses([(8.0, 6.0)] * 4, [(8.0, 6.0)] * 4) for _ in range(2))
    found = replace(found, is_answered=np.array([True, False, True, True]))
    known = replace(known, is_answered=np.array([True, True, False, False]))
    pairs = pairs_of([tried(found, known)])
    assert pairs.answered_ratio() == 0.5
    found.evaluated.is_known[0, 1] = False
    assert pairs_of([tried(found, known)]).determined_ratio() == 0.0


def test_a_press_is_paired_by_its_number_within_its_own_probe():
    first, second = (scored_presses([(8.0 + off, 6.0)] * 2, [(8.0, 6.0)] * 2) for off in (1.0, 0.5))
    swapped = replace(second, number=np.array([1, 7]))
    pairs = pairs_of([tried(first, swapped), tried(second, first, number=2)])
    assert pairs.found.number.tolist() == [1, 0, 1]
    assert pairs.known.error_mm()[:, 0] == pytest.approx([0.5, 1.0, 1.0])


def test_each_bound_is_named_and_missed_by_what_misses_it():
    good, worse = told_presses(20), told_presses(14, wrong=6)
    found = by_quantity([tried(good, good), tried(worse, good, number=2)])
    assert found["size_mm covered, determined, pooled"].measured == pytest.approx(34 / 40)
    assert found["size_mm covered, determined, worst probe"].measured == pytest.approx(0.7)
    assert found["joint region of size and depth holds"].measured == pytest.approx(34 / 40)
    missed = {name for name, one in found.items() if not one.passed}
    of_size = (
        "covered, determined, pooled",
        "covered, determined, worst probe",
        "RMSE over the same probe's known exactly",
    )
    assert missed == {f"size_mm {what}" for what in of_size}


def test_scans_are_held_against_scans_of_the_known_probe():
    good, scans = told_presses(20), told_presses(6, wrong=4)
    trials = [tried(good, good, scans=scans)._replace(number=number) for number in (1, 2)]
    trials = [one._replace(scores=one.scores | {KNOWN_SCANS: told_presses(10)}) for one in trials]
    found = {one.quantity: one for one in benchmarks(GROUPS[0], trials, GOALS) if one.case == f"{SCANS}, {GROUPS[0]}"}
    assert found["size_mm covered, determined, pooled (at least)"].measured == pytest.approx(0.6)
    assert found["size_mm RMSE over the same probe's known exactly"].measured > 1
    assert found["answered, of what the probe known exactly answers (at least)"].measured == 1.0


def test_of_other_optics_neither_each_probe_nor_the_region_is_asked():
    names = set(by_quantity([tried(told_presses(5), told_presses(5))], OTHER_GOALS))
    assert not any("worst" in name or "region" in name for name in names)
    assert len(names) == 6


def test_soft_inclusions_stand_apart_in_tables_and_bounds():
    hard, soft = (scored_presses([(8.2, 6.1)] * 3, [(8.0, 6.0)] * 3, kpa=kpa) for kpa in (60.0, 12.0))
    both = replace(joined([hard, soft]), number=np.arange(6))
    assert [of_group(both, group).youngs_modulus_kpa() == pytest.approx(kpa)
            for group, kpa in zip(GROUPS, (60.0, 12.0), strict=True)] == [True, True]  # fmt: skip
    chapter = _chapter("Probes", "Claim.", "source", [tried(both, both)], both, GOALS)
    cases = [one.case for one in chapter.benchmarks]
    assert cases.count(f"commissioned, {GROUPS[0]}") == 9
    assert cases.count(f"commissioned, {GROUPS[1]}") == 7
    assert [cases.count(f"{SCANS}, {group}") for group in GROUPS] == [7, 0]
    *of_groups, free = chapter.tables
    assert [table.caption for table in of_groups] == [
        f"{what}, inclusions of {group}"
        for group in GROUPS
        for what in ("All probes together", "Each probe, commissioned")
    ]
    stand_out = 1 + FIGURES.index("stand out")
    assert {row[stand_out] for table in of_groups for row in table.rows} == {"3"}
    assert free.rows == ((COMMISSIONED, "40", "6", "1", "2.5 %"), (SCANS, "20", "4", "0", "0.0 %"))
    judged = {one.case: one.passed for one in chapter.benchmarks if "without an inclusion" in one.quantity}
    assert judged == {COMMISSIONED: False, SCANS: True}


def test_a_group_that_nobody_pressed_has_no_bound():
    hard = told_presses(4)
    chapter = _chapter("Probes", "Claim.", "source", [tried(hard, hard)], hard, GOALS)
    of_nothing = {COMMISSIONED, SCANS}
    assert {one.case for one in chapter.benchmarks} == of_nothing | {f"{name}, {GROUPS[0]}" for name in of_nothing}
    assert list(chapter.facts["groups"]) == [GROUPS[0]]
    assert chapter.facts["groups"][GROUPS[0]][KNOWN] == {"size": 1.0, "depth": 1.0, "both": 1.0, "region": 1.0}
    assert chapter.facts["refused_as_it_ships"] == 1.0


@pytest.fixture(scope="module")
def model():
    return read_ramp_model(MODELS / "standard")


@pytest.fixture(scope="module")
def design(model):
    return Design(model.answers, load_derivatives(SIMULATED_PROBE))


@pytest.mark.parametrize("place", range(len(PROBE)), ids=[NAMES[number] for number in PROBE])
def test_a_world_moved_along_one_direction_lies_there_and_nowhere_else(place):
    name = NAMES[PROBE[place]]
    step = DIRECTIONS[name].step
    expected = np.where(np.arange(len(PROBE)) == place, step, 0.0)
    np.testing.assert_allclose(true_directions(world_changed(name, step, 0.0)), expected, atol=1e-12)


def test_it_believes_its_own_directions_as_closely_as_after_commissioning_and_a_hand_as_before(design):
    world = probe_part(foreign_world(1, 3))
    own = known_probe(design, world).own
    np.testing.assert_allclose(own.mean[PROBE], true_directions(world))
    spread = np.sqrt(np.diag(own.covariance))
    np.testing.assert_allclose(spread[PROBE], FLOOR * STD[PROBE])
    others = np.setdiff1d(np.arange(len(NAMES)), PROBE)
    np.testing.assert_allclose(own.mean[others], MEAN[others])
    np.testing.assert_allclose(spread[others], STD[others])


def test_a_further_press_of_a_scan_has_hand_and_light_of_its_own_on_the_same_patient():
    first = press_part(probe_part(foreign_world(1, 3)), np.random.default_rng(1))
    again = pressed_again(first, np.random.default_rng(2))
    unlike = {name for name in first.__dataclass_fields__ if getattr(first, name) != getattr(again, name)}
    assert unlike == {"tilt", "light"}
    assert again.light.side_ratio == first.light.side_ratio
    assert (again.tilt.beside_x_deg, again.tilt.beside_y_deg) == (first.tilt.beside_x_deg, first.tilt.beside_y_deg)
    assert again.tilt.lesion_x_deg != first.tilt.lesion_x_deg


def test_patients_have_a_skin_of_their_own_and_a_casting_none():
    probe = probe_part(foreign_world(1, 3))
    found, other, casting = (
        press_part(probe, np.random.default_rng(seed), on_phantom=seed == 3).layers for seed in (1, 2, 3)
    )
    assert 1 < found.skin_modulus_ratio < STIFFEST_SKIN
    assert found.skin_modulus_ratio != other.skin_modulus_ratio
    assert casting == probe.layers == replace(found, skin_modulus_ratio=1.0)


def test_a_scan_is_two_presses_with_one_reference(model, tables):
    probe, asked = probe_part(foreign_world(1, 3)), {"seed": 4, "jobs": 1, "are_scans": True}
    scans = foreign_presses(tables, probe, model.answers.noise, 2, **asked)
    assert len(scans.parameters) == len(scans.seen) == 2
    assert (scans.parameters[:, OFFSET] <= 2).all()
    quiet = replace(model.answers.noise, camera=1e-12 * np.eye(COLUMNS), levels=EXACT, forward=None)
    (exact,) = foreign_presses(tables, probe, quiet, 1, **asked).seen
    middle = exact.rows[:, CONTRAST].reshape(2, FORCES, -1)[:, -1, 0]
    assert middle[1] < middle[0]  # it lies farther from the inclusion
    assert [seen.rows.shape for seen in scans.seen] == [(2, COLUMNS)] * 2


@pytest.mark.long
def test_presses_of_its_own_fit_it_better_than_the_probe_beside_it(model, design, tables):
    world = probe_part(foreign_world(1, 3))
    taken = foreign_presses(tables, world, model.answers.noise, 6, seed=2, jobs=1)
    own = known_probe(design, world)
    other = known_probe(design, replace(world, contact=probe_part(foreign_world(1, 4)).contact, cell_span_ratio=1.02))
    critical = limits(own, model, seed=1)["standard"]
    misfits = [scored(answers, model, critical, taken, 1).misfit_ratio.mean() for answers in (own, other)]
    assert misfits[0] < misfits[1]
    assert misfits[0] == pytest.approx(1.0, abs=0.5)
