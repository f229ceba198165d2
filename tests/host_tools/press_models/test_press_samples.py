"""Random presses are drawn as the priors say; rows are what a recording of the press gives."""

import numpy as np
import pytest
from joblib import parallel_config

from device.measurement.parameters import (
    ABOVE_BASE_MM,
    ELASTIC_MISMATCHES,
    HIGH,
    LOW,
    NEAR_NOMINAL,
    NOMINAL,
    NUISANCES,
    PARAMETERS,
    elastic_mismatch,
    is_possible,
    normalise,
)
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.ramp_modes.radial_profile import CONTRAST, FIRST, RAMP_HIGH_N, RESPONSE, SECOND, press_profile
from device.measurement.ramp_modes.surrogate import OFFSET
from device.measurement.recording.ring_means import RINGS
from device.simulation.physics.pressed_face import ProbePlacement
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.press_models import press_samples as module
from host_tools.press_models.press_samples import (
    BESIDE_TO_MM,
    INCLUSIONS_A_SKIN,
    PressSamples,
    draw_around,
    draw_beside,
    draw_parameters,
    profile_rows,
    sample_presses,
)

COUNT = 20_000
SLAB, TISSUE = PARAMETERS.index("slab_thickness_mm"), PARAMETERS.index("tissue_modulus_kpa")
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


@pytest.mark.parametrize("name", [name for name in NUISANCES[2:] if name != "offset_mm"])
def test_a_skin_is_even_over_its_range(drawn, name):
    """Mean 0 and variance 1/3 of its coordinate, within five standard errors."""
    normalised = normalise(drawn)[:, PARAMETERS.index(name)]
    assert normalised.mean() == pytest.approx(0, abs=5 * np.sqrt(1 / 3 / COUNT))
    assert np.mean(normalised**2) == pytest.approx(1 / 3, abs=5 * np.sqrt(4 / 45 / COUNT))


def test_the_offset_is_even_over_its_disk(drawn):
    """As many inclusions lie within 1 / sqrt(2) of the disk's radius as beyond it."""
    offset = np.sort(drawn[:, OFFSET])
    even = HIGH[OFFSET] * np.sqrt((np.arange(COUNT) + 0.5) / COUNT)
    assert np.abs(offset - even).max() < 0.05


@pytest.mark.parametrize("inclusions_a_skin", [1, 3])
def test_what_is_drawn_is_possible_up_to_its_ends(inclusions_a_skin):
    drawn = draw_parameters(COUNT, np.random.default_rng(1), inclusions_a_skin=inclusions_a_skin)
    clearance = drawn[:, SLAB] - drawn[:, 0] - drawn[:, 1]
    assert is_possible(drawn).all()
    assert ABOVE_BASE_MM <= clearance.min() < ABOVE_BASE_MM + 1
    mismatch = elastic_mismatch(drawn[:, 2], drawn[:, TISSUE])
    np.testing.assert_allclose((mismatch.min(), mismatch.max()), ELASTIC_MISMATCHES, atol=0.02)


@pytest.mark.parametrize("draw", [draw_parameters, draw_beside])
def test_tissue_is_drawn_near_the_nominal_where_that_is_asked_for(draw):
    drawn = draw(COUNT, np.random.default_rng(1), ranges=NEAR_NOMINAL)
    assert is_possible(drawn).all()
    for name in ("tissue_modulus_kpa", "slab_thickness_mm"):
        ends, (low, high, _) = drawn[:, PARAMETERS.index(name)], NEAR_NOMINAL[name]
        assert low <= ends.min() < low * 1.01
        assert high >= ends.max() > high / 1.01


def test_tissue_is_drawn_around_inclusions_that_are_told():
    inclusions = np.tile([(12.0, 9.0, 20.0), (3.0, 4.0, 160.0)], (200, 1))
    drawn = draw_around(inclusions, np.random.default_rng(1))
    np.testing.assert_array_equal(drawn[:, :3], inclusions)
    assert is_possible(drawn).all()
    assert drawn[::2, SLAB].min() >= 12.0 + 9.0 + ABOVE_BASE_MM > drawn[1::2, SLAB].min()
    assert drawn[::2, TISSUE].max() < 20.0 < drawn[1::2, TISSUE].max()


def test_an_inclusion_that_no_tissue_holds_is_refused_by_what_it_is():
    with pytest.raises(InvalidQuantity, match="^inclusion is 12 mm, 9 mm deep, 4 kPa, but must be possible"):
        draw_around(np.array([(12.0, 9.0, 4.0)]), np.random.default_rng(1), ranges=NEAR_NOMINAL)


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


def test_presses_beside_the_inclusion_are_the_same_but_for_offsets_even_over_what_is_left():
    """From 2 mm, where those of one press end, to 8 mm: mean 5 mm and variance 36 / 12, within five standard errors."""
    beside, near = (
        draw(COUNT, np.random.default_rng(1), inclusions_a_skin=3) for draw in (draw_beside, draw_parameters)
    )
    np.testing.assert_array_equal(beside[:, :OFFSET], near[:, :OFFSET])
    offset_mm = beside[:, OFFSET]
    assert (HIGH[OFFSET], BESIDE_TO_MM) == (2.0, 8.0)
    assert HIGH[OFFSET] <= offset_mm.min() < HIGH[OFFSET] + 0.01
    assert BESIDE_TO_MM - 0.01 < offset_mm.max() <= BESIDE_TO_MM
    assert offset_mm.mean() == pytest.approx(5.0, abs=5 * np.sqrt(3 / COUNT))
    assert offset_mm.var() == pytest.approx(3.0, rel=5 * np.sqrt(0.8 / COUNT))


@pytest.fixture(scope="module")
def row(tables) -> np.ndarray:
    return profile_rows(tables, at(INCLUSION)[None])[0]


def test_a_row_is_the_profile_of_a_recording_of_the_same_press(tables, row):
    """What is left is the noise of camera and cell, averaged over 24 frames, and the polynomial in the force."""
    ramp = PhantomProtocol(tuple(np.linspace(0.09, RAMP_HIGH_N + 0.08, 24)), frames=1)
    recorded = press_profile(phantom_recording(INCLUSION, tables, seed=1, protocol=ramp)).as_row()
    assert row[0] > 0.02
    for columns, atol in ((CONTRAST, 3e-3), (RESPONSE, 0.01), (FIRST, 2e-3), (SECOND, 2e-3)):
        np.testing.assert_allclose(row[columns], recorded[columns], atol=atol)


def test_several_inclusions_on_one_skin_give_the_rows_that_each_gives_alone(tables, row):
    soft = at(Inclusion(8.0, 5.0, 100.0), albedo=0.45)
    together = profile_rows(tables, np.array([at(INCLUSION), soft, at(INCLUSION)]))
    np.testing.assert_array_equal(together[0], row)
    np.testing.assert_array_equal(together[2], row)
    np.testing.assert_array_equal(together[1], profile_rows(tables, soft[None])[0])


OFFSETS_MM = (0.0, 1.0, 2.0, 5.0)


@pytest.fixture(scope="module")
def aside(tables) -> np.ndarray:
    """Rows [4, P] of an inclusion at each offset."""
    return profile_rows(tables, np.array([at(INCLUSION, offset_mm=offset_mm) for offset_mm in OFFSETS_MM]))


def test_an_inclusion_on_the_axis_has_no_harmonics_and_one_beside_it_has(aside):
    """A second one is bright towards both sides, nearer to its middle too: a solve in three dimensions says so.

    Single precision of the images and the tables' own steps leave 1e-5.
    """
    np.testing.assert_allclose(aside[0, FIRST.start :], 0.0, atol=1e-5)
    assert aside[2, FIRST].max() > 1e-2
    assert aside[2, SECOND].max() > 1e-2
    assert aside[2, SECOND].min() > 5e-4


def test_near_the_axis_the_second_harmonic_is_one_of_the_square_of_the_offset(aside):
    """Half the offset, a quarter as much; the tables' own steps and the next order leave 2e-4 where it is 1e-2."""
    np.testing.assert_allclose(aside[1, SECOND], aside[2, SECOND] / 4, atol=2e-4)


def test_beside_an_inclusion_the_middle_is_darker_and_the_rim_brighter(aside):
    middle, rim = CONTRAST.start, slice(CONTRAST.start + 8, CONTRAST.start + 10)
    assert aside[3, middle] < 0.7 * aside[0, middle]
    assert aside[3, FIRST].max() > aside[2, FIRST].max()
    assert (aside[3, rim] > aside[0, rim]).all()


SIDE = 0.3
TURNED = SIDE, SIDE + np.pi / 2, SIDE + np.pi, -SIDE, SIDE + np.pi / 4
QUARTER, HALF, MIRRORED, EIGHTH = 1, 2, 3, 4


@pytest.fixture(scope="module", params=[1.5, 5.0])
def in_directions(tables, request) -> np.ndarray:
    """Rows [5, P] of an inclusion at one offset in the directions `TURNED`."""
    parameters = np.tile(at(INCLUSION, offset_mm=request.param), (len(TURNED), 1))
    return profile_rows(tables, parameters, np.array(TURNED))


def without_outermost(row: np.ndarray) -> np.ndarray:
    """Return all of a row but the contrast and the first harmonic of the outermost ring, which the frame cuts."""
    contrast, first = row[CONTRAST].reshape(-1, RINGS)[:, :-1], row[FIRST].reshape(-1, RINGS - 1)[:, :-1]
    return np.concatenate([contrast.ravel(), row[RESPONSE], first.ravel(), row[SECOND]])


def test_a_press_from_the_other_side_or_mirrored_at_the_images_rows_is_the_same(in_directions):
    """Frame and LEDs are as symmetric as that; single precision of the images leaves 1e-5."""
    for same in (HALF, MIRRORED):
        np.testing.assert_allclose(in_directions[same], in_directions[0], atol=2e-5)


def test_after_a_quarter_of_a_turn_a_press_is_the_same_but_for_what_the_frame_cuts_off(in_directions):
    """Four LEDs light the face alike then; the pixels, which are not square, leave 3e-5."""
    first, quarter = in_directions[0], in_directions[QUARTER]
    np.testing.assert_allclose(without_outermost(quarter), without_outermost(first), atol=5e-5)
    assert np.abs(quarter - first).max() > 1e-3


def test_after_an_eighth_of_a_turn_the_leds_light_another_press(in_directions):
    assert np.abs(without_outermost(in_directions[EIGHTH]) - without_outermost(in_directions[0])).max() > 1e-4


def test_a_press_lies_along_the_images_rows_unless_its_direction_is_told(tables):
    parameters = at(INCLUSION, offset_mm=1.5)[None]
    np.testing.assert_array_equal(profile_rows(tables, parameters), profile_rows(tables, parameters, np.zeros(1)))


@pytest.mark.parametrize("offset_mm", [1.5, 5.0])
def test_harmonics_are_those_of_a_recording_of_the_same_press(tables, offset_mm):
    """Whichever side the inclusion lies on, they are told along it, and nothing is left across."""
    side = 0.8
    place = ProbePlacement(offset_mm * np.cos(side), offset_mm * np.sin(side))
    ramp = PhantomProtocol(tuple(np.linspace(0.09, RAMP_HIGH_N + 0.08, 24)), frames=1, place=place)
    recorded = press_profile(phantom_recording(INCLUSION, tables, seed=1, protocol=ramp))
    (row,) = profile_rows(tables, at(INCLUSION, offset_mm=offset_mm)[None], np.array([side]))
    assert row[SECOND].max() > 5e-3
    found = recorded.as_row()
    np.testing.assert_allclose(found[FIRST], row[FIRST], atol=2e-3)
    np.testing.assert_allclose(found[SECOND], row[SECOND], atol=2e-3)
    np.testing.assert_allclose(recorded.second_harmonic[1], 0.0, atol=2e-3)
    by_rad = recorded.direction_rad - side
    assert np.cos(2 * by_rad) == pytest.approx(1.0, abs=0.01)  # as half a turn changes nothing, either side does


def test_presses_are_split_with_all_that_belongs_to_them():
    rng = np.random.default_rng(6)
    samples = PressSamples(rng.normal(size=(5, 9)), rng.normal(size=(5, 153)), rng.normal(size=5))
    for part, chosen in zip(samples.split(2), (slice(0, 2), slice(2, 5)), strict=True):
        for name in ("parameters", "rows", "direction_rad"):
            np.testing.assert_array_equal(getattr(part, name), getattr(samples, name)[chosen])


@pytest.mark.parametrize("draw", [draw_parameters, draw_beside])
def test_the_same_seed_gives_the_same_presses(tables, draw):
    """Seed 13 draws two inclusions near 95 kPa."""
    done: list[int] = []
    first = sample_presses(tables, 2, seed=13, draw=draw, jobs=1, on_done=done.append)
    np.testing.assert_array_equal(first.rows, profile_rows(tables, first.parameters, first.direction_rad))
    np.testing.assert_array_equal(first.parameters, draw(2, np.random.default_rng(13), inclusions_a_skin=3))
    assert sum(done) == len(first.rows) == 2


def test_presses_lie_in_the_same_directions_whatever_the_jobs(tables, monkeypatch):
    """Chunks of one skin: presses keep their own directions in each of them."""
    pressed: list[tuple[np.ndarray, np.ndarray]] = []

    def press(tables, parameters, direction_rad):
        pressed.append((parameters, direction_rad))
        return np.column_stack([parameters, direction_rad])

    monkeypatch.setattr(module, "profile_rows", press)
    monkeypatch.setattr(module, "CHUNK", 1)
    with parallel_config(backend="threading"):
        one, two = (sample_presses(tables, 200, seed=13, jobs=jobs) for jobs in (1, 2))
    assert max(len(directions) for _, directions in pressed) == INCLUSIONS_A_SKIN
    for found in (one, two):
        np.testing.assert_array_equal(found.rows, np.column_stack([found.parameters, found.direction_rad]))
    np.testing.assert_array_equal(one.rows, two.rows)
    assert (one.direction_rad != sample_presses(tables, 200, seed=14, jobs=1).direction_rad).all()
    for order in (1, 2, 4):  # even over the circle: a mean of n strays by sqrt(1 / 2 n)
        assert abs(np.exp(1j * order * one.direction_rad).mean()) < 5 * np.sqrt(0.5 / 200)
