"""A commissioned probe: what it changes of a press, and that presses of it are answered where the design's are not."""

from dataclasses import replace

import numpy as np
import pytest

from device.files.shipped import SIMULATED_PROBE
from device.files.table_file import load_table
from device.measurement.parameters import HIGH, PARAMETERS, normalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.commissioned import own_answers
from device.measurement.ramp_modes.commissioned.moving_posterior import MovingPosterior
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.commissioned.own_posterior import (
    AXES,
    SCAN_VARIANCE,
    OwnPosterior,
    seen_of,
    seen_with_noise,
    to_bright_side,
)
from device.measurement.ramp_modes.commissioned.own_probe import OwnProbe, Place, turned_columns, vector_columns
from device.measurement.ramp_modes.commissioned.row_derivatives import (
    COUNT,
    DERIVATIVE_ARRAYS,
    MEAN,
    NAMES,
    STD,
    owned_by,
    row_derivatives_of,
)
from device.measurement.ramp_modes.fit import PressPosterior, best_fit
from device.measurement.ramp_modes.misfit_blocks import BLOCKS
from device.measurement.ramp_modes.model import ramp_answers_of, surrogate_arrays
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.ramp_modes.radial_profile import COLUMNS, CONTRAST, FIRST, FIRST_ACROSS, RESPONSE, SECOND
from device.measurement.ramp_modes.surrogate import OFFSET, SIZE

TRUTH = np.array([10.0, 6.0, 80.0, 5.0, 30.0, 2.0, 0.5, 1.0, 1.0])
PROBE = owned_by("probe")


@pytest.fixture(scope="module")
def derivatives():
    arrays, _ = load_table(
        SIMULATED_PROBE, "press_derivatives", "tsis.press_derivatives/5", DERIVATIVE_ARRAYS, "make them again"
    )
    return row_derivatives_of(arrays)


def believed(derivatives, mean=MEAN, std=STD):
    return OwnProbe(derivatives, np.array(mean), np.diag(np.array(std) ** 2), ErrorLevels(flat_field_ratio=0.0047))


def own_posterior(seen, ramp_model, own, at):
    answers = ramp_model.answers
    return OwnPosterior(seen, answers.surrogate, answers.noise, own, answers.reach_mm(len(seen.rows)), at)


def rows_at(ramp_model, parameters=TRUTH):
    at = normalise(np.atleast_2d(parameters))
    return at, ramp_model.answers.surrogate.rows(at, np.zeros(len(at)))


def test_derivatives_survive_their_arrays(derivatives, ramp_model):
    again = row_derivatives_of(derivatives.arrays())
    at, rows = rows_at(ramp_model)
    assert np.array_equal(again.changes(at, rows), derivatives.changes(at, rows))


@pytest.mark.parametrize("part", ["near_baseline_coefficients", "beside_inclusion_degrees"])
def test_derivatives_of_another_shape_are_refused(derivatives, part):
    arrays = derivatives.arrays()
    with pytest.raises(InvalidQuantity, match="derivatives"):
        row_derivatives_of(arrays | {part: arrays[part][:, 1:]})


def test_a_tilt_moves_the_first_harmonic_and_the_contact_law_the_reference(derivatives, ramp_model):
    at, rows = rows_at(ramp_model)
    changes = dict(zip(NAMES, derivatives.changes(at, rows)[0] * STD[:, None], strict=True))
    rms = {
        name: [float(np.sqrt(np.mean(one[part] ** 2))) for part in (CONTRAST, RESPONSE, FIRST)]
        for name, one in changes.items()
    }
    assert np.argmax(rms["tilt_lesion_deg"]) == np.argmax(rms["tilt_beside_deg"]) == 2
    assert np.argmax(rms["contact_exponent"]) == 1
    assert np.argmax(rms["albedo_log_ratio"]) == 0
    assert rms["tilt_lesion_deg"][1] == 0.0  # the reference press does not lean with it


def test_a_covariance_that_is_none_is_refused(derivatives):
    with pytest.raises(InvalidQuantity, match="covariance"):
        OwnProbe(derivatives, MEAN, -np.eye(COUNT), ErrorLevels())
    with pytest.raises(InvalidQuantity, match="mean"):
        OwnProbe(derivatives, MEAN[1:], np.eye(COUNT), ErrorLevels())


def test_uneven_tissue_is_shared_by_all_presses_and_even_tissue_has_none(derivatives, ramp_model):
    """What layers change of the contrast, two presses at one place have alike; a casting's are known."""
    own, (at, rows) = believed(derivatives), rows_at(ramp_model, np.tile(TRUTH, (2, 1)))
    even, uneven, twice = (
        replace(own, uneven_ratio=ratio).changes(Place(at, np.zeros(2), np.zeros(2)), rows) for ratio in (0.0, 1.0, 2.0)
    )
    assert np.array_equal(even.shift, uneven.shift)
    further = [np.einsum("nsk,msk->nms", one.factor, one.factor)[:, :, CONTRAST] for one in (even, uneven, twice)]
    of_layers = further[1] - further[0]
    np.testing.assert_allclose(of_layers[0, 1], of_layers[0, 0], rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(further[2] - further[0], 4 * of_layers, rtol=1e-6, atol=1e-12)
    assert np.sqrt(of_layers[0, 0].max()) > 0.01
    assert own.may_be_uneven
    known = np.where(np.isin(np.arange(COUNT), owned_by("tissue")), 1e-6, STD)
    assert not believed(derivatives, std=known).may_be_uneven


def test_what_presses_share_is_the_probe_the_lesion_and_the_reference_press(derivatives, ramp_model):
    """Two presses at one place: their tilts are their own, all else is alike, so contrasts go together."""
    at, rows = rows_at(ramp_model, np.tile(TRUTH, (2, 1)))
    factor = believed(derivatives).changes(Place(at, np.zeros(2), np.zeros(2)), rows).factor
    first, second = factor

    def shared_ratio(columns):
        own = [np.sum(part[columns] ** 2, axis=1) for part in factor]
        return np.sum(first[columns] * second[columns], axis=1) / np.sqrt(own[0] * own[1])

    assert shared_ratio(RESPONSE).min() > 0.999
    assert shared_ratio(CONTRAST).min() > 0.9
    assert 0.4 < np.median(shared_ratio(FIRST)) < 0.7  # half of a harmonic is the reference's tilt


def test_a_tilt_of_the_reference_is_one_vector_in_the_image_whichever_side_is_bright(derivatives, ramp_model):
    """A quarter of a turn apart, what is along for the one press is across for the other."""
    at, rows = rows_at(ramp_model, np.tile(TRUTH, (2, 1)))
    own = believed(derivatives, std=np.where(np.arange(COUNT) == NAMES.index("tilt_beside_deg"), 1.0, 1e-9))
    factor = own.changes(Place(at, np.zeros(2), np.array([0.0, np.pi / 2])), rows).factor
    first, second = factor
    together = first @ second.T
    assert np.abs(np.diag(together[FIRST, FIRST])).max() < 1e-9
    apart = np.diag(together[FIRST, FIRST_ACROSS])
    alone = np.diag((first @ first.T)[FIRST, FIRST])
    assert apart == pytest.approx(-alone, rel=1e-3) or apart == pytest.approx(alone, rel=1e-3)


def test_a_press_that_is_not_seen_yet_is_believed_to_lean_as_hands_do(derivatives, ramp_model):
    """One whose bright side is no number, as a further press of a scan; one that is seen straight is known better."""
    at, rows = rows_at(ramp_model, np.tile(TRUTH, (2, 1)))
    own, seen = believed(derivatives), turned_columns(rows, 0.0)
    place = Place(at, np.zeros(2), np.array([0.0, np.nan]))
    told, habit = own.changes(place, rows, seen).factor, own.changes(place, rows).factor
    assert told[1] == pytest.approx(habit[1])
    assert np.linalg.norm(told[0][SECOND]) < 0.9 * np.linalg.norm(habit[0][SECOND])


def test_derivatives_of_other_tissue_are_refused(derivatives):
    with pytest.raises(InvalidQuantity, match="tissue_kpa"):
        row_derivatives_of(derivatives.arrays() | {"tissue_kpa": np.array([4.0, 6.0])})


def test_turning_to_the_bright_side_keeps_what_is_seen(ramp_model):
    """Wherever the harmonics were taken along, they are the same waves in the image."""
    _, rows = rows_at(ramp_model)
    once = to_bright_side(turned_columns(rows, 0.4), np.array([1.0]))
    again = to_bright_side(turned_columns(rows, -1.1), np.array([2.5]))
    assert again.rows == pytest.approx(once.rows, abs=1e-12)
    assert again.across == pytest.approx(once.across, abs=1e-12)
    assert again.direction_rad == pytest.approx(once.direction_rad)
    assert once.direction_rad[0] == pytest.approx(1.4)


@pytest.mark.parametrize("presses", [1, 2, 3])
def test_derivatives_of_the_posterior_are_its_differences(derivatives, ramp_model, presses):
    """But for what the direction itself changes of the light, which is left out of them."""
    rng = np.random.default_rng(3)
    parameters = np.tile(TRUTH, (presses, 1))
    _, rows = rows_at(ramp_model, parameters)
    seen = seen_of(turned_columns(rows, 0.3), np.full(presses, np.nan))
    at = rng.uniform(-0.3, 0.3, OFFSET + AXES * presses)
    posterior = own_posterior(seen, ramp_model, believed(derivatives), at)
    residuals, (jacobian,) = posterior.residuals_and_jacobian(at[None])
    assert residuals[0] == pytest.approx(posterior.residuals(at), abs=1e-9)
    for k in range(posterior.dimensions):
        step = 1e-5 * (np.arange(posterior.dimensions) == k)
        difference = (posterior.residuals(at + step) - posterior.residuals(at - step)) / 2e-5
        assert np.abs(difference - jacobian[:, k]).max() < 1e-4 * np.abs(difference).max()


@pytest.mark.parametrize("presses", [1, 3])
def test_the_likeliest_changes_follow_the_place_to_first_order(derivatives, ramp_model, presses):
    """It has the derivatives of the joint fit about its best fit, and explains there as one whose changes stay."""
    own = replace(believed(derivatives), uneven_ratio=3.0)
    at, rows = rows_at(ramp_model, np.tile(TRUTH, (presses, 1)))
    layers = own.changes(Place(at, np.zeros(presses), np.zeros(presses)), rows)
    drawn = np.random.default_rng(4).standard_normal(layers.factor.shape[2])
    seen = seen_of(turned_columns(rows, 0.0) + layers.shift + layers.factor @ drawn, np.zeros(presses))
    place = np.append(at[0, :OFFSET], np.tile([0.1, 0.05], presses))
    before = own_posterior(seen, ramp_model, own, place)
    best = best_fit(before, place)
    likeliest = before.likeliest_changes(best)
    assert np.abs(likeliest).max() > 1
    moving, staying = MovingPosterior(before, best), own_posterior(seen, ramp_model, own, best)
    np.testing.assert_allclose(moving.residuals(best), staying.residuals(best), atol=1e-9)
    residuals, (jacobian,) = moving.residuals_and_jacobian(best[None])
    np.testing.assert_allclose(residuals[0], moving.residuals(best), atol=1e-9)

    def joint(there):
        moved = staying.moved(there, likeliest) - staying.moved(best, likeliest)
        return staying.residuals(there) + staying.whitened(moved[:, None])[:, 0]

    _, (still,) = staying.residuals_and_jacobian(best[None])
    for k in np.flatnonzero(np.abs(best) < 0.97):
        step = 1e-3 * (np.arange(len(best)) == k)
        difference = (joint(best + step) - joint(best - step)) / 2e-3
        assert np.linalg.norm(difference - jacobian[:, k]) < 0.05 * np.linalg.norm(difference)
    assert np.linalg.norm(still[:, SIZE] - jacobian[:, SIZE]) > 0.1 * np.linalg.norm(jacobian[:, SIZE])


@pytest.mark.parametrize("presses", [1, 2])
def test_the_misfit_is_against_noise_as_it_is_believed_of_scans_too(derivatives, ramp_model, presses):
    """In all blocks together: what a scan tells is believed in part, what it shows is not."""
    answers, nothing = ramp_model.answers, believed(derivatives, mean=np.zeros(COUNT), std=np.full(COUNT, 1e-9))
    at, rows = rows_at(ramp_model, np.tile(TRUTH, (presses, 1)))
    along = TRUTH[OFFSET] / answers.reach_mm(presses)
    place = np.append(at[0, :OFFSET], np.tile([along, 0.0], presses))
    ratios, squares = [], []
    for seed in range(20):
        noisy = seen_with_noise(turned_columns(rows, 0.0), answers.noise, np.random.default_rng(seed))
        posterior = own_posterior(seen_of(noisy, np.zeros(presses)), ramp_model, nothing, place)
        ratios.append(posterior.misfit_ratio(place))
        squares.append([block.ratio for block in posterior.misfit_by_block(place).values()])
        part = 1.0 if presses == 1 else 1 / SCAN_VARIANCE
        density = -0.5 * ratios[-1] * len(posterior.residuals(place)) * part
        assert posterior.log_density(place[None]) == pytest.approx(density, rel=1e-4)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.05)
    assert np.mean(squares, axis=0) == pytest.approx(np.ones(len(BLOCKS)), abs=0.15)


@pytest.mark.parametrize("presses", [1, 2])
def test_samples_that_all_lie_outside_have_no_density(derivatives, ramp_model, presses):
    """Then not one is left to be computed, of a scan's columns either."""
    at, rows = rows_at(ramp_model, np.tile(TRUTH, (presses, 1)))
    seen = seen_of(turned_columns(rows, 0.0), np.zeros(presses))
    place = np.append(at[0, :OFFSET], np.zeros(AXES * presses))
    posterior = own_posterior(seen, ramp_model, believed(derivatives), place)
    assert (posterior.log_density(np.full((3, posterior.dimensions), 1.5)) == -np.inf).all()


def test_a_press_of_the_design_is_explained_as_well_as_by_the_designs_own_posterior(derivatives, ramp_model):
    """With no directions and the inclusion on the bright side both are the same, but for harmonics across."""
    at, rows = rows_at(ramp_model)
    answers = ramp_model.answers
    own = replace(believed(derivatives, np.zeros(COUNT), np.full(COUNT, 1e-9)), levels=answers.noise.levels)
    place = np.append(at[0, :OFFSET], [TRUTH[-1] / HIGH[OFFSET], 0.0])
    seen = seen_of(turned_columns(rows, 0.0), np.zeros(1))
    posterior = own_posterior(seen, ramp_model, own, place)
    usual = PressPosterior(rows, answers.surrogate, answers.noise, direction_rad=np.zeros(1))
    elsewhere = place + 0.05 * (np.arange(len(place)) < OFFSET)
    moved = at[0] + 0.05 * (np.arange(len(PARAMETERS)) < OFFSET)
    found = np.sum(posterior.residuals(elsewhere) ** 2) - np.sum(posterior.residuals(place) ** 2)
    assert found == pytest.approx(np.sum(usual.residuals(moved) ** 2), rel=1e-3)


def test_harmonics_across_are_needed(derivatives, ramp_model):
    _, rows = rows_at(ramp_model)
    seen = seen_of(turned_columns(rows, 0.0), np.zeros(1))._replace(first_across=None)
    with pytest.raises(ValueError, match="across"):
        OwnPosterior(
            seen, ramp_model.answers.surrogate, ramp_model.answers.noise, believed(derivatives), 2.0, np.zeros(10)
        )


@pytest.fixture(scope="module")
def foreign(derivatives, ramp_model):
    """A press of a probe whose contact law and face differ by two tolerances, and that leans."""
    at, rows = rows_at(ramp_model)
    mean = MEAN + 2 * STD * np.isin(NAMES, ["contact_exponent", "face_modulus_log_ratio"])
    changes = derivatives.changes(at, rows)[0]
    seen = turned_columns(rows + np.einsum("dp,d->p", changes[PROBE], mean[PROBE]), 0.0)
    seen[:, FIRST_ACROSS] += 0.3 * changes[NAMES.index("tilt_lesion_deg"), FIRST]
    noisy = seen_with_noise(seen, ramp_model.answers.noise, np.random.default_rng(8))
    return to_bright_side(noisy, np.array([0.7]))


def test_a_foreign_probes_press_is_answered_by_its_own_bundle_and_refused_by_the_designs(
    foreign, derivatives, ramp_model
):
    own = OwnAnswers(ramp_model.answers.surrogate, ramp_model.answers.noise, believed(derivatives))
    guess = ramp_model.first_guesses(foreign.rows - own.ordinary_shift(foreign.rows))
    answer, design = own.answer_to(foreign, guess), ramp_model.answers.answer_to(foreign, guess)
    assert design.misfit_ratio > 3 * ramp_model.critical["standard"].misfit_ratio
    assert answer.misfit_ratio < 1.4
    truth = normalise(TRUTH[None])[0]
    for unknown in (0, 1):
        assert answer.intervals.low[unknown] <= truth[unknown] <= answer.intervals.high[unknown]
    assert answer.unlike is not None
    assert answer.unlike.shift.shape == (COLUMNS,)


def leaning(derivatives, ramp_model, tilts_deg):
    """Presses of the design at 0 and 3 mm on which the probe leans so far, along the inclusion and across."""
    parameters = np.tile(TRUTH, (len(tilts_deg), 1))
    parameters[:, -1] = np.array([1.0, 3.0])[: len(tilts_deg)]
    at, rows = rows_at(ramp_model, parameters)
    changes = derivatives.changes(at, rows)
    straight = turned_columns(rows + np.einsum("ndp,d->np", changes, MEAN), 0.0)
    seen, own = np.array(straight), believed(derivatives)
    for number, (along_deg, across_deg) in enumerate(tilts_deg):
        tilt = changes[number, NAMES.index("tilt_lesion_deg")]
        seen[number] += vector_columns(tilt, 0.0) @ np.array([along_deg, across_deg])
    place = Place(at, np.zeros(len(at)), np.zeros(len(at)))
    of_squares, of_none = (own.changes(place, rows, one).shift for one in (seen, straight))
    seen += of_squares - of_none
    seen[1:, RESPONSE] = seen[0, RESPONSE]
    return to_bright_side(
        seen_with_noise(seen, ramp_model.answers.noise, np.random.default_rng(8)), np.zeros(len(seen))
    )


@pytest.mark.parametrize("tilts_deg", [((0.0, 1.5),), ((0.1, 0.0), (0.0, -1.5))])
def test_how_far_the_probe_leant_is_told_of_the_press_that_leant_most(derivatives, ramp_model, tilts_deg):
    """1.5 degrees are five standard deviations of a hand's habit, of which the posterior's mean keeps most."""
    own = OwnAnswers(ramp_model.answers.surrogate, ramp_model.answers.noise, believed(derivatives))
    found = []
    for tilts in (tilts_deg, [(0.0, 0.0)] * len(tilts_deg)):
        seen = leaning(derivatives, ramp_model, tilts)
        found.append(own.departure(seen, own.answer_to(seen, ramp_model.first_guesses(seen.rows))))
    leant, straight = found
    assert 3.0 < leant.tilt_deviations < 6.0
    assert straight.tilt_deviations < 1.5
    assert (leant.block, straight.block) == ("first_harmonic", None)
    counts = [leant.blocks[block].columns for block in BLOCKS]
    presses = len(tilts_deg)
    assert counts == [presses * 44, 33, presses * 80, presses * 72]


def test_where_to_press_next_is_told_of_a_commissioned_probe_too(foreign, derivatives, ramp_model):
    own = OwnAnswers(ramp_model.answers.surrogate, ramp_model.answers.noise, believed(derivatives))
    answer = own.answer_to(foreign, ramp_model.first_guesses(foreign.rows))
    parts = own.worth(foreign, answer, (2.0, 4.0))
    assert parts.shape == (2, 3)
    assert np.all((parts > 0) & (parts <= SCAN_VARIANCE**0.5 + 1e-9))


@pytest.mark.parametrize("presses", [1, 2])
def test_coarse_skin_widens_intervals_and_moves_no_limit(derivatives, ramp_model, monkeypatch, presses):
    """Skin of three times the texture believed is told as such; what a press is refused or named for is as without."""
    levels = ErrorLevels(flat_field_ratio=0.0047, flat_field_shared_ratio=0.6)
    noise = replace(ramp_model.answers.noise, levels=levels)
    own = OwnAnswers(ramp_model.answers.surrogate, noise, replace(believed(derivatives), levels=levels))
    parameters = np.tile(TRUTH, (presses, 1))
    parameters[:, -1] = np.array([1.0, 3.0])[:presses]
    at, rows = rows_at(ramp_model, parameters)
    straight = turned_columns(rows, 0.0) + own.own.changes(Place(at, np.zeros(presses), np.zeros(presses)), rows).shift
    straight[1:, RESPONSE] = straight[0, RESPONSE]
    coarse = replace(noise, levels=levels.on_coarser_skin(3.0))
    seen = to_bright_side(seen_with_noise(straight, coarse, np.random.default_rng(3)), np.zeros(presses))
    guess = ramp_model.first_guesses(seen.rows - own.ordinary_shift(seen.rows))
    answer = own.answer_to(seen, guess)
    monkeypatch.setattr(own_answers, "BADLY_EXPLAINED", np.inf)
    as_believed = own.answer_to(seen, guess)
    assert as_believed.misfit_ratio > 1.1
    assert answer.unlike.skin_texture_ratio in (2.5, 3.7)
    assert as_believed.unlike.skin_texture_ratio == 1.0
    assert np.all(answer.spread[:2] > 1.1 * as_believed.spread[:2])  # by 1.2 and 1.4; of 400 samples each, to 4 %
    limits, limits_as_believed = (ramp_model.found(one, seen) for one in (answer, as_believed))
    told = "misfit_ratio", "elongation_deviations", "outside_log_odds"
    assert [getattr(limits, name) for name in told] == [getattr(limits_as_believed, name) for name in told]
    assert own.departure(seen, answer) == own.departure(seen, as_believed)


def test_a_bundle_keeps_what_is_the_probes_own(derivatives, ramp_model):
    own = OwnAnswers(ramp_model.answers.surrogate, ramp_model.answers.noise, believed(derivatives, MEAN + STD))
    arrays = surrogate_arrays(own)
    again = ramp_answers_of(arrays)
    assert isinstance(again, OwnAnswers)
    assert again.own.mean == pytest.approx(MEAN + STD)
    assert again.noise.levels == own.own.levels
    with pytest.raises(InvalidQuantity, match="error levels"):
        ramp_answers_of(arrays | {"own_levels": np.zeros(3)})
    with pytest.raises(InvalidQuantity, match="no own_discrepancy_mean"):
        ramp_answers_of({name: one for name, one in arrays.items() if name != "own_discrepancy_mean"})


def test_the_file_of_a_design_has_nothing_of_its_own(ramp_model):
    assert not isinstance(ramp_answers_of(surrogate_arrays(ramp_model.answers)), OwnAnswers)
