"""Random presses are drawn as the priors say; rows and second harmonics are what a recording of the press gives."""

import numpy as np
import pytest

from device.measurement.parameters import HIGH, LOW, NOMINAL, NUISANCES, PARAMETERS, normalise
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.radial_profile import RAMP_HIGH_N, press_profile
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, OFFSET, RESPONSE_COLUMNS
from device.measurement.recording.ring_means import RINGS
from device.simulation.physics.pressed_face import ProbePlacement
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.press_models.press_samples import (
    NEAREST_MM,
    PressSamples,
    draw_parameters,
    exact_presses,
    profile_rows,
    sample_presses,
)

COUNT = 20_000
SLAB = PARAMETERS.index("slab_thickness_mm")
INCLUSION = Inclusion(12.0, 6.0, 60.0)


@pytest.fixture(scope="module")
def drawn() -> np.ndarray:
    return draw_parameters(COUNT, np.random.default_rng(1))


def at(inclusion: Inclusion, **changed: float) -> np.ndarray:
    return np.array([*inclusion.as_tuple(), *(NOMINAL | changed).values()])


def test_parameters_fill_their_ranges_and_no_more(drawn):
    assert (drawn >= LOW - 1e-12).all()
    assert (drawn <= HIGH + 1e-12).all()
    np.testing.assert_allclose(normalise(drawn).min(axis=0), -1, atol=0.05)
    np.testing.assert_allclose(normalise(drawn).max(axis=0), 1, atol=0.02)


@pytest.mark.parametrize("name", [name for name in PARAMETERS if name not in ("size_mm", "depth_mm", "offset_mm")])
def test_what_is_not_redrawn_is_even_over_its_range(drawn, name):
    """Mean 0 and variance 1/3 of its coordinate, within five standard errors."""
    normalised = normalise(drawn)[:, PARAMETERS.index(name)]
    assert normalised.mean() == pytest.approx(0, abs=5 * np.sqrt(1 / 3 / COUNT))
    assert np.mean(normalised**2) == pytest.approx(1 / 3, abs=5 * np.sqrt(4 / 45 / COUNT))


def test_the_offset_is_even_over_its_disk(drawn):
    """As many inclusions lie within 1 / sqrt(2) of the disk's radius as beyond it."""
    offset = np.sort(drawn[:, OFFSET])
    even = HIGH[OFFSET] * np.sqrt((np.arange(COUNT) + 0.5) / COUNT)
    assert np.abs(offset - even).max() < 0.05


def test_inclusions_end_above_the_slabs_base():
    drawn = draw_parameters(COUNT, np.random.default_rng(1))
    clearance = drawn[:, SLAB] - drawn[:, 0] - drawn[:, 1]
    assert NEAREST_MM <= clearance.min() < NEAREST_MM + 1


def test_consecutive_inclusions_share_tissue_and_skin_but_not_their_place():
    drawn = draw_parameters(8, np.random.default_rng(2), inclusions_a_skin=3)
    shared = [PARAMETERS.index(name) for name in NUISANCES if name != "offset_mm"]
    own = [0, 1, 2, OFFSET]
    groups = np.split(drawn, [3, 6])
    for group in groups:
        np.testing.assert_array_equal(group[:, shared], np.tile(group[0, shared], (len(group), 1)))
        assert all(len(np.unique(group[:, column])) == len(group) for column in own)
    assert len({tuple(group[0, shared]) for group in groups}) == 3


def test_the_same_seed_draws_the_same_parameters():
    first, again, other = (draw_parameters(5, np.random.default_rng(seed)) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert (first != other).all()


@pytest.fixture(scope="module")
def row(tables) -> np.ndarray:
    return profile_rows(tables, at(INCLUSION)[None])[0]


def test_a_row_is_the_profile_of_a_recording_of_the_same_press(tables, row):
    """What is left is the noise of camera and cell, averaged over 24 frames, and the polynomial in the force."""
    ramp = PhantomProtocol(tuple(np.linspace(0.09, RAMP_HIGH_N + 0.08, 24)), frames=1)
    recorded = press_profile(phantom_recording(INCLUSION, tables, seed=1, protocol=ramp)).as_row()
    assert row[0] > 0.02
    np.testing.assert_allclose(row[:CONTRAST_COLUMNS], recorded[:CONTRAST_COLUMNS], atol=3e-3)
    reference_response = slice(CONTRAST_COLUMNS, CONTRAST_COLUMNS + RESPONSE_COLUMNS)
    np.testing.assert_allclose(row[reference_response], recorded[reference_response], atol=0.01)
    np.testing.assert_allclose(row[reference_response.stop :], recorded[reference_response.stop :], atol=1e-3)


def test_several_inclusions_on_one_skin_give_the_rows_that_each_gives_alone(tables, row):
    soft = at(Inclusion(8.0, 5.0, 100.0), albedo=0.45)
    together = profile_rows(tables, np.array([at(INCLUSION), soft, at(INCLUSION)]))
    np.testing.assert_array_equal(together[0], row)
    np.testing.assert_array_equal(together[2], row)
    np.testing.assert_array_equal(together[1], profile_rows(tables, soft[None])[0])


def test_an_inclusion_beside_the_axis_shows_in_the_offset(tables):
    beside = profile_rows(tables, at(INCLUSION, offset_mm=1.5)[None])[0]
    assert beside[CONTRAST_COLUMNS + RESPONSE_COLUMNS :].max() > 5e-3


OFFSETS_MM = (0.0, 1.0, 2.0)


@pytest.fixture(scope="module")
def second(tables) -> np.ndarray:
    """Second harmonics [3, K, J - 2] of an inclusion at each offset."""
    found = exact_presses(tables, np.array([at(INCLUSION, offset_mm=offset_mm) for offset_mm in OFFSETS_MM]))[1]
    return found.reshape(len(OFFSETS_MM), -1, RINGS - 2)


def test_an_inclusion_on_the_axis_has_no_second_harmonic_and_one_beside_it_has(second):
    """Bright towards both sides where the spot falls off, and across them nearer to its middle."""
    np.testing.assert_allclose(second[0], 0.0, atol=1e-6)
    assert second[2].max() > 1e-2
    assert second[2].min() < -5e-3


def test_the_second_harmonic_is_one_of_the_square_of_the_offset(second):
    """Half the offset, a quarter as much; the tables' own steps and the next order leave 2e-4 where it is 1e-2."""
    np.testing.assert_allclose(second[1], second[2] / 4, atol=2e-4)


def test_second_harmonics_are_those_of_a_recording_of_the_same_press(tables):
    """Whichever side the inclusion lies on, they are told along it, and nothing is left across."""
    side, offset_mm = 0.8, 1.5
    place = ProbePlacement(offset_mm * np.cos(side), offset_mm * np.sin(side))
    ramp = PhantomProtocol(tuple(np.linspace(0.09, RAMP_HIGH_N + 0.08, 24)), frames=1, place=place)
    recorded = press_profile(phantom_recording(INCLUSION, tables, seed=1, protocol=ramp)).second_harmonic
    rows, second = exact_presses(tables, at(INCLUSION, offset_mm=offset_mm)[None])
    along = second.reshape(1, -1, RINGS - 2)[0]
    np.testing.assert_array_equal(rows, profile_rows(tables, at(INCLUSION, offset_mm=offset_mm)[None]))
    assert along.max() > 5e-3
    np.testing.assert_allclose(recorded[0], along, atol=1e-3)
    np.testing.assert_allclose(recorded[1], 0.0, atol=1e-3)


def test_presses_are_split_with_all_that_belongs_to_them():
    samples = PressSamples(*(np.random.default_rng(6).normal(size=(5, columns)) for columns in (9, 87, 36)))
    for part, chosen in zip(samples.split(2), (slice(0, 2), slice(2, 5)), strict=True):
        for name in ("parameters", "rows", "second_harmonics"):
            np.testing.assert_array_equal(getattr(part, name), getattr(samples, name)[chosen])


def test_the_same_seed_gives_the_same_presses(tables):
    """Seed 13 draws two inclusions near 95 kPa."""
    done: list[int] = []
    first = sample_presses(tables, 2, seed=13, jobs=1, on_done=done.append)
    rows, second_harmonics = exact_presses(tables, first.parameters)
    np.testing.assert_array_equal(first.rows, rows)
    np.testing.assert_array_equal(first.second_harmonics, second_harmonics)
    np.testing.assert_array_equal(first.parameters, draw_parameters(2, np.random.default_rng(13), inclusions_a_skin=3))
    assert sum(done) == len(first.rows) == 2
