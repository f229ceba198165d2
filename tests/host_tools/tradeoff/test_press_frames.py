"""Fewer frames and coarser pixels of a recording are what they say."""

from __future__ import annotations

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.radial_profile import press_profile
from device.measurement.recording.recording import Recording
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.tradeoff.press_frames import CHOICES, binned, thinned


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


def test_every_mode_that_reads_frames_so_has_its_choice_marked() -> None:
    assert [(one.family, one.frames) for one in CHOICES if one.chosen] == [
        ("held", 1),
        ("ramp, networks", 10),
        ("ramp, fit", 40),
    ]
