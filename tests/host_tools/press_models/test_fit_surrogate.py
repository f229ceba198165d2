"""Polynomials are recovered from their own rows, and which terms they have is counted on paper."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from device.measurement.parameters import HIGH, LOW, PARAMETERS, normalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.legendre import LegendreSum
from device.measurement.ramp_modes.radial_profile import CONTRAST, RESPONSE
from device.measurement.ramp_modes.surrogate import (
    CONTRAST_COLUMNS,
    INCLUSION_COLUMNS,
    OFFSET,
    RESPONSE_COLUMNS,
    WAVES,
    PressSurrogate,
    ScanSurrogate,
)
from host_tools.press_models import fit_surrogate as module
from host_tools.press_models.fit_surrogate import degrees, fit_surrogate, held_out_error
from host_tools.press_models.press_samples import BESIDE_TO_MM, PressSamples, draw_beside, draw_parameters

NONE = dict.fromkeys(PARAMETERS, 0.5)
SMALL_INCLUSION = dict.fromkeys(PARAMETERS, 1.0) | {"size_mm": 3.0, "depth_mm": 2.0}
SMALL_BESIDE = SMALL_INCLUSION | {"offset_mm": 2.0}
SMALL_TURNED = NONE | {"size_mm": 1.0, "offset_mm": 2.0}
SMALL_BASELINE = NONE | {"tissue_modulus_kpa": 2.0, "albedo": 1.0}


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Some dozens of terms of the inclusion, four of each wave and of the light beside it instead of thousands."""
    monkeypatch.setattr(module, "INCLUSION_REACH", SMALL_INCLUSION)
    monkeypatch.setattr(module, "BESIDE_REACH", SMALL_BESIDE)
    monkeypatch.setattr(module, "TURNED_REACH", SMALL_TURNED)
    monkeypatch.setattr(module, "BASELINE_REACH", SMALL_BASELINE)


class Presses(NamedTuple):
    near: PressSamples
    beside: PressSamples


@pytest.fixture
def truth() -> ScanSurrogate:
    rng = np.random.default_rng(1)
    columns = INCLUSION_COLUMNS, len(WAVES) * INCLUSION_COLUMNS, RESPONSE_COLUMNS

    def part(reach: dict[str, float], from_mm: float, to_mm: float) -> PressSurrogate:
        terms = (degrees(one, {}) for one in (reach, SMALL_TURNED, SMALL_BASELINE))
        fields = (LegendreSum(k, rng.normal(size=(len(k), count))) for k, count in zip(terms, columns, strict=True))
        return PressSurrogate(*fields, from_mm, to_mm)

    near_to_mm = float(HIGH[OFFSET])
    near = part(SMALL_INCLUSION, float(LOW[OFFSET]), near_to_mm)
    still_on_axis(near.turned_field)
    return ScanSurrogate(near, part(SMALL_BESIDE, near_to_mm, BESIDE_TO_MM))


def still_on_axis(field: LegendreSum) -> None:
    """Make waves add nothing to the contrast at an offset of -1, where Legendre's polynomials are 1, -1 and 1."""
    by_wave = field.coefficients.reshape(len(field.degrees), len(WAVES), INCLUSION_COLUMNS)[:, :, :CONTRAST_COLUMNS]
    by_wave[field.degrees[:, 0] > 0] = 0.0
    of_offset = {k: np.flatnonzero((field.degrees[:, OFFSET] == k) & (field.degrees[:, 0] == 0))[0] for k in range(3)}
    by_wave[of_offset[1]] = by_wave[of_offset[0]] + by_wave[of_offset[2]]


def samples_of(surrogate: ScanSurrogate, count: int, seed: int) -> Presses:
    def part(draw) -> PressSamples:
        rng = np.random.default_rng(seed)
        parameters = draw(count, rng)
        direction_rad = rng.uniform(0, 2 * np.pi, count)
        return PressSamples(parameters, surrogate.rows(normalise(parameters), direction_rad), direction_rad)

    return Presses(part(draw_parameters), part(draw_beside))


def assert_alike(found: PressSurrogate, truth: PressSurrogate) -> None:
    np.testing.assert_array_equal(found.inclusion_field.degrees, truth.inclusion_field.degrees)
    np.testing.assert_allclose(found.inclusion_field.coefficients, truth.inclusion_field.coefficients, atol=1e-8)
    np.testing.assert_array_equal(found.turned_field.degrees, truth.turned_field.degrees)
    np.testing.assert_allclose(found.turned_field.coefficients, truth.turned_field.coefficients, atol=1e-8)
    np.testing.assert_allclose(found.baseline.coefficients, truth.baseline.coefficients, atol=1e-9)
    assert (found.from_mm, found.to_mm) == (truth.from_mm, truth.to_mm)


def test_polynomials_near_and_beside_the_inclusion_are_recovered_from_their_own_rows(truth):
    found = fit_surrogate(*samples_of(truth, 400, seed=2))
    assert_alike(found.near, truth.near)
    assert_alike(found.beside, truth.beside)
    assert len(found.beside.inclusion_field.degrees) > len(found.near.inclusion_field.degrees)


def test_the_error_on_presses_kept_apart_is_that_of_the_rows(truth):
    found, (near, beside) = fit_surrogate(*samples_of(truth, 400, seed=2)), samples_of(truth, 50, seed=3)
    for apart in (near, beside):
        assert held_out_error(found, apart).max() < 1e-8
        apart.rows[:, 7] += 0.01
        assert held_out_error(found, apart)[7] == pytest.approx(0.01, rel=1e-6)
        assert np.delete(held_out_error(found, apart), 7).max() < 1e-8


def test_presses_kept_apart_are_judged_in_their_own_directions(truth):
    found, near = fit_surrogate(*samples_of(truth, 400, seed=2)), samples_of(truth, 50, seed=3).near
    for same in (near.direction_rad + np.pi, -near.direction_rad):
        assert held_out_error(found, replace(near, direction_rad=same)).max() < 1e-8
    turned = held_out_error(found, replace(near, direction_rad=near.direction_rad + np.pi / 2))
    assert turned[RESPONSE].max() < 1e-8
    assert np.delete(turned, np.arange(RESPONSE.start, RESPONSE.stop)).min() > 1e-5


def test_where_a_direction_changes_nothing_nothing_is_turned(truth):
    near, beside = samples_of(truth, 400, seed=2)
    alike = replace(near, rows=truth.rows(normalise(near.parameters)))
    found = fit_surrogate(alike, beside).near
    np.testing.assert_allclose(found.inclusion_field.coefficients, truth.near.inclusion_field.coefficients, atol=1e-8)
    np.testing.assert_allclose(found.turned_field.coefficients, 0.0, atol=1e-8)


def terms_of(surrogate: PressSurrogate) -> int:
    """Return how many terms follow the inclusion: those of the mean over all directions, and of each wave."""
    return len(surrogate.inclusion_field.degrees) + len(WAVES) * len(surrogate.turned_field.degrees)


def test_noise_in_rows_is_averaged_over_presses_and_not_followed(truth):
    (near, beside), std = samples_of(truth, 600, seed=2), 1e-3
    noisy = replace(near, rows=near.rows + np.random.default_rng(4).normal(0, std, near.rows.shape))
    error = held_out_error(fit_surrogate(noisy, beside), near)
    of_inclusion, of_all = len(truth.near.inclusion_field.degrees), terms_of(truth.near)
    low, high = (std * np.sqrt(terms / 600) for terms in (of_inclusion, of_all))  # waves are held on the axis, too
    assert low < np.mean(error[:CONTRAST_COLUMNS]) < high


def test_terms_that_add_nothing_are_left_out_and_those_that_add_most_are_kept(truth, monkeypatch):
    """Half of the terms carry a thousandth of what the others do: as many are kept as carry something."""
    field = truth.near.inclusion_field
    carrying = np.arange(0, len(field.degrees), 2)
    weak = np.delete(np.arange(len(field.degrees)), carrying)
    field.coefficients[weak] *= 1e-3
    monkeypatch.setattr(module, "TERMS", len(carrying))
    samples = samples_of(truth, 400, seed=2)
    found = fit_surrogate(*samples)
    np.testing.assert_array_equal(found.near.inclusion_field.degrees, field.degrees[carrying])
    assert held_out_error(found, samples_of(truth, 50, seed=3).near)[:CONTRAST_COLUMNS].max() < 1e-2


def test_a_baseline_keeps_as_many_terms_as_it_is_given(truth, monkeypatch):
    monkeypatch.setattr(module, "BASELINE_TERMS", 2)
    found = fit_surrogate(*samples_of(truth, 400, seed=2)).near.baseline
    assert len(found.degrees) == len(found.coefficients) == 2


def test_terms_are_all_below_a_total_degree_when_every_parameter_reaches_as_far():
    """There are (9 + n over n) products of nine polynomials up to a total degree n."""
    for reach in (1, 2, 3):
        found = degrees(dict.fromkeys(PARAMETERS, float(reach)), {})
        assert len(found) == len(np.unique(found, axis=0)) == math.comb(9 + reach, reach)
        assert found.sum(axis=1).max() == reach


def test_terms_are_bounded_by_their_reach_together_and_by_their_highest_degree():
    found = degrees(NONE | {"size_mm": 4.0, "depth_mm": 2.0}, {"size_mm": 3})
    assert {tuple(row[:2]) for row in found.tolist()} == {
        (0, 0),
        (1, 0),
        (2, 0),
        (3, 0),
        (0, 1),
        (1, 1),
        (2, 1),
        (0, 2),
    }
    assert not found[:, 2:].any()


@pytest.mark.parametrize("part", ["near", "beside"])
def test_too_few_presses_of_either_kind_are_refused_by_name(truth, part):
    enough = 3 * terms_of(getattr(truth, part))
    plenty = samples_of(truth, 400, seed=2)
    few = {part: getattr(samples_of(truth, enough, seed=2), part)}
    fit_surrogate(*plenty._replace(**few))
    few = {part: getattr(samples_of(truth, enough - 1, seed=2), part)}
    with pytest.raises(InvalidQuantity, match=f"^presses is {enough - 1}, but must be at least {enough} presses"):
        fit_surrogate(*plenty._replace(**few))


@pytest.mark.parametrize("part", [0, 1])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_presses_that_are_not_finite_are_refused_and_counted(truth, value, part):
    samples = samples_of(truth, 300, seed=2)
    samples[part].rows[[4, 17], [3, 60]] = value
    with pytest.raises(InvalidQuantity, match="^presses that are not finite is 2, .* leave them out"):
        fit_surrogate(*samples)


def test_on_the_axis_no_direction_matters_though_no_press_lies_there(truth):
    """Presses that a wave changes evenly at any offset: on the axis what is fitted holds it back, aside it follows."""
    (near, beside), shift = samples_of(truth, 600, seed=2), 0.05
    turned = near.rows + 0.0
    turned[:, CONTRAST] += shift * np.cos(2 * near.direction_rad)[:, None]
    found = fit_surrogate(replace(near, rows=turned), beside)

    def change(offset_mm: float) -> float:
        parameters = np.tile(near.parameters[0], (2, 1))
        parameters[:, OFFSET] = offset_mm
        rows = found.rows(normalise(parameters), np.array([0.0, np.pi / 2]))[:, CONTRAST]
        return float(np.abs(rows[0] - rows[1]).mean())

    assert change(0.0) < 0.5 * change(2.0)
