"""Late and torn frames, from images that are written down here."""

import numpy as np
import pytest

from device.config import CameraSection
from device.errors import LateFrameError, TornFrameError
from device.instrument.acquisition import frame_check
from device.instrument.acquisition.frame_check import (
    LATE_FRAMES,
    LOOKED_AT_FRAMES,
    TORN_PAIRS,
    FramePace,
    TearWatch,
    blocks,
    largest_step,
)
from device.measurement.recording.tactile_image import Frame

HEIGHT, WIDTH = 120, 160
Y, X = np.mgrid[:HEIGHT, :WIDTH]
RADIUS_PX = np.hypot(Y - HEIGHT / 2, X - WIDTH / 2)


def image(level_counts, seed=1):
    """A face lit in the middle, with the noise of 8-bit counts."""
    light = level_counts * np.exp(-((RADIUS_PX / 60) ** 2))
    return np.rint(np.random.default_rng(seed).normal(light + 4, 1.5)).clip(0, 255).astype(np.uint8)


def torn(upper, lower, row):
    return np.vstack([upper[:row], lower[row:]])


def step_between(one, other):
    return largest_step(blocks(one) - blocks(other))


def frame(counts):
    return Frame(counts, "press", 0.0, 0.5, (0.6,) * 4)


@pytest.mark.parametrize("row", [10, 60, 100])
def test_a_tear_between_light_and_dark_is_seen_at_its_row(row):
    step_counts, at = step_between(torn(image(100), image(0, 2), row), image(100, 3))
    assert step_counts > 10
    assert at == pytest.approx(row, abs=4)


@pytest.mark.parametrize("width", [WIDTH, WIDTH + 5])
def test_blocks_are_the_means_that_numpy_gives_to_the_last_bit(width):
    counts = np.random.default_rng(1).integers(0, 256, (HEIGHT, width), dtype=np.uint8)
    expected = counts[:, : width - width % 8].reshape(HEIGHT, 8, -1).mean(axis=2)
    np.testing.assert_array_equal(blocks(counts), expected)


def test_a_neighbours_blocks_are_kept_for_the_next_frame_and_no_others(monkeypatch):
    """Each frame is summed once, also after one that was dropped; an image of the same counts is another frame."""
    looked_at = []
    monkeypatch.setattr(frame_check, "blocks", lambda counts: looked_at.append(counts) or blocks(counts))
    watch = TearWatch(3.0)
    one, two, three = (frame(image(100, seed)) for seed in range(3))
    assert watch.agree(one, two)
    assert watch.agree(two, three)
    assert len(looked_at) == 3
    assert all(seen is taken.counts for seen, taken in zip(looked_at, (one, two, three), strict=True))
    assert watch.agree(one, frame(one.counts.copy()))
    assert len(looked_at) == 5


def test_noise_and_force_make_no_step():
    """A hand that presses 5 % harder brightens the image smoothly."""
    assert step_between(image(100), image(105, 2))[0] < 3.0


def test_the_round_edge_of_a_growing_contact_is_below_the_limit_that_a_tear_is_far_above():
    """Contact grows as the cube root of the force (Hertz): by 1.7 % over half the force band, here by 2.5 %."""
    small, large = (np.where(radius_px > RADIUS_PX, 104, 4).astype(np.uint8) for radius_px in (40, 41))
    limit_counts = CameraSection().tear_counts
    assert step_between(small, large)[0] < limit_counts
    assert step_between(torn(small, np.full_like(small, 4), 60), small)[0] > 5 * limit_counts


def test_a_tear_between_equal_exposures_is_not_seen():
    assert step_between(torn(image(100), image(100, 2), 60), image(100, 3))[0] < 3.0


def test_a_single_torn_frame_disagrees_with_its_neighbours_and_no_more():
    whole = [frame(image(100, seed)) for seed in range(2)]
    broken = frame(torn(image(100, 5), image(0, 6), 60))
    watch = TearWatch(3.0)
    assert watch.agree(*whole)
    assert not watch.agree(whole[1], broken)
    assert watch.agree(*whole)


def test_of_two_frames_that_disagree_neither_stays():
    one, two, broken = frame(image(100)), frame(image(100, 2)), frame(torn(image(100, 5), image(0, 6), 60))
    watch, kept = TearWatch(3.0), []
    for taken in (one, two, broken, one):
        watch.append(kept, taken)
    assert len(kept) == 2
    assert kept[0] is kept[1] is one


def test_frames_that_are_torn_again_and_again_are_a_fault_with_row_and_step():
    whole, broken = frame(image(100)), frame(torn(image(100, 5), image(0, 6), 60))
    watch = TearWatch(3.0)
    for _ in range(TORN_PAIRS - 1):
        assert not watch.agree(whole, broken)
        assert watch.agree(whole, whole)
    with pytest.raises(TornFrameError, match=r"the last at row \d+ by \d+ counts") as fault:
        watch.agree(whole, broken)
    assert fault.value.code == "E103"
    assert not watch.agree(whole, broken)  # the count begins again


def test_a_camera_that_leaves_out_every_other_frame_is_at_fault_at_the_fourth_late_one():
    pace = FramePace(0.1)
    for asked_s in range(2 * LATE_FRAMES - 2):
        pace.saw(asked_s, asked_s + (0.3 if asked_s % 2 else 0.03))
    pace.saw(10.0, 10.1)  # not above the limit
    with pytest.raises(LateFrameError, match=r"began 0\.30 s after it was asked for") as fault:
        pace.saw(11.0, 11.3)
    assert fault.value.code == "E102"


def test_a_late_frame_now_and_then_is_no_fault():
    """One of every three: 3 of any 8 in a row, one fewer than a fault."""
    pace = FramePace(0.1)
    for asked_s in range(3 * LOOKED_AT_FRAMES):
        pace.saw(asked_s, asked_s + (0.5 if asked_s % 3 == 0 else 0.03))
