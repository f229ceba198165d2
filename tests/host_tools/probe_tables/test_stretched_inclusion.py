"""An ellipsoid on the probe's own table: longer than its sphere under the probe, and not there beside it."""

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.physics.off_axis_table import OffAxisTable
from device.simulation.physics.slab import NOMINAL, Slab
from host_tools.probe_tables import ellipsoid as module
from host_tools.probe_tables.ellipsoid import UNDER_THE_PROBE_MM, StretchedInclusion, stretched_inclusion
from host_tools.scenes.scene import Placement, Scene

INCLUSION, OFFSET_MM = Inclusion(8.0, 5.0, 80.0), 1.0


def scene(ratio_x: float) -> Scene:
    return Scene(INCLUSION, placement=Placement(offset_x_mm=OFFSET_MM, width_ratio_x=ratio_x))


@pytest.fixture(scope="module")
def longer(tables):
    return stretched_inclusion(scene(2.0), tables.off_axis)


@pytest.mark.long
def test_an_inclusion_that_is_longer_adds_to_the_mean_and_to_the_second_cosine(tables, longer):
    """As the solved ellipsoid does to the solved sphere: more volume, and longer along x."""
    own, found = (one.modes(INCLUSION, OFFSET_MM) for one in (tables.off_axis, longer))
    peak_mm = tables.centred.ramps(INCLUSION).inclusion_field.at_small_strain(1.0)[0].max()
    assert (found - own)[0, 2].max() > 0.05 * peak_mm
    assert (found - own)[0, 0].max() > 0.05 * peak_mm


@pytest.mark.long
def test_far_beside_it_the_probe_meets_its_own_sphere(tables, longer):
    away_mm = UNDER_THE_PROBE_MM + 0.01
    np.testing.assert_array_equal(longer.modes(INCLUSION, away_mm), tables.off_axis.modes(INCLUSION, away_mm))
    assert longer.centred_share(OFFSET_MM) == tables.off_axis.centred_share(OFFSET_MM)


@pytest.mark.parametrize("slab", [NOMINAL, Slab(20.0, 40.0), NOMINAL.changed(0.9)])
def test_the_stretch_grows_with_the_slab_as_the_sphere_does(tables, slab):
    own = {name: getattr(tables.off_axis, name) for name in OffAxisTable.__dataclass_fields__}
    stretch_per_n = tables.off_axis.modes(INCLUSION, 3.0)
    found = StretchedInclusion(**own, stretch_per_n=stretch_per_n).modes(INCLUSION, OFFSET_MM, slab)
    added, growth = found - tables.off_axis.modes(INCLUSION, OFFSET_MM, slab), 1.0
    if slab != NOMINAL:
        growth = tables.off_axis.growth_with(slab, INCLUSION, OFFSET_MM)[:, None, None]
        assert (growth != 1).all()
    np.testing.assert_allclose(added, growth * stretch_per_n, atol=1e-12)


def test_the_sphere_beside_it_is_of_the_same_scene(tables, monkeypatch):
    solved = []

    class Solved:
        modes_per_n = np.zeros(1)

    monkeypatch.setattr(module, "solved_inclusion", lambda scene, table: solved.append(scene) or Solved())
    stretched_inclusion(scene(1.8), tables.off_axis)
    assert [one.placement.width_ratio_x for one in solved] == [1.8, 1.0]
    assert [one.placement.offset_x_mm for one in solved] == [OFFSET_MM] * 2
    assert solved[0].inclusion == solved[1].inclusion == INCLUSION
