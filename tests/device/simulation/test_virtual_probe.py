"""One scene drives light, image and force: what the emulated chips are told."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from daemon_process import ROOT

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.pixel_scale import PixelScale
from device.simulation.hand import BESIDE_MM
from device.simulation.physics.light_table import load_light_table
from device.simulation.physics.off_axis_table import load_off_axis_table
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.physics.slab import Slab
from device.simulation.scenario import CellSettings, Scenario
from device.simulation.virtual_probe import SIMULATED_PROBE_SHA256, ProbeTables, VirtualProbe

MODELS = ROOT / "models" / "simulated_probe"
SHAPE = (123, 193)
SCALE = PixelScale(0.125, 0.146)
LIT, OFF = (0.6, 0.6, 0.6, 0.6), (0.0, 0.0, 0.0, 0.0)
BESIDE = ProbePlacement(*BESIDE_MM)


@pytest.fixture(scope="module", params=["physical", "linear"])
def probe(request, tables):
    return VirtualProbe(Scenario(light=request.param), tables, SHAPE, SCALE)


def frame(probe, *, force_n=0.5, place=ProbePlacement(), led_ratio=LIT, frame_number=1, **weather):  # noqa: B008
    return probe.frame_counts(
        force_n=force_n,
        place=place,
        led_ratio=led_ratio,
        exposure_us=4000.0,
        gain=1.0,
        frame_number=frame_number,
        **weather,
    )


def light(counts):
    """Mean counts above black of the middle of the face."""
    return counts[51:72, 86:107].mean() - 4


def test_light_rises_with_the_force(probe):
    none, once, twice = (light(frame(probe, force_n=force_n)) for force_n in (0.0, 0.25, 0.5))
    assert none < once < twice


def test_the_inclusion_makes_the_image_brighter(probe):
    assert light(frame(probe)) > 1.05 * light(frame(probe, place=BESIDE))


def test_without_light_the_frame_is_the_black_level(probe):
    """But for a few hot pixels."""
    assert (frame(probe, led_ratio=OFF) == 4).mean() > 0.999


def test_an_inclusion_of_no_size_is_none(tables):
    """On the lesion and beside it the frames are the same."""
    probe = VirtualProbe(Scenario(inclusion=Inclusion(0.0, 6.0, 60.0)), tables, SHAPE, SCALE)
    np.testing.assert_array_equal(frame(probe), frame(probe, place=BESIDE))


def test_the_scenes_tissue_is_what_is_pressed(tables):
    scenario = Scenario(tissue_modulus_kpa=4.4, slab_thickness_mm=28.0)
    nominal, found, expected = (
        frame(VirtualProbe(made_of, tables, SHAPE, SCALE, ramps=ramps))
        for made_of, ramps in (
            (Scenario(), None),
            (scenario, None),
            (Scenario(), tables.centred.ramps(scenario.inclusion, Slab(4.4, 28.0))),
        )
    )
    np.testing.assert_array_equal(found, expected)
    assert (found != nominal).mean() > 0.05


def test_an_untouched_face_is_dark_under_total_internal_reflection(tables):
    """Less than a hundredth of the light of a press; in the linear tier it is the line's intercept."""
    probe = VirtualProbe(Scenario(), tables, SHAPE, SCALE)
    assert light(frame(probe, force_n=0.0)) < 0.01 * light(frame(probe))


def test_light_comes_from_the_leds_that_are_on(probe):
    """Every LED alone, together the frame with all four: linear but for noise and rounding."""
    one_by_one = [frame(probe, led_ratio=tuple(0.6 * (i == side) for i in range(4))) for side in range(4)]
    together = sum(light(counts) for counts in one_by_one)
    assert together == pytest.approx(light(frame(probe)), rel=0.02)


def test_an_led_is_brighter_on_its_own_side(probe):
    right, left = (frame(probe, led_ratio=ratio).astype(float) - 4 for ratio in ((0.6, 0, 0, 0), (0, 0, 0.6, 0)))
    assert right[:, 130:].sum() > 1.1 * right[:, :63].sum()
    np.testing.assert_allclose(right.mean(axis=0), left.mean(axis=0)[::-1], atol=2.0)


def test_gel_on_the_face_takes_the_contrast_of_the_inclusion(probe):
    def contrast(**weather):
        return light(frame(probe, **weather)) / light(frame(probe, place=BESIDE, **weather)) - 1

    assert abs(contrast(wet_ratio=1.0)) < 0.2 * contrast()


def test_foreign_light_falls_on_every_pixel_also_in_the_dark(probe):
    assert light(frame(probe, led_ratio=OFF, ambient_ratio=0.1)) > 20


def test_a_frame_depends_on_its_number_and_the_scenes_seed_alone(probe, tables):
    again = VirtualProbe(probe.scenario, tables, SHAPE, SCALE)
    np.testing.assert_array_equal(frame(probe), frame(again))
    assert (frame(probe) != frame(probe, frame_number=2)).any()
    assert (frame(probe) != frame(VirtualProbe(replace(probe.scenario, seed=2), tables, SHAPE, SCALE))).any()


def test_the_cell_counts_are_zero_point_plus_force(tables):
    probe = VirtualProbe(Scenario(cell=CellSettings(counts_per_n=1000.0, zero_counts=50.0)), tables, SHAPE, SCALE)
    assert probe.cell_counts(0.0) == 50.0
    probe.hand.begin()
    probe.hand.follow("press_beside", 0.0)
    assert probe.cell_counts(5.0) == pytest.approx(50.0 + 1000.0 * probe.hand.force_n(5.0))
    assert probe.cell_counts(5.0) == pytest.approx(550.0, abs=15.0)


@pytest.mark.parametrize("inclusion", [(15.5, 5.0, 80.0), (10.0, 3.5, 80.0), (10.0, 5.0, 310.0)])
def test_an_inclusion_outside_the_table_is_refused(tables, inclusion):
    with pytest.raises(InvalidQuantity, match="inside the table's range"):
        VirtualProbe(Scenario(inclusion=Inclusion(*inclusion)), tables, SHAPE, SCALE)


def test_tables_of_two_scenes_are_refused_together(tmp_path):
    shutil.copytree(MODELS, tmp_path / "tables")
    table = load_off_axis_table(MODELS)
    table.save(tmp_path / "tables", {"scene_defaults": {"tissue": {"youngs_modulus_kpa": 50.0}}, "strain": "small"})
    with pytest.raises(InvalidQuantity, match=r"off axis table's scene is .*50\.0.*host_tools table"):
        ProbeTables.load(tmp_path / "tables")


def test_light_of_another_probe_is_refused_beside_its_mechanics(tmp_path):
    shutil.copytree(MODELS, tmp_path / "tables")
    light = load_light_table(MODELS)
    light.save(tmp_path / "tables", {"probe": {"serial": "TSIS-0007", "sha256": "ab" * 32}})
    with pytest.raises(InvalidQuantity, match=r"light table's probe is abababababab, .* the file of one probe"):
        ProbeTables.load(tmp_path / "tables")
    light.save(tmp_path / "tables", {"probe": {"serial": "SIM-0001", "sha256": SIMULATED_PROBE_SHA256}})
    assert ProbeTables.load(tmp_path / "tables").light.block["half_width_mm"] == 12.0


def test_a_table_of_light_in_an_impossible_block_is_refused_by_name(tmp_path):
    table = load_light_table(MODELS)
    replace(table, block=table.block | {"refractive_index": 0.5}).save(tmp_path, {})
    with pytest.raises(InvalidQuantity, match="light table's refractive_index is 0.5"):
        load_light_table(tmp_path)
