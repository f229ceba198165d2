"""Simulated phantoms are recorded by the same probe as the daemon simulates: otherwise a calibration would not hold."""

import math
from dataclasses import replace

import numpy as np
import pytest

from device.config import simulated_config
from device.instrument.press import capture
from device.measurement.mode import FRAMES
from device.measurement.paper_mode.estimate import image_features
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.recording import RecordedCell
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.physics.sensor import Sensor
from device.simulation.physics.world import World
from device.simulation.scenario import Scenario
from host_tools.calibration import phantom
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.calibration.phantom_sets import breast_imager, random_set


def test_phantoms_are_recorded_with_the_simulated_probes_settings():
    config = simulated_config()
    camera = config.camera
    assert config.serial == Scenario().serial
    assert (camera.height_px, camera.width_px) == (phantom.CAMERA.height_px, phantom.CAMERA.width_px)
    assert camera.scale == phantom.CAMERA.scale
    assert (camera.exposure_us, camera.gain) == (phantom.CAMERA.exposure_us, phantom.CAMERA.gain)
    assert config.light.ratio == phantom.LIT
    assert config.cell.sensitivity_counts_per_n == Scenario().cell.counts_per_n
    assert (config.press.target_n, FRAMES["paper"].count) == (phantom.TARGET_N, phantom.PRESS_FRAMES)
    assert capture.UNLOADED_FRAMES == phantom.UNLOADED_FRAMES


def test_a_ramp_has_frames_at_each_force_on_the_lesion_and_beside_it(tables):
    protocol = PhantomProtocol((0.2, 0.4), frames=2, place=ProbePlacement(x_mm=6.0))
    recording = phantom_recording(Inclusion(12.0, 6.0, 60.0), tables, seed=1, protocol=protocol)
    forces = [frame.force_n for frame in recording.with_role("press")]
    assert forces == pytest.approx([0.2, 0.2, 0.4, 0.4], abs=0.03)
    assert len(recording.with_role("reference")) == phantom.UNLOADED_FRAMES + 4
    assert recording.position_mm == (6.0, 0.0)
    assert recording.cell == RecordedCell(100_000.0, 8200.0)


SCAN = PhantomProtocol((0.2, 0.4), frames=2, further_places=(ProbePlacement(y_mm=4.0), ProbePlacement(x_mm=-6.0)))


def test_a_scan_presses_the_lesion_at_every_place_after_one_reference(tables):
    recording = phantom_recording(Inclusion(12.0, 6.0, 60.0), tables, seed=1, protocol=SCAN)
    assert len(recording.with_role("reference")) == phantom.UNLOADED_FRAMES + 4
    ramps = recording.ramps()
    assert list(ramps) == [0, 1, 2]
    for frames in ramps.values():
        assert [frame.force_n for frame in frames] == pytest.approx([0.2, 0.2, 0.4, 0.4], abs=0.03)
    assert [frame.t_s for frame in recording.frames] == sorted(frame.t_s for frame in recording.frames)


def test_further_places_show_the_inclusion_on_another_side(tables):
    """Pressed 4 mm further along y it lies towards -y: there the image is brighter than beside the middle."""
    recording = phantom_recording(Inclusion(12.0, 6.0, 60.0), tables, seed=1, protocol=SCAN)
    height, width = recording.camera.height_px, recording.camera.width_px
    first, along_y, along_x = (frames[-1].counts.astype(float) for frames in recording.ramps().values())

    def difference(counts, axis):
        halves = np.split(counts - first, 2, axis=axis)
        return halves[1].mean() - halves[0].mean()

    assert (height % 2, width % 2) == (0, 0)
    assert abs(difference(along_y, 0)) > 5 * abs(difference(along_y, 1))
    assert abs(difference(along_x, 1)) > 5 * abs(difference(along_x, 0))


def test_further_places_leave_the_first_press_as_it_is_and_make_another_recording(tables):
    one = phantom_recording(Inclusion(12.0, 6.0, 60.0), tables, seed=1, protocol=replace(SCAN, further_places=()))
    scan = phantom_recording(Inclusion(12.0, 6.0, 60.0), tables, seed=1, protocol=SCAN)
    assert scan.id != one.id
    for alone, first in zip(one.frames, scan.frames, strict=False):
        np.testing.assert_array_equal(alone.counts, first.counts)
        assert alone.force_n == first.force_n


def test_a_world_with_another_cell_reports_forces_of_another_scale_for_the_same_frames(tables):
    def recorded(world):
        protocol = PhantomProtocol((0.3, 0.5), frames=1)
        scenario = Scenario(world=world)
        return phantom_recording(Inclusion(10.0, 6.0, 60.0), tables, seed=2, protocol=protocol, scenario=scenario)

    usual, off = recorded(World()), recorded(World(cell_span_ratio=1.02))
    for one, other in zip(usual.frames, off.frames, strict=True):
        np.testing.assert_array_equal(one.counts, other.counts)
    forces, reported = ([frame.force_n for frame in each.with_role("press")] for each in (usual, off))
    np.testing.assert_allclose(np.subtract(reported, forces), 0.02 * np.array(forces), atol=1e-4)


def test_frames_of_ten_bits_are_recorded_in_sixteen(tables):
    scenario = Scenario(sensor=Sensor(bits=10))
    recording = phantom_recording(
        Inclusion(12.0, 6.0, 60.0), tables, seed=1, protocol=PhantomProtocol(frames=1), scenario=scenario
    )
    assert recording.camera.bits == 16
    assert 255 * 64 < max(int(frame.counts.max()) for frame in recording.frames) <= 1023 * 64


@pytest.mark.parametrize(
    ("protocol", "named"),
    [
        ({"forces_n": ()}, "forces_n"),
        ({"forces_n": (-0.1,)}, "forces_n"),
        ({"forces_n": (math.nan,)}, "forces_n"),
        ({"frames": 0}, "frames"),
    ],
)
def test_a_protocol_that_nobody_can_press_is_refused_by_name(protocol, named):
    with pytest.raises(InvalidQuantity, match=f"^{named} is"):
        PhantomProtocol(**protocol)


def test_the_breast_imagers_inclusions_are_the_published_ones():
    """Egorov & Sarvazyan 2008, table II: 5-18 mm and 10-156 kPa, 10 mm deep in 35 mm of 5 kPa."""
    phantoms = list(breast_imager())
    assert [p.inclusion.as_tuple()[::2] for p in phantoms][::3] == [(5, 20), (10, 40), (18, 20)]
    assert {p.inclusion.depth_mm for p in phantoms} == {10.0}
    assert {p.scene.tissue.thickness_mm for p in phantoms} == {35.0}


def test_random_phantoms_fill_the_box_and_come_again_with_their_seed():
    truths = np.array([p.inclusion.as_tuple() for p in random_set(200, seed=4)])
    assert (truths.min(axis=0) >= (2.0, 4.0, 40.0)).all()
    assert (truths.max(axis=0) <= (15.0, 12.0, 120.0)).all()
    assert np.ptp(truths, axis=0) == pytest.approx((13.0, 8.0, 80.0), rel=0.1)
    np.testing.assert_array_equal(truths[:3], [p.inclusion.as_tuple() for p in random_set(3, seed=4)])


@pytest.mark.long
def test_a_phantom_in_a_thicker_slab_is_solved_for_itself(tables):
    """Its face yields more under the same force than the table's 30 mm slab: the press goes deeper, w changes little,
    and the inclusion is one that the table does not hold."""
    one = next(breast_imager())
    ramps = one.ramps()
    assert ramps.baseline.at(0.5).w_mm[0] == pytest.approx(
        tables.centred.ramps(Inclusion(0.0, 5.0, 80.0)).baseline.at(0.5).w_mm[0], rel=0.1
    )
    recording = phantom_recording(one.inclusion, tables, seed=1, protocol=PhantomProtocol(frames=1), ramps=ramps)
    assert recording.truth == one.inclusion


def test_eight_presses_of_one_phantom_have_the_same_features(tables, calibration):
    """The forces differ by a per cent; peak, sum and area of the contrast scatter by less than half a per cent."""
    one = Inclusion(12.0, 6.0, 60.0)
    settings = calibration.lines.settings
    rows = [image_features(phantom_recording(one, tables, seed=s), settings).mean(axis=0) for s in range(8)]
    assert (np.std(rows, axis=0) < 0.005 * np.mean(rows, axis=0)).all()
