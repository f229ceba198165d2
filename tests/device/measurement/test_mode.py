"""Forces of press frames to the mode that reads most of them, and the names of the modes."""

import numpy as np
import pytest

from device.measurement.mode import FRAMES, MODES, RAMP_FROM_N, RAMP_TO_N, is_possible, mode_named, mode_of
from device.measurement.quantities import InvalidQuantity


def ramp(count: int) -> list[float]:
    return list(np.linspace(RAMP_FROM_N, RAMP_TO_N, count))


@pytest.mark.parametrize("count", [2, 10, 40, 400])
def test_a_ramp_is_read_by_mode_standard_however_many_frames_it_has(count):
    assert mode_of(ramp(count)) == "standard"


@pytest.mark.parametrize("ramps", range(2, FRAMES["precise"].most_ramps + 1))
def test_more_than_one_ramp_on_the_lesion_is_a_scan(ramps):
    assert mode_of(ramp(FRAMES["precise"].count) * ramps, ramps) == "precise"


def test_a_scan_presses_two_to_five_times_on_the_lesion_each_time_as_mode_standard_does():
    precise = FRAMES["precise"]
    assert (precise.count, precise.is_ramp) == (FRAMES["standard"].count, True)
    assert (precise.fewest_ramps, precise.most_ramps) == (2, 5)
    assert [mode for mode in MODES if FRAMES[mode].is_scan] == ["precise"]


@pytest.mark.parametrize("force_n", [[], [0.5, 0.5], [0.5] * 10, [0.49, 0.51, 0.5], [0.26, 0.5], [0.5] * 40])
def test_frames_at_one_force_are_read_as_the_paper_does(force_n):
    assert mode_of(force_n) == "paper"


@pytest.mark.parametrize(("largest_n", "mode"), [(0.399, "paper"), (0.4, "standard")])
def test_a_ramp_begins_where_the_largest_force_is_twice_the_smallest(largest_n, mode):
    assert mode_of([0.3, largest_n, 0.2]) == mode


def test_a_single_frame_is_quick():
    assert mode_of([0.5]) == "quick"


def test_a_first_frame_that_the_cell_reads_below_zero_does_not_hide_a_ramp():
    assert mode_of([-0.002, *ramp(9)]) == "standard"


def test_modes_are_found_by_their_names_and_no_other():
    assert [mode_named(mode) for mode in MODES] == ["quick", "standard", "precise", "paper"]
    with pytest.raises(InvalidQuantity, match="^mode is 'fast', but must be one of quick, standard, precise, paper"):
        mode_named("fast")


def test_a_mode_is_possible_of_the_frames_and_ramps_that_it_takes():
    possible = {
        (mode, frames, ramps)
        for mode in MODES
        for frames in (1, 10, 20)
        for ramps in (0, 1, 2)
        if is_possible(mode, frames, ramps)
    }
    assert possible == {
        ("quick", 1, 1), ("standard", 10, 1), ("paper", 10, 1), ("precise", 10, 1), ("precise", 20, 2)
    }  # fmt: skip
    assert not is_possible("precise", 60, 6)
