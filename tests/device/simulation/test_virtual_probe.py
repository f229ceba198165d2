"""One scene drives light, image and force: what the emulated chips are told."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.tactile_image import PixelScale
from device.simulation.hand import BESIDE_MM, ON_LESION_MM
from device.simulation.scenario import CellSettings, Scenario
from device.simulation.virtual_probe import VirtualProbe

SHAPE = (123, 193)
MIDDLE = 61, 96
SCALE = PixelScale(0.125, 0.146)
LIT = (0.6, 0.6, 0.6, 0.6)


@pytest.fixture(scope="module")
def probe(table):
    return VirtualProbe(Scenario(), table, SHAPE, SCALE)


def frame(probe, *, force_n=0.5, position_mm=ON_LESION_MM, led_ratio=LIT, frame_number=1, **faults):
    return probe.frame_counts(
        force_n=force_n,
        position_mm=position_mm,
        led_ratio=led_ratio,
        exposure_us=4000.0,
        gain=1.0,
        frame_number=frame_number,
        **faults,
    )


def light(counts):
    """Mean counts above black of the middle of the face."""
    return counts[51:72, 86:107].mean() - 4


def test_over_the_lump_the_surface_is_the_tables_plus_the_lump(probe, table):
    surface = probe.surface_mm_per_n(ON_LESION_MM)
    lump = table.lump(Inclusion(10.0, 5.0, 80.0))
    assert surface[MIDDLE] == pytest.approx(table.w_mm_per_n[0] + lump[0], rel=1e-5)
    off_axis = np.interp(24 * 0.125, table.r_mm, table.w_mm_per_n + lump)
    assert surface[61, 96 + 24] == pytest.approx(off_axis, rel=1e-5)


def test_far_beside_the_surface_is_free_of_the_lump(probe, table):
    x, y = SCALE.coordinates_mm(SHAPE)
    expected = np.interp(np.hypot(x, y), table.r_mm, table.w_mm_per_n)
    np.testing.assert_allclose(probe.surface_mm_per_n(BESIDE_MM), expected, rtol=1e-5)


def test_a_probe_moved_to_the_right_sees_the_lump_on_its_left(probe):
    lump = probe.surface_mm_per_n((3.0, 0.0)) - probe.surface_mm_per_n(BESIDE_MM)
    row, column = np.unravel_index(lump.argmax(), lump.shape)
    assert (row, column) == (61, 96 - 24)


def test_twice_the_force_deforms_twice_as_much_and_light_follows(probe):
    """Light is field * (w + 0.15): the step from 0.2 to 0.4 N is the step from 0 to 0.2 N."""
    none, once, twice = (light(frame(probe, force_n=force_n)) for force_n in (0.0, 0.2, 0.4))
    assert twice - once == pytest.approx(once - none, rel=0.01)
    assert once > none > 5


def test_the_lump_makes_the_image_brighter(probe):
    assert light(frame(probe)) > 1.05 * light(frame(probe, position_mm=BESIDE_MM))


def test_without_light_the_frame_is_the_black_level(probe):
    assert (frame(probe, led_ratio=(0.0, 0.0, 0.0, 0.0)) == 4).all()


def test_a_frame_depends_on_its_number_and_the_scenes_seed_alone(probe, table):
    again = VirtualProbe(Scenario(), table, SHAPE, SCALE)
    np.testing.assert_array_equal(frame(probe), frame(again))
    assert (frame(probe) != frame(probe, frame_number=2)).any()
    assert (frame(probe) != frame(VirtualProbe(replace(Scenario(), seed=2), table, SHAPE, SCALE))).any()


def test_the_cell_counts_are_zero_point_plus_force(table):
    probe = VirtualProbe(Scenario(cell=CellSettings(counts_per_n=1000.0, zero_counts=50.0)), table, SHAPE, SCALE)
    assert probe.cell_counts(0.0) == 50.0
    probe.hand.begin()
    probe.hand.follow("press_beside", 0.0)
    assert probe.cell_counts(5.0) == pytest.approx(50.0 + 1000.0 * probe.hand.force_n(5.0))
    assert probe.cell_counts(5.0) == pytest.approx(550.0, abs=15.0)


@pytest.mark.parametrize("inclusion", [(15.5, 5.0, 80.0), (10.0, 3.5, 80.0), (10.0, 5.0, 200.0)])
def test_an_inclusion_outside_the_table_is_refused(table, inclusion):
    with pytest.raises(InvalidQuantity, match="inside the table's range"):
        VirtualProbe(Scenario(inclusion=Inclusion(*inclusion)), table, SHAPE, SCALE)


def test_a_wet_face_looks_the_same_however_hard_it_is_pressed(probe):
    dry, wet = (
        [light(frame(probe, force_n=force_n, wet_ratio=wet_ratio)) for force_n in (0.1, 0.5)] for wet_ratio in (0, 1)
    )
    assert dry[1] > 1.5 * dry[0]
    assert wet[1] == pytest.approx(wet[0], rel=0.01)
    assert wet[0] > 1.5 * dry[0]


def test_foreign_light_is_there_without_leds_and_on_every_pixel(probe):
    """0.05 of full light: 0.05 * 5 e-/us * 4000 us of 10 000 e- are 25.5 counts."""
    counts = frame(probe, led_ratio=(0.0, 0.0, 0.0, 0.0), ambient_ratio=0.05)
    for corner in (counts[:10, :10], counts[-10:, -10:], counts[51:72, 86:107]):
        assert corner.mean() - 4 == pytest.approx(25.5, abs=1.0)
