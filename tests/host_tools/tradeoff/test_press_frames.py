"""Fewer frames and coarser pixels of a recording are what they say."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from small_surrogate import LinearRows, white_noise

from device.measurement.parameters import COUNT, NOMINAL, PARAMETERS, denormalise
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.radial_profile import COLUMNS, press_profile
from device.measurement.recording.recording import Recording
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.press_models.recorded_presses import direction_of_press_rad
from host_tools.press_models.seeds import press_seed
from host_tools.tradeoff import press_frames
from host_tools.tradeoff.press_frames import CHOICES, FITTED, HELD, FrameChoice, ReadPress, binned, thinned


@pytest.fixture(scope="module")
def ramp(tables: ProbeTables) -> Recording:
    protocol = PhantomProtocol(tuple(np.linspace(0.08, 0.6, 12)), frames=1)
    return phantom_recording(Inclusion(12.0, 6.0, 60.0), tables, seed=3, protocol=protocol)


def test_thinning_takes_touched_frames_evenly_and_keeps_the_untouched_ones(ramp: Recording) -> None:
    few = thinned(ramp, 4)
    assert [len(few.with_role(role)) for role in ("dark", "reference", "press")] == [4, 4 + 4, 4]
    pressed_n = [frame.force_n for frame in ramp.with_role("press")]
    assert [frame.force_n for frame in few.with_role("press")] == [pressed_n[k] for k in (0, 4, 7, 11)]


def test_binning_averages_squares_of_pixels_and_keeps_the_face(ramp: Recording) -> None:
    coarse = binned(ramp, 8)
    assert (coarse.camera.width_px, coarse.camera.height_px, coarse.camera.bits) == (96, 61, 16)
    assert coarse.camera.mm_per_px_x == pytest.approx(8 * ramp.camera.mm_per_px_x)
    of_one, of_both = ramp.with_role("press")[-1].counts, coarse.with_role("press")[-1].counts
    assert of_both[0, 0] == pytest.approx(256 * of_one[2:10, :8].mean(), abs=0.5)  # 492 = 2 + 61 * 8 + 2


def test_a_binned_ramp_has_nearly_the_same_profile(ramp: Recording) -> None:
    """Four pixels are an eighth of a millimetre; rings are one wide."""
    fine, coarse = press_profile(ramp).as_row(), press_profile(binned(ramp, 4)).as_row()
    assert np.abs(coarse - fine).max() < 0.02
    assert binned(ramp, 1) is ramp


def test_a_press_is_recorded_in_the_direction_of_the_exact_rows_that_it_is_compared_with(tables: ProbeTables) -> None:
    at = np.array([12.0, 6.0, 60.0, *(NOMINAL | {"offset_mm": 1.5}).values()])
    seed = press_seed(4, 0)
    direction_rad = direction_of_press_rad(seed)
    recordings = press_frames._Recordings(tables, at, seed)
    for choice in (FrameChoice(FITTED, 8), FrameChoice(HELD, 1)):
        for recording in recordings.of(choice):
            assert recording.position_mm == pytest.approx((1.5 * np.cos(direction_rad), 1.5 * np.sin(direction_rad)))
    ramp, _ = recordings.of(FrameChoice(FITTED, 40))
    read = press_frames._read_ramp(ramp)
    assert np.cos(2 * (read.direction_rad - direction_rad)) == pytest.approx([1.0], abs=0.05)
    np.testing.assert_array_equal(read.row, press_profile(ramp).as_row())


def test_a_ramp_is_fitted_in_the_direction_in_which_its_inclusion_lies() -> None:
    """What a direction adds to a linear model is taken for another inclusion where it is not told."""
    rng = np.random.default_rng(5)
    slopes, along = rng.normal(0.0, 0.02, (2, len(PARAMETERS), COLUMNS))
    answers = RampAnswers(LinearRows(slopes, along.sum(axis=0)), white_noise(1e-4))
    model = SimpleNamespace(answers=answers, first_guesses=lambda rows: np.zeros((len(rows), COUNT)))
    at, told = np.full(len(PARAMETERS), 0.1), np.array([0.6])
    read = ReadPress(answers.surrogate.rows(at[None], told)[0], told)
    answer = press_frames._answers(FrameChoice(FITTED, 8), [read], read.row[None], model, None)
    truth = denormalise(at)[:COUNT]
    np.testing.assert_allclose(answer(read), truth, rtol=2e-3)
    assert np.abs(answer(read._replace(direction_rad=None)) / truth - 1).max() > 0.02


def test_every_mode_that_reads_frames_so_has_its_choice_marked() -> None:
    assert [(one.family, one.frames) for one in CHOICES if one.chosen] == [
        ("held", 1),
        ("ramp, fit", 10),
    ]
