"""What is small is learned of scattered slabs as what is large: a change that its terms hold is found."""

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.physics.layer_table import IN_SLABS_RATIO, SOLVED_RATIOS
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import field_shapes
from host_tools.forward.press_model import PressFailed
from host_tools.probe_tables.changes_in_slabs import as_far_as_it_goes, build_changes_in_slabs
from host_tools.probe_tables.layer_table import nominal_tables, scenes_in_slabs
from host_tools.probe_tables.slab_changes import SLAB_FORCES_N, scattered
from host_tools.scenes.scene import Waveguide

INCLUSION, SLAB = Inclusion(9.0, 6.0, 70.0), Slab(9.0, 24.0)


def stronger(slab):
    return 1 + 0.2 * np.log(slab.youngs_modulus_kpa / NOMINAL.youngs_modulus_kpa)


@pytest.fixture(scope="module")
def nominal(tables):
    """The face's and the middle layer's tables, as the committed ones have them."""
    of_layers = tables.layers
    scale = of_layers.inclusion_scale[..., None, None, None, None, None]
    return nominal_tables(of_layers.axes, of_layers.inclusion_change_per_n_mm3.astype(float) * scale)[:2]


@pytest.fixture(scope="module")
def found(nominal):
    without = np.ones((2, 2, len(SLAB_FORCES_N), nominal[0].per_n_mm3.shape[-1]))

    def solve(one, slab, reached):
        if slab.youngs_modulus_kpa < 3.0 and reached > 4:
            raise PressFailed("soft tissue gives way")
        fields = [np.moveaxis(table.shapes(one)[0], 0, 1)[:, :, :reached] for table in nominal]
        return stronger(slab) * np.array(fields)

    return build_changes_in_slabs(nominal, solve, lambda slab: stronger(slab) * without, places=12, jobs=1)


def test_a_field_that_grows_with_the_stiffness_of_tissue_is_found_for_each_table(nominal, found):
    for table, slabs in zip(nominal, found, strict=True):
        shapes = field_shapes(table.axes, table.per_n_mm3, table.force_n, INCLUSION, SLAB)
        change = slabs.inclusion_per_n(shapes, table.force_n, INCLUSION, SLAB)
        expected = (stronger(SLAB) - 1) * shapes[0]
        assert np.abs(change - expected).max() < 0.02 * np.abs(expected).max()
        assert slabs.baseline_per_n(SLAB) == pytest.approx(stronger(SLAB) - 1, rel=1e-4)


def test_nothing_changes_in_the_nominal_slab(nominal, found):
    for table, slabs in zip(nominal, found, strict=True):
        shapes = field_shapes(table.axes, table.per_n_mm3, table.force_n, INCLUSION)
        change = slabs.inclusion_per_n(shapes, table.force_n, INCLUSION, NOMINAL)
        assert np.abs(change).max() < 1e-9 * np.abs(shapes[0]).max()
        assert slabs.baseline_per_n(NOMINAL) == pytest.approx(0.0, abs=1e-7)


def test_what_cannot_be_pressed_so_far_is_no_number_there_and_refused_where_it_goes_nowhere():
    one = scattered(1)[0]

    def solve(_one, _slab, reached):
        if reached > 3:
            raise PressFailed("folds at 0.5 N")
        return np.ones((1, 2, 1, reached, 7))

    fields = as_far_as_it_goes(solve, one, SLAB)
    assert fields.shape == (1, 2, 1, len(SLAB_FORCES_N), 7)
    np.testing.assert_array_equal(np.isnan(fields[0, 0, 0, :, 0]), [False] * 3 + [True] * 2)
    with pytest.raises(PressFailed, match="folds"):
        as_far_as_it_goes(lambda *_: solve(None, None, 5), one, SLAB)


def test_each_layer_of_the_waveguide_is_solved_a_quarter_stiffer():
    (usual, _), others = scenes_in_slabs(Waveguide())
    moduli = [scene(SLAB).waveguide.layer_moduli_kpa for scene in (usual, *others)]
    stiffer = np.array(moduli[1:]) / moduli[0]
    np.testing.assert_allclose(stiffer, 1 + np.vstack([0.25 * np.eye(3), np.zeros(3)]))
    assert all(ratio in SOLVED_RATIOS[name] for name, ratio in IN_SLABS_RATIO.items())


@pytest.mark.parametrize("slab", [Slab(5.0, 30.0), Slab(8.0, 16.0)])
def test_the_skin_is_solved_twice_as_stiff_on_the_mesh_of_tissue_as_it_is(slab):
    (in_one_piece, layered), others = scenes_in_slabs(Waveguide())
    usual, stiffer = layered(slab).tissue, others[-1](slab).tissue
    assert (usual.layers[0].thickness_mm, usual.layers[0].youngs_modulus_kpa) == (1.5, slab.youngs_modulus_kpa)
    assert usual.interface_depths_mm == stiffer.interface_depths_mm
    assert stiffer.layers[0].youngs_modulus_kpa == 2 * slab.youngs_modulus_kpa
    assert (stiffer.layers[1:], stiffer.youngs_modulus_kpa) == (usual.layers[1:], slab.youngs_modulus_kpa)
    assert not in_one_piece(slab).tissue.layers
