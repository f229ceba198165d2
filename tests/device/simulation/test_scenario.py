"""A scene file: its defaults, and what in it is refused."""

import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.faults import ScriptedFault
from device.simulation.hand import HandSettings
from device.simulation.physics.image_formation import LinearOptics
from device.simulation.physics.lens import Lens
from device.simulation.physics.sensor import Sensor
from device.simulation.physics.skin import Skin
from device.simulation.physics.slab import Slab
from device.simulation.scenario import CellSettings, Scenario, read_scenario


@pytest.fixture
def read(tmp_path):
    def read_text(text):
        (tmp_path / "scene.toml").write_text(text)
        return read_scenario(tmp_path / "scene.toml")

    return read_text


def test_an_empty_file_is_the_default_scene(read):
    expected = Scenario(Inclusion(12.0, 6.0, 60.0), HandSettings(), "physical", Skin(), Lens(), seed=1)
    assert read("") == Scenario() == expected


def test_what_is_written_holds_and_the_rest_stays(read):
    scenario = read(
        "seed = 7\ntissue_modulus_kpa = 4.4\nslab_thickness_mm = 33\n"
        "[inclusion]\nsize_mm = 4\ndepth_mm = 6.5\nyoungs_modulus_kpa = 100\n"
        "[hand]\naim_n = 0.8\n[sensor]\nread_noise_e = 0\n[cell]\nnoise_counts = 0\n[optics]\nintercept = 0.2\n"
    )
    assert scenario == Scenario(
        Inclusion(4.0, 6.5, 100.0),
        HandSettings(aim_n=0.8),
        optics=LinearOptics(intercept=0.2),
        sensor=Sensor(read_noise_e=0.0),
        cell=CellSettings(noise_counts=0.0),
        tissue_modulus_kpa=4.4,
        slab_thickness_mm=33,
        seed=7,
    )
    assert scenario.slab == Slab(4.4, 33.0)


def test_faults_are_a_list_with_the_code_that_is_expected(read):
    scenario = read(
        'expects = "E203"\n[[faults]]\nkind = "led_dead"\nside = "+y"\nfrom_s = 1\nuntil_s = 2.5\n'
        '[[faults]]\nkind = "camera_stall"\nfrom_press = 2\n[cell]\ndrift_counts_per_s = -5\n'
    )
    assert scenario.faults == (
        ScriptedFault("led_dead", 1, 2.5, side="+y"),
        ScriptedFault("camera_stall", from_press=2),
    )
    assert scenario.expects == "E203"
    assert scenario.cell.drift_counts_per_s == -5


@pytest.mark.parametrize(
    ("text", "key", "action"),
    [
        ("[inclusion]\nsize_cm = 1.0\n", "inclusion.size_cm", "did you mean inclusion.size_mm"),
        ("[hands]\naim_n = 0.5\n", "hands", "did you mean hand"),
        ("[hand]\naim_g = 50\n", "hand.aim_g", "did you mean hand.aim_n"),
    ],
)
def test_an_unknown_key_is_refused_with_what_was_meant(read, text, key, action):
    with pytest.raises(InvalidQuantity) as refusal:
        read(text)
    assert refusal.value.quantity == key
    assert refusal.value.action == action


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("seed = -1", "seed"),
        ("seed = 1.5", "seed"),
        ("tissue_modulus_kpa = 31", "tissue_modulus_kpa"),
        ("slab_thickness_mm = 14", "slab_thickness_mm"),
        ("[inclusion]\nsize_mm = -1\ndepth_mm = 5\nyoungs_modulus_kpa = 80", "size_mm"),
        ("[inclusion]\nsize_mm = 10", "inclusion.depth_mm"),
        ("[hand]\nrate_n_per_s = 0", "hand.rate_n_per_s"),
        ("[optics]\nled_distance_mm = 5", "optics.led_distance_mm"),
        ("[sensor]\nfull_well_e = nan", "sensor.full_well_e"),
        ("[cell]\ncounts_per_n = 0", "cell.counts_per_n"),
        ("[cell]\nzero_counts = 8_000_001", "cell.zero_counts"),
        ("[cell]\nnoise_counts = -1", "cell.noise_counts"),
        ("[cell]\ndrift_counts_per_s = 10_001", "cell.drift_counts_per_s"),
        ('[[faults]]\nkind = "gremlin"', "faults.kind"),
    ],
)
def test_a_value_out_of_its_bound_is_refused_by_its_key(read, text, key):
    with pytest.raises(InvalidQuantity) as refusal:
        read(text)
    assert refusal.value.quantity == key


@pytest.mark.parametrize(
    ("text", "named"), [('light = "laser"', "light is 'laser'"), ("[skin]\nalbedo = -0.1", "skin.albedo")]
)
def test_light_that_cannot_be_is_refused_by_name(read, text, named):
    with pytest.raises(InvalidQuantity, match=named):
        read(text)


def test_each_light_has_a_probe_of_its_own(read):
    assert (read("").serial, read('light = "linear"').serial) == ("SIM-0001", "SIM-LINEAR")
