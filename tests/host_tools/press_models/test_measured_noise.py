"""Covariances from few presses, shrunk: variances stay, chance goes, and what is alike in all columns is kept.

Of recordings about exact rows, of surrogates about presses, and of tables about inclusions solved anew.
"""

import numpy as np
import pytest

from device.measurement.parameters import HIGH, NOMINAL, PARAMETERS
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.noise import light_ratio, rms_contrast
from device.measurement.ramp_modes.radial_profile import CONTRAST, SeenPresses
from device.measurement.ramp_modes.surrogate import OFFSET
from device.simulation.physics.slab import Slab
from device.simulation.physics.surface_table import Ramp
from host_tools.forward.press_model import PressFailed
from host_tools.press_models import measured_noise as module
from host_tools.press_models.measured_noise import (
    FINER,
    LARGEST_N,
    _solved_anew,
    camera_noise,
    recorded_errors,
    shrinkage,
    shrunk_covariance,
    surrogate_error,
    table_error,
)
from host_tools.press_models.press_samples import PressSamples, draw_parameters, profile_rows
from host_tools.press_models.recorded_presses import RecordedPresses, direction_of_press_rad
from host_tools.press_models.seeds import press_seed


def test_mean_squares_stay_and_correlations_shrink():
    """Two columns of correlation 0.6: their mean product is that times less than 1, their mean squares are as drawn."""
    errors = np.random.default_rng(3).multivariate_normal([0, 0], [[4.0, 1.2], [1.2, 1.0]], 50)
    sample, found = errors.T @ errors / 50, shrunk_covariance(errors)
    np.testing.assert_allclose(np.diag(found), np.diag(sample))
    assert 0.7 < found[0, 1] / sample[0, 1] < 1.0


def test_correlations_that_are_chance_vanish_and_those_that_are_not_stay():
    """Independent columns shrink nearly all the way; a common error of many recordings hardly."""
    rng = np.random.default_rng(4)
    chance = rng.standard_normal((40, 30))
    common = rng.standard_normal((4000, 1)) + 0.1 * rng.standard_normal((4000, 30))
    assert intensity(chance) > 0.8
    assert intensity(common) < 0.01


def intensity(errors: np.ndarray) -> float:
    return shrinkage(errors / np.sqrt(np.mean(errors**2, axis=0)))


def test_what_columns_tell_beside_a_strong_common_error_is_kept():
    """Columns that share an error of 1 and have 0.03 of their own: the least variance is that of their own."""
    rng = np.random.default_rng(5)
    errors = rng.standard_normal((600, 1)) + 0.03 * rng.standard_normal((600, 40))
    least = np.linalg.eigvalsh(shrunk_covariance(errors))[:39]
    assert np.median(least) == pytest.approx(0.03**2, rel=0.3)


def test_a_common_error_counts_as_noise_and_is_not_taken_out_as_a_mean():
    np.testing.assert_allclose(np.diag(shrunk_covariance(np.full((7, 2), 0.3))), 0.09)


def test_fewer_recordings_than_columns_still_leave_a_covariance_that_can_be_inverted():
    errors = np.random.default_rng(1).normal(0, 1, (20, 80))
    assert np.linalg.matrix_rank(errors.T @ errors) == 20
    assert np.linalg.eigvalsh(shrunk_covariance(errors)).min() > 0.1


def test_errors_are_those_of_what_is_recorded_about_the_exact_rows(tables, monkeypatch):
    """Recordings that are the exact rows plus known errors, as large as the light, give back the errors.

    Exact rows are those of the direction in which each recording was pressed: it is told by the seed, as there.
    """
    aside = (NOMINAL | {"offset_mm": 1.5}).values()
    drawn = np.array([[12.0, 6.0, 60.0, *aside], [9.0, 5.0, 120.0, *aside]])
    direction_rad = np.array([direction_of_press_rad(press_seed(9, number)) for number in range(2)])
    exact = profile_rows(tables, drawn, direction_rad)
    assert np.abs(exact - profile_rows(tables, drawn)).max() > 1e-4
    errors = np.random.default_rng(2).normal(0, 1e-3, exact.shape)
    asked = {}

    def record(tables, parameters, mode, *, seed, jobs):
        asked.update(mode=mode, seed=seed, jobs=jobs)
        rows = exact + light_ratio(exact) * errors
        return RecordedPresses(parameters, [SeenPresses(row[None], np.zeros(0), np.zeros(1)) for row in rows])

    monkeypatch.setattr(module, "record_presses", record)
    found = recorded_errors(tables, drawn, seed=9, jobs=1)
    assert asked == {"mode": "standard", "seed": 9, "jobs": 1}
    np.testing.assert_allclose(found, errors, atol=1e-12)


def test_the_covariance_is_that_of_presses_near_and_beside_the_inclusion_together(tables, monkeypatch):
    errors, drawn = np.random.default_rng(2).normal(0, 1e-3, (30, 5)), []

    def errors_of(tables, parameters, *, seed, jobs):
        drawn.append((parameters[:, OFFSET], seed))
        return errors[: len(parameters)] if len(drawn) == 1 else errors[-len(parameters) :]

    monkeypatch.setattr(module, "recorded_errors", errors_of)
    found = camera_noise(tables, 20, 10, seed=9, jobs=1)
    np.testing.assert_allclose(found, shrunk_covariance(errors))
    (near_mm, near_seed), (beside_mm, beside_seed) = drawn
    assert near_mm.max() <= HIGH[OFFSET] <= beside_mm.min()
    assert near_seed != beside_seed


def test_what_a_surrogate_misses_is_a_covariance_for_a_contrast_of_one(tables):
    """Errors drawn as the root of the contrast, the same in all columns: their variance comes back."""
    rng, level = np.random.default_rng(3), 1e-5
    parameters = draw_parameters(60, rng)
    kept = PressSamples(parameters, profile_rows(tables, parameters), np.zeros(60))
    size = np.sqrt(rms_contrast(kept.rows))[:, None] * light_ratio(kept.rows)
    errors = level * size * rng.standard_normal((60, 1))

    class Surrogate:
        def rows(self, at, direction_rad):
            return kept.rows + errors

    found = surrogate_error(Surrogate(), kept)
    np.testing.assert_allclose(np.diag(found), level**2, rtol=0.3)
    assert found[0, 1] == pytest.approx(found[0, 0], rel=0.05)


def test_tables_miss_what_inclusions_solved_anew_have_more(tables, monkeypatch):
    """Solves that are the tables' fields times a ratio are missed in proportion, about as the contrast.

    Light follows the pressure less than in proportion.
    """
    found, asked = {}, []

    def solved(scene, largest_n, levels):
        asked.append((largest_n, levels))
        slab = Slab(scene.tissue.youngs_modulus_kpa, scene.tissue.thickness_mm)
        field = tables.centred.inclusion_field(scene.inclusion, slab)
        return Ramp(field.force_n, ratio * field.fields_per_n)

    monkeypatch.setattr(module, "inclusion_ramp", solved)
    for ratio in (1.005, 1.05):
        found[ratio] = np.sqrt(np.diag(table_error(tables, 4, seed=3, jobs=1)))
    assert set(asked) == {(LARGEST_N, FINER)}
    np.testing.assert_allclose(found[1.005], 0.1 * found[1.05], rtol=0.1, atol=0.05 * found[1.005].max())
    pressed = [_solved_anew(tables, press_seed(3, number))[0] for number in range(4)]
    rows = profile_rows(tables, np.concatenate(pressed))
    of_contrast = 0.05 * rows[:, CONTRAST] / light_ratio(rows)[:, CONTRAST] / np.sqrt(rms_contrast(rows))[:, None]
    ratio_of_contrast = found[1.05][CONTRAST].mean() / np.sqrt(np.mean(of_contrast**2, axis=0)).mean()
    assert 0.7 < ratio_of_contrast < 1.1


def test_a_press_without_an_inclusion_is_the_tables_own(tables, monkeypatch):
    monkeypatch.setattr(module, "inclusion_ramp", lambda scene, largest_n, levels: "solved")
    parameters, ramps = _solved_anew(tables, 3)
    inclusion, slab = Inclusion(*parameters[0, :3]), Slab(*parameters[0, 3:5])
    assert ramps.inclusion_field == "solved"
    np.testing.assert_array_equal(
        ramps.baseline.fields_per_n, tables.centred.ramps(inclusion, slab).baseline.fields_per_n
    )
    assert (parameters[:, OFFSET] == 0).all()
    assert len(set(parameters[:, PARAMETERS.index("albedo")])) == len(parameters)


def test_an_inclusion_whose_elements_fold_is_drawn_again(tables, monkeypatch):
    tried = []

    def folds_once(scene, largest_n, levels):
        tried.append(scene.inclusion)
        if len(tried) == 1:
            raise PressFailed("folded")
        return tables.centred.inclusion_field(scene.inclusion)

    monkeypatch.setattr(module, "inclusion_ramp", folds_once)
    assert np.isfinite(table_error(tables, 1, seed=3, jobs=1)).all()
    assert len(set(tried)) == 2
