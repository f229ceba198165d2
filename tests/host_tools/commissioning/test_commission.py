"""Commissioning: phantoms of a probe to what it is, what it refuses, and a bundle that answers for it."""

import json
import re
from dataclasses import asdict, replace
from datetime import UTC, datetime
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from device import __version__
from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.bundle import BundleRefused
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.commissioned.row_derivatives import NAMES, STD
from device.measurement.ramp_modes.radial_profile import CONTRAST, FORCES, RESPONSE
from device.measurement.recording.ring_means import RING_RADII_MM, RINGS
from device.simulation.physics.layer_table import LayerRatios
from device.simulation.physics.skin import ContactLaw
from device.simulation.physics.world import World
from device.simulation.scenario import Scenario
from host_tools.calibration.certified_probe import source_sha256
from host_tools.calibration.gates import CalibrationRejected
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.calibration.phantom_sets import of_file
from host_tools.commissioning import commission as commission_module
from host_tools.commissioning import left_out as left_out_module
from host_tools.commissioning.believed_presses import BelievedAnswers, believed_dial
from host_tools.commissioning.commission import (
    MISFIT_LIMIT,
    WORST_PHANTOM,
    answered_gate,
    blocks_gate,
    commission,
    explained_blocks_gate,
    gates_of,
    steps_gate,
)
from host_tools.commissioning.joint_fit import (
    DISCREPANCY_RATIOS,
    FLAT_FIELD_RATIO,
    FLOOR,
    MODEL_RATIOS,
    MOST_STEPS,
    PROBE,
    UNLIKE_CASTINGS,
    BelievedErrors,
    Design,
    fit_probe,
)
from host_tools.commissioning.left_out import LeftOut, answered_alone, answers_of, left_out, told_blocks
from host_tools.commissioning.own_bundle import write_own_bundle
from host_tools.commissioning.page import PAGE_FILE
from host_tools.commissioning.phantom_ramps import phantom_ramps
from host_tools.commissioning.probe_prior import LAYERS, OF_DESIGN, ProbePrior
from host_tools.commissioning.report import SILICONE, coverage_told, levels_at_their_end, phantom_lines, probe_lines
from host_tools.press_models.mode_outcome import EvaluatedPresses
from host_tools.scenes.phantom_set import read_phantoms
from host_tools.scenes.probe_file import simulated_probe
from host_tools.scores.foreign_presses import foreign_phantoms

EXPONENT = NAMES[PROBE[0]], 0
RAMP_N = tuple(np.linspace(0.1, 0.64, 8))
FOREIGN = World(contact=ContactLaw(exponent=0.9), layers=LayerRatios(face_modulus_ratio=1.1))


@pytest.fixture(scope="module")
def phantoms():
    return read_phantoms(SIMULATED_PROBE / "phantoms.toml", blocks_needed=3)


@pytest.fixture(scope="module")
def ramps(tables, model, phantoms):
    return foreign_phantoms(tables, FOREIGN, model.answers.noise, phantoms, seed=3, jobs=1)


@pytest.fixture(scope="module")
def fit(ramps, model, derivatives):
    return fit_probe(ramps, Design(model.answers, derivatives), BelievedErrors(0.0, 0.002, FLAT_FIELD_RATIO))


def test_phantoms_tell_the_contact_law_of_a_probe(fit):
    """An exponent of 0.9 where the design has 1, ten times as exactly as its tolerance says."""
    name, place = EXPONENT
    assert name == "contact_exponent"
    assert fit.mean[place] == pytest.approx(-0.1, abs=0.015)
    assert np.sqrt(fit.covariance[place, place]) < STD[PROBE[place]] / 10
    assert fit.misfit_ratio.max() < 2


@pytest.mark.parametrize("larger", [{"model_ratio": 0.013}, {"discrepancy_ratio": 0.1}])
def test_presses_of_the_designs_own_physics_are_explained_better_by_small_errors(
    fit, ramps, model, derivatives, larger
):
    large = fit_probe(ramps, Design(model.answers, derivatives), fit.believed._replace(**larger))
    assert fit.log_evidence > large.log_evidence + 10


def with_other_optics(ramp):
    """Return a ramp whose inclusion shows 4 % more in the middle and 4 % less at the rim; its light grows less, too."""
    rows, ratio = np.array(ramp.seen.rows), 1 + 0.04 * np.linspace(1, -1, RINGS)
    rows[:, CONTRAST] *= np.tile(ratio, FORCES)
    rows[:, RESPONSE] += 0.01
    return replace(ramp, seen=ramp.seen._replace(rows=rows))


@pytest.mark.long
@pytest.mark.study
def test_what_the_forward_model_lacks_is_learned_and_found_again_in_a_phantom_left_out(ramps, model, derivatives):
    """Optics of another kind: no level of a press' own error explains them as well as one that all ramps share."""
    design, others = Design(model.answers, derivatives), [with_other_optics(ramp) for ramp in ramps]
    found = fit_probe(others, design)
    assert found.believed.discrepancy_ratio > 0
    assert found.misfit_ratio.max() < 2
    alone = fit_probe(others, design, found.believed._replace(discrepancy_ratio=0.0))
    assert found.log_evidence > alone.log_evidence + 100
    last = next(ramp for ramp in reversed(others) if ramp.has_inclusion)
    rest = [ramp for ramp in others if ramp is not last]
    answers = answers_of(design, fit_probe(rest, design, found.believed))
    assert answered_alone(last, answers, model.first_guesses, 0.0).misfit_ratio < WORST_PHANTOM


@pytest.fixture(scope="module")
def steps():
    """What a commissioning says while it is under way."""
    return []


@pytest.fixture(scope="module")
def commissioned(ramps, model, derivatives, steps):
    with pytest.MonkeyPatch.context() as fewer:
        for name, count in (("PRESSES", 6), ("SCANS", 4), ("ODDS_PRESSES", 200)):
            fewer.setattr(commission_module, name, count)
        return commission(ramps, model, derivatives, jobs=1, say=steps.append)


@pytest.mark.long
def test_of_the_designs_own_physics_no_more_is_lacking_than_linear_terms_leave(commissioned):
    """An exponent of 0.9 is not linear: a hundredth of what an inclusion does is the least that is weighed."""
    assert commissioned.fit.believed.discrepancy_ratio <= UNLIKE_CASTINGS * DISCREPANCY_RATIOS[1]


def test_what_is_believed_is_no_narrower_than_part_of_the_tolerance(fit, derivatives):
    own = fit.own_probe(derivatives)
    std = np.sqrt(np.diag(own.covariance))[PROBE]
    assert np.all(std >= FLOOR * STD[PROBE])
    assert own.discrepancy.of_probe @ own.discrepancy.of_probe.T == pytest.approx(fit.covariance)
    assert own.mean[PROBE] == pytest.approx(fit.mean)


def of_first(ramps, more):
    """Return ramps of which the first one shows this more in its row."""
    seen = ramps[0].seen
    return [replace(ramps[0], seen=seen._replace(rows=seen.rows + more)), *ramps[1:]]


def test_what_the_fit_leaves_of_a_ramp_stands_where_it_was_put(fit, ramps, model, derivatives):
    """0.4 % of the light about one ring at one force, which nothing explains; 1 % in all, as light drifts.

    The first is left where it was put, by most of its size; the drift is the press' own, and leaves nothing.
    """
    spot, drift = np.zeros((2, *ramps[0].seen.rows.shape))
    about = CONTRAST.start + 2 * RINGS + np.arange(RINGS)
    spot[0, about] = 0.004 * np.exp(-(((RING_RADII_MM - RING_RADII_MM[5]) / 3) ** 2) / 2)
    drift[0, CONTRAST] = 0.01 * (1 + ramps[0].seen.rows[0, CONTRAST])
    design = Design(model.answers, derivatives)
    fits = [fit_probe(of_first(ramps, more), design, fit.believed) for more in (spot, drift)]
    left = [one.left_ratio[0] - fit.left_ratio[0] for one in fits]
    assert int(np.argmax(np.abs(left[0]))) in about
    assert left[0][about].max() == pytest.approx(0.004, rel=0.4)
    assert np.abs(left[1]).max() < 0.001


def test_where_there_is_no_inclusion_there_is_no_contrast_to_leave(fit, ramps):
    blocks = [number for number, ramp in enumerate(ramps) if not ramp.has_inclusion]
    assert np.isnan(fit.left_ratio[blocks][:, CONTRAST]).all()
    assert np.isfinite(fit.left_ratio[:, RESPONSE]).all()


def test_probe_and_phantoms_are_reported_in_words(fit):
    lines = list(probe_lines(fit, PROBE))
    assert len(lines) == len(PROBE) + 5
    assert lines[-1] == SILICONE
    assert lines[1].startswith("contact law: exponent less 1")


def test_layers_that_are_expected_to_be_stiffer_are_found_stiffer(fit, ramps, model, derivatives):
    """Ten per cent stiffer, as if known to half of one: ramps alone say otherwise of two of the three, and strongly."""
    layers = [NAMES.index(name) for name in LAYERS]
    mean, std = np.array(OF_DESIGN.mean), np.array(OF_DESIGN.std)
    mean[layers], std[layers] = np.log(1.1), 0.005
    told = fit_probe(ramps, Design(model.answers, derivatives, ProbePrior(mean, std)), fit.believed)
    of_layers = np.isin(PROBE, layers)
    away, before = (np.abs(one.mean - np.log(1.1))[of_layers] for one in (told, fit))
    otherwise = before > 0.05
    assert otherwise.sum() == 2
    assert np.all(away[otherwise] < before[otherwise])
    assert np.all(away[~otherwise] < 0.005)
    assert np.linalg.norm(away) < 0.6 * np.linalg.norm(before)
    assert np.all(np.diag(told.covariance)[of_layers] < np.diag(fit.covariance)[of_layers])
    own = told.own_probe(derivatives)
    assert np.sqrt(np.diag(own.covariance))[PROBE] == pytest.approx(FLOOR * std[PROBE])


def test_a_probe_is_held_against_its_own_file(fit):
    """Found as the design has it, a probe is far from a file that states layers of a quarter more."""
    answered = LeftOut("A1", *np.full((5, 3), 10.0), np.full(3, True), 1.0)
    assert gates_of(fit, [answered])[2].problem is None
    stated = replace(fit, prior=OF_DESIGN._replace(mean=OF_DESIGN.mean + 0.7, std=OF_DESIGN.std))
    problem = gates_of(stated, [answered])[2].problem
    assert problem.quantity == "tolerances from what was expected of load cell: reading over force, less 1"
    assert list(probe_lines(stated, PROBE))[2].split()[-2:] == ["0.7000", "0.1"]


def test_phantoms_of_which_nothing_is_determined_prove_nothing(fit):
    told = LeftOut("A1", *np.full((5, 3), 10.0), np.full(3, True), 1.0)
    missed = replace(told, truth=np.full(3, 20.0), tolerance=np.full(3, 0.1))
    assert gates_of(fit, [told])[1].problem is None
    assert gates_of(fit, [replace(told, is_determined=np.full(3, False))])[1].value == 0.0
    assert gates_of(fit, [told, missed])[1].value == 0.5
    assert gates_of(fit, [told, replace(missed, is_determined=np.full(3, False))])[1].value == 1.0


def answered_as(name, size_mm, depth_mm, stated):
    """Return an answer known to a tenth of itself, and the size and depth that are stated of the phantom."""
    value = np.array([size_mm, depth_mm, 60.0])
    truth = np.array([*stated, 60.0])
    return LeftOut(name, truth, 0.02 * truth, value, 0.9 * value, 1.1 * value, np.array([True, True, False]), 1.0)


def test_two_castings_that_are_swapped_are_named_however_many_phantoms_there_are(fit):
    """Of nine, fourteen of eighteen statements hold all the same: the farthest of them refuses."""
    honest = [answered_as(f"B{number}", 10.0, 6.0, (10.0, 6.0)) for number in range(7)]
    swapped = [answered_as("A1", 6.0, 8.0, (12.0, 4.5)), answered_as("A2", 12.0, 4.5, (6.0, 8.0))]
    _, coverage, _, farthest = gates_of(fit, [*swapped, *honest])
    assert coverage.problem is None
    assert "farthest size or depth of a phantom left out, A1 is " in str(farthest.problem)
    assert "A1 and A2 look exchanged; measure A1, A2 again" in str(farthest.problem)
    _, coverage, _, farthest = gates_of(fit, [*swapped, *honest[:4]])
    assert "A1 and A2 look exchanged; measure A1, A2 again" in str(coverage.problem)
    assert gates_of(fit, honest)[3].problem is None


def test_two_swapped_castings_are_named_alone_though_they_move_the_answers_to_others(fit):
    """Answers of world 1 (`host_tools worlds`) to nine phantoms of which two were swapped: five of them are missed."""

    def between(name, size_mm, depth_mm, stated):
        low, high = (np.array([size, depth, 60.0]) for size, depth in zip(size_mm, depth_mm, strict=True))
        return replace(answered_as(name, 1.0, 1.0, stated), low=low, value=(low + high) / 2, high=high)

    others = [
        between("phantom2", (6.0, 8.74), (4.48, 6.41), (6.7, 6.97)),
        between("phantom7", (10.4, 11.9), (4.22, 4.8), (12.5, 4.41)),
    ]
    swapped = [
        between("phantom4", (10.5, 11.5), (4.05, 4.5), (10.1, 9.54)),
        between("phantom6", (9.5, 14.7), (10.4, 12.0), (10.5, 5.03)),
    ]
    problem = gates_of(fit, [*swapped, *others])[3].problem
    assert "phantom4 and phantom6 look exchanged; measure phantom4, phantom6 again" in str(problem)


def test_a_single_truth_that_is_far_off_is_refused_and_one_just_outside_is_not(fit):
    honest = [answered_as(f"B{number}", 10.0, 6.0, (10.0, 6.0)) for number in range(8)]
    far, near = (answered_as("A1", 10.0, 6.0, (size_mm, 6.0)) for size_mm in (14.0, 11.5))
    problem = gates_of(fit, [far, *honest])[3].problem
    assert "but must be at least 0 and at most 3 times half its interval: measure A1 again" in str(problem)
    assert [gate.problem for gate in gates_of(fit, [near, *honest])[1::2]] == [None, None]


def test_a_rejection_says_how_each_phantom_was_answered(fit):
    said = []
    far = answered_as("A1", 10.0, 6.0, (14.0, 6.0))
    with pytest.raises(CalibrationRejected):
        commission_module._require_all(gates_of(fit, [far]), [far], said.append)
    assert said == list(phantom_lines([far]))
    assert "NOT in" in said[1]


def test_an_inclusion_in_a_block_that_is_stated_without_one_is_told(ramps, model, derivatives, fit):
    design, hidden = Design(model.answers, derivatives), ramps[0]
    told = partial(told_blocks, answers=answers_of(design, fit), model=model, critical=model.critical["standard"])
    found = told([*ramps, *(replace(hidden, name=name, has_inclusion=False) for name in ("C1", "C2"))])
    assert found == ["C1", "C2"]
    assert [blocks_gate(one).problem for one in ([], ["C1"])] == [None, None]
    assert "record C1, C2 again" in str(blocks_gate(found).problem)


def test_a_block_without_inclusion_whose_light_is_not_explained_is_told(ramps, fit):
    assert explained_blocks_gate(ramps, fit).problem is None
    of_block = next(number for number, ramp in enumerate(ramps) if not ramp.has_inclusion)
    of_inclusion = next(number for number, ramp in enumerate(ramps) if ramp.has_inclusion)
    for number, is_told in ((of_inclusion, False), (of_block, True)):
        misfits = fit.misfit_ratio.copy()
        misfits[number] = 5.7
        problem = explained_blocks_gate(ramps, replace(fit, misfit_ratio=misfits)).problem
        assert (problem is not None) == is_told
    assert f"raw, linear and of one exposure, wipe the face, and record {ramps[of_block].name} again" in str(problem)


def test_a_probe_of_whose_presses_hardly_any_has_numbers_is_refused():
    truth, seconds = np.zeros((10, 3)), np.ones(10)
    nothing = EvaluatedPresses(truth, truth, truth - 1, truth + 1, np.zeros((10, 3), bool))
    few, enough = (BelievedAnswers(nothing, np.ones(10, int), np.arange(10) < n, seconds) for n in (1, 2))
    assert answered_gate("scans", enough).problem is None
    assert "share of believed scans that have numbers is 0.1" in str(answered_gate("scans", few).problem)


def test_a_fit_that_was_stopped_is_none(fit):
    assert steps_gate(fit).problem is None
    assert "the fit of all ramps is 40" in str(steps_gate(replace(fit, steps=MOST_STEPS)).problem)


def test_how_little_a_few_truths_tell_of_coverage_is_said():
    """Twelve of twelve that count as 9.8: 0.05 ** (1 / 9.8) is 0.74; of nine the page says 0.44."""
    known = np.array([True, True, False])
    all_held, three_missed = (
        [
            SimpleNamespace(is_determined=known, is_covered=np.array([number >= missed, True, True]))
            for number in range(6)
        ]
        for missed in (0, 3)
    )
    assert "12 of 12 sizes and depths" in next(coverage_told(all_held))
    assert "these hold in 74% at least" in next(coverage_told(all_held))
    assert "these hold in 44% at least" in next(coverage_told(three_missed))
    assert not list(coverage_told([SimpleNamespace(is_determined=~known, is_covered=known)]))


def test_a_level_of_errors_that_may_be_larger_still_is_told(fit):
    assert not list(levels_at_their_end(fit))
    second = fit.believed._replace(discrepancy_ratio=UNLIKE_CASTINGS * DISCREPANCY_RATIOS[-2])
    assert not list(levels_at_their_end(replace(fit, believed=second)))
    largest = fit.believed._replace(
        model_ratio=MODEL_RATIOS[-1], discrepancy_ratio=UNLIKE_CASTINGS * DISCREPANCY_RATIOS[-1]
    )
    lacking, of_press = levels_at_their_end(replace(fit, believed=largest))
    assert "20.0%" in lacking
    assert of_press.startswith("Of the model error of a press the largest level that is weighed is the likeliest, 1.3%")


def test_a_second_ramp_of_a_phantom_is_left_out_with_it(ramps, model, derivatives, fit, monkeypatch):
    kept = []

    def fitted(others, design, believed):
        kept.append([one.name for one in others])
        return fit

    monkeypatch.setattr(left_out_module, "fit_probe", fitted)
    monkeypatch.setattr(left_out_module, "answered_alone", lambda ramp, answers, guess, offset_mm: ramp.name)
    twice, of_all = [*ramps, ramps[0]], replace(fit, offset_mm=np.append(fit.offset_mm, fit.offset_mm[0]))
    names = left_out(twice, Design(model.answers, derivatives), model.first_guesses, of_all, jobs=1)
    assert len(names) == len(kept)
    assert not any(name in others for name, others in zip(names, kept, strict=True))


@pytest.mark.long
def test_a_phantom_left_out_is_answered_as_unknown_and_wrong_truths_are_told(commissioned):
    """Two phantoms whose truths are exchanged are not covered: the gate names what to measure again.

    Errors are those that the fit learns: an exponent of 0.9 is not linear, and without what that leaves it is too sure.
    """
    fit, honest = commissioned.fit, commissioned.phantoms
    assert [gate.problem for gate in gates_of(fit, honest)] == [None, None, None, None]
    assert len(list(phantom_lines(honest))) == len(honest) + 1
    exchanged = [replace(one, truth=honest[-1 - place].truth) for place, one in enumerate(honest)]
    problems = [gate.problem for gate in gates_of(fit, exchanged) if gate.problem]
    assert re.search(r"measure phantom\d.* again", str(problems[0]))


@pytest.mark.long
def test_a_commissioned_probe_has_a_bundle_of_its_own(commissioned, steps, ramps, tmp_path):
    done = commissioned
    assert len(steps) == 3
    assert max(one.misfit_ratio for one in done.phantoms) < done.critical["standard"].misfit_ratio == MISFIT_LIMIT
    out = tmp_path / "TSIS-0007"
    made_at = datetime(2026, 1, 2, tzinfo=UTC)
    write_own_bundle(
        done,
        MODELS / "standard",
        out,
        serial="TSIS-0007",
        made_at=made_at,
        expires_at="2026-12-31T00:00:00Z",
        command="host_tools commission",
        origin={"phantoms": "PH-7", "design": "standard"},
    )
    own = read_ramp_model(out)
    own.prove()
    page = (out / PAGE_FILE).read_text(encoding="utf-8")
    assert all(ramp.name in page for ramp in ramps)
    assert isinstance(own.answers, OwnAnswers)
    assert own.bundle.card["serials"] == ["TSIS-0007"]
    assert own.bundle.card["expires_at"] == "2026-12-31T00:00:00Z"
    assert {name: asdict(one) for name, one in own.critical.items()} == {
        name: asdict(one) for name, one in done.critical.items()
    }
    answer, before = (
        own.answer_to(ramps[0].seen),
        done.answers.answer_to(ramps[0].seen, own.first_guesses(ramps[0].seen.rows)),
    )
    assert answer.fit.best == pytest.approx(before.fit.best, abs=2e-3)  # the file has single precision
    # A sampler amplifies that: 400 effective samples know a mean to a twentieth of its spread.
    assert np.all(np.abs(answer.mean - before.mean) < before.spread / 5)
    card = json.loads((out / "model.json").read_text())
    assert (card["software_version"], card["commissioned"]["software_sha256"]) == (__version__, source_sha256())
    assert "recorded" not in card["modes"]["standard"]  # those are of the design's probe
    one, scans = own.bundle.worth("standard"), own.bundle.worth("precise")
    assert (one.half_width_by_ramps, set(scans.half_width_by_ramps)) == ({}, {2, 3, 4, 5})
    assert one.median_percent == believed_dial("standard", done.presses)["median_percent"]
    of_layer = card["commissioned"]["probe"][LAYERS[0]]
    assert (of_layer["expected"], of_layer["tolerance"]) == (0.0, 0.1)
    (out / "model.json").write_text(json.dumps(card | {"serials": ["TSIS-0008"]}))
    with pytest.raises(BundleRefused):
        read_ramp_model(out)


def recorded(tables, one, world=FOREIGN, forces_n=RAMP_N, seed=4):
    scenario = one.in_its_tissue(Scenario(world=world))
    protocol = PhantomProtocol(forces_n, frames=1)
    return phantom_recording(one.inclusion, tables, seed=seed, protocol=protocol, scenario=scenario)


def test_a_recording_is_of_the_phantom_whose_name_its_file_has(tables, phantoms):
    known = list(of_file(phantoms))
    recordings = [recorded(tables, one, seed=seed) for seed, one in enumerate(known)]
    names = [one.name for one in known]
    ramps = phantom_ramps(recordings, names, phantoms, simulated_probe())
    with pytest.raises(CalibrationRejected, match=f"recording of {names[1]} is that of {names[0]} again"):
        phantom_ramps([recordings[0], *recordings[:-1]], names, phantoms, simulated_probe())
    assert [ramp.name for ramp in ramps] == [one.name for one in known]
    assert [ramp.has_inclusion for ramp in ramps] == [one.truth is not None for one in known]
    assert ramps[0].seen.across is not None


def test_all_that_contradicts_the_recordings_is_told_at_once(tables, phantoms):
    """Too few, an unknown name, another probe, and a press that is no ramp."""
    first, second, third = list(of_file(phantoms))[:3]
    recordings = [
        recorded(tables, first),
        replace(recorded(tables, second), serial="TSIS-0009"),
        recorded(tables, third, forces_n=(0.3, 0.5)),
    ]
    with pytest.raises(CalibrationRejected) as rejected:
        phantom_ramps(recordings, [first.name, "nobody", third.name], phantoms, simulated_probe())
    told = [problem.quantity for problem in rejected.value.problems]
    assert "serial of nobody" in told
    assert "phantom of nobody" in told
    assert any(one.startswith(f"{third.name}: ") for one in told)
    assert "recorded bare blocks" in told
    assert "recorded phantoms with an inclusion" in told


def test_forces_whose_zero_is_off_and_saturated_frames_are_told_by_recording(tables, phantoms):
    """Before anything is fitted: the fit would blame the castings."""
    first, second, third = list(of_file(phantoms))[:3]
    off, bright, crept = (recorded(tables, one) for one in (first, second, third))
    lit = (replace(one, force_n=one.force_n + 0.025 * (one.role != "dark")) for one in crept.frames)
    crept = replace(crept, frames=tuple(lit))
    off = replace(off, frames=tuple(replace(one, force_n=one.force_n + 0.006) for one in off.frames))
    bright.frames[-1].counts[:20] = 255
    with pytest.raises(CalibrationRejected) as rejected:
        phantom_ramps([off, bright, crept], [first.name, second.name, third.name], phantoms, simulated_probe())
    told = [problem.quantity for problem in rejected.value.problems]
    assert f"mean force of the dark frames of {first.name}" in told
    assert f"saturated pixels of {second.name}" in told
    assert f"mean force of the lit, untouched frames of {third.name}" in told
    assert f"mean force of the dark frames of {third.name}" not in told


def test_a_scan_of_a_phantom_is_refused_by_its_name(tables, phantoms):
    """Its second ramp was passed over; taken as a ramp of its own it would count the reference twice."""
    first = next(of_file(phantoms))
    press = recorded(tables, first)
    again = tuple(replace(frame, ramp=1) for frame in press.with_role("press"))
    with pytest.raises(CalibrationRejected, match=f"ramps of {first.name} is 2, but must be 1.*elsewhere"):
        phantom_ramps([replace(press, frames=(*press.frames, *again))], [first.name], phantoms, simulated_probe())


def test_a_phantom_that_the_designs_model_does_not_hold_is_refused(tables, phantoms):
    deep = replace(phantoms.phantoms[0], depth_mm=14.0)
    others = replace(phantoms, phantoms=(deep, *phantoms.phantoms[1:]))
    known = list(of_file(others))
    recording = recorded(tables, next(of_file(phantoms)))
    with pytest.raises(InvalidQuantity, match="depth_mm of"):
        phantom_ramps([recording], [known[0].name], others, simulated_probe())


def test_an_interval_fits_a_truth_as_far_as_that_is_known():
    """An interval of 10 +- 0.3 and a truth of 10.4: missed where that is exact, not where it is known to 0.2."""
    known, wide = np.zeros(3), np.full(3, 0.2)
    answer = LeftOut("A1", np.full(3, 10.4), known, np.full(3, 10.0), np.full(3, 9.7), np.full(3, 10.3), known > 1, 1.0)
    assert not answer.is_covered.any()
    assert replace(answer, tolerance=wide).is_covered.all()
    assert not replace(answer, tolerance=wide, truth=np.full(3, 9.5)).is_covered.any()
