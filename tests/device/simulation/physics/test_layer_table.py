"""The table of what other layers change, as the virtual probe reads it."""

import shutil
from dataclasses import fields, replace

import numpy as np
import pytest
from daemon_process import ROOT

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.physics.layer_table import SOLVED_RATIOS, LayerRatios, load_layer_table
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.world import World
from device.simulation.scenario import read_scenario
from device.simulation.virtual_probe import ProbeTables

MODELS = ROOT / "models" / "simulated_probe"
INCLUSION = Inclusion(9.0, 6.0, 70.0)
NAMES = [field.name for field in fields(LayerRatios)]


def fields_of(tables, layers, slab=NOMINAL):
    ramps = tables.ramps(INCLUSION, slab, World(layers=layers))
    return np.stack([ramps.baseline.fields_per_n, ramps.inclusion_field.fields_per_n])


def test_layers_as_tabulated_change_nothing(tables):
    ramps = tables.ramps(INCLUSION, NOMINAL, World())
    known = tables.centred.ramps(INCLUSION)
    np.testing.assert_array_equal(ramps.baseline.fields_per_n, known.baseline.fields_per_n)
    np.testing.assert_array_equal(ramps.inclusion_field.fields_per_n, known.inclusion_field.fields_per_n)


@pytest.mark.parametrize("name", NAMES)
def test_at_the_ratios_that_were_solved_the_change_is_the_tables(tables, name):
    layer, usual = NAMES.index(name), fields_of(tables, LayerRatios())
    for at, ratio in enumerate(SOLVED_RATIOS[name]):
        change = fields_of(tables, LayerRatios(**{name: ratio}))[0] - usual[0]
        np.testing.assert_allclose(change, tables.layers.bare_change_per_n[layer, at], atol=1e-12)


def test_changes_of_several_layers_add_up_and_are_smooth_in_the_ratio(tables):
    usual = fields_of(tables, LayerRatios())
    both, one, other = (
        fields_of(tables, layers) - usual
        for layers in (
            LayerRatios(1.1, 0.9, skin_modulus_ratio=1.5),
            LayerRatios(1.1, 0.9),
            LayerRatios(skin_modulus_ratio=1.5),
        )
    )
    np.testing.assert_allclose(both, one + other, atol=1e-12)
    small, twice = (fields_of(tables, LayerRatios(middle_modulus_ratio=ratio)) - usual for ratio in (1.001, 1.002))
    assert np.abs(twice - 2 * small).max() < 0.01 * np.abs(twice).max()


def test_a_stiffer_face_is_deformed_less_and_a_stiffer_skin_spreads_the_pressure(tables):
    usual, stiff, skin = (
        fields_of(tables, layers)[0]
        for layers in (LayerRatios(), LayerRatios(1.25, 1.25, 1.25), LayerRatios(skin_modulus_ratio=4.0))
    )
    inside = tables.centred.r_mm < 9
    peaks = [np.abs(of[0])[:, inside].max() for of in (usual, stiff)]
    assert 0.75 < peaks[1] / peaks[0] < 0.85  # all layers 25 % stiffer: the deformation over 1.25, and a little
    assert np.abs(skin[1] / usual[1] - 1)[:, inside].max() > 0.02


def test_what_layers_change_goes_on_smoothly_from_the_nominal_slab(tables):
    """In the central window, up to the force of a ramp."""
    layers, inside = LayerRatios(1.2, 0.9, 1.1, skin_modulus_ratio=1.5), tables.centred.r_mm <= 9.9
    nominal, near, other = (
        (fields_of(tables, layers, of) - fields_of(tables, LayerRatios(), of))[:, :, :4, inside]
        for of in (NOMINAL, Slab(5.001, 30.0), Slab(4.0, 28.0))
    )
    largest = np.abs(nominal).max(axis=(2, 3))
    assert (np.abs(near - nominal).max(axis=(2, 3)) < 1e-3 * largest).all()
    apart = np.abs(other - nominal).max(axis=(2, 3)) / largest
    assert ((apart > 0.01) & (apart < 0.3)).all(), apart


@pytest.mark.parametrize("slab", [Slab(2.7, 20.0), NOMINAL, Slab(12.0, 45.0)])
def test_all_moduli_a_tenth_stiffer_under_a_tenth_more_force_are_the_same_face(tables, slab):
    """Stresses are in proportion to moduli, so deformations stay and pressures grow by a tenth; forces up to 0.55 N.

    All layers 10 % stiffer change the inclusion's deformation by some 7 %.
    """
    stiffer, inside = Slab(1.1 * slab.youngs_modulus_kpa, slab.thickness_mm), tables.centred.r_mm <= 9.9
    usual = tables.ramps(Inclusion(9.0, 6.0, 80.0), slab, World())
    other = tables.ramps(Inclusion(9.0, 6.0, 88.0), stiffer, World(layers=LayerRatios(1.1, 1.1, 1.1)))
    for force_n in (0.1, 0.5):
        for before, after in ((usual.baseline, other.baseline), (usual.inclusion_field, other.inclusion_field)):
            (w, p), (w_after, p_after) = (
                np.array(of)[:, inside] for of in (before.at(force_n), after.at(1.1 * force_n))
            )
            assert np.abs(w_after - w).max() < 0.005 * np.abs(w).max()
            assert np.abs(p_after / 1.1 - p).max() < 0.006 * np.abs(p).max()


@pytest.mark.parametrize("slab", [Slab(2.5), Slab(9.0), Slab(5.0, 20.0), Slab(5.0, 50.0)])
def test_far_from_the_nominal_slab_other_deep_tissue_is_refused(tables, slab):
    with pytest.raises(InvalidQuantity, match=r"^world\.layers\.deep_modulus_ratio is given in tissue of .*27-36 mm"):
        tables.ramps(INCLUSION, slab, World(layers=LayerRatios(deep_modulus_ratio=2.0)))
    tables.ramps(INCLUSION, slab, World(layers=LayerRatios(face_modulus_ratio=1.2, skin_modulus_ratio=2.0)))


def test_solved_ramps_get_the_same_change(tables):
    solved, layers = tables.centred.ramps(INCLUSION), LayerRatios(backing_modulus_ratio=0.85)
    known, found = (tables.ramps(INCLUSION, NOMINAL, World(layers=layers), solved=ramps) for ramps in (None, solved))
    np.testing.assert_array_equal(found.inclusion_field.fields_per_n, known.inclusion_field.fields_per_n)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("face_modulus_ratio = 1.3", "world.layers.face_modulus_ratio"),
        ("skin_modulus_ratio = 0.9", "world.layers.skin_modulus_ratio"),
        ("deep_modulus_ratio = 3", "world.layers.deep_modulus_ratio"),
        ("face_modulus_kpa = 60", "world.layers.face_modulus_kpa"),
    ],
)
def test_layers_that_the_table_does_not_hold_are_refused_by_their_key(tmp_path, text, key):
    (tmp_path / "scene.toml").write_text(f"[world.layers]\n{text}\n")
    with pytest.raises(InvalidQuantity) as refusal:
        read_scenario(tmp_path / "scene.toml")
    assert refusal.value.quantity == key


def test_without_its_table_other_layers_are_refused_and_the_usual_are_not(tables):
    without = replace(tables, layers=None)
    without.ramps(INCLUSION, NOMINAL, World())
    with pytest.raises(InvalidQuantity, match=r"world\.layers is given.*host_tools table --part layers"):
        without.ramps(INCLUSION, NOMINAL, World(layers=LayerRatios(1.1)))


def test_a_table_of_layers_of_another_scene_is_refused(tmp_path):
    shutil.copytree(MODELS, tmp_path / "tables")
    load_layer_table(MODELS).save(tmp_path / "tables", {"scene_defaults": {}, "strain": "finite"})
    with pytest.raises(InvalidQuantity, match=r"layer table's scene is {}.*host_tools table"):
        ProbeTables.load(tmp_path / "tables")


def test_the_committed_table_is_small():
    assert (MODELS / "layer_table.npz").stat().st_size < 1e6
