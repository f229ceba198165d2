"""The face drawn where the camera sees it: points move outwards, and carry their force with them."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from daemon_process import ROOT

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.physics.face_motion import load_face_motion
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.surface_table import Ramp
from device.simulation.physics.world import World
from device.simulation.virtual_probe import ProbeTables

MODELS = ROOT / "models" / "simulated_probe"
INCLUSION = Inclusion(9.0, 6.0, 70.0)
MOVED = World(face_motion_ratio=1.0)


def test_a_face_that_does_not_move_is_the_tables(tables):
    known = tables.centred.ramps(INCLUSION)
    found = tables.motion.moved(known, 0.0, INCLUSION, NOMINAL)
    for one, other in ((found.baseline, known.baseline), (found.inclusion_field, known.inclusion_field)):
        np.testing.assert_allclose(one.fields_per_n, other.fields_per_n, rtol=2e-5, atol=1e-7)


def test_a_point_keeps_its_deformation_and_the_force_inside_it(tables):
    """Force inside the circle where the point has gone is that inside the circle where it was: 0.1 % of the whole."""
    known, found = tables.centred.ramps(INCLUSION), tables.ramps(INCLUSION, NOMINAL, MOVED)
    r_mm, force_n = tables.centred.r_mm, known.baseline.force_n[-1]
    (w, p), (w_moved, p_moved) = (
        ramps.baseline.fields_per_n[:, -1] + ramps.inclusion_field.fields_per_n[:, -1] for ramps in (known, found)
    )
    no_inclusion = replace(INCLUSION, size_mm=0.0)
    assert tables.ramps(no_inclusion, NOMINAL, MOVED).inclusion_field.fields_per_n == pytest.approx(0.0, abs=1e-12)
    gone_mm = r_mm + force_n * tables.motion.outward_per_n[-1]
    inside = gone_mm < 10.0
    np.testing.assert_allclose(np.interp(gone_mm, r_mm, w_moved)[inside], w[inside], atol=0.003 * w.max())

    def force(p_kpa):
        return np.concatenate([[0.0], np.cumsum(np.diff(r_mm**2) * (p_kpa[1:] + p_kpa[:-1]) / 2)])

    error = np.interp(gone_mm, r_mm, force(p_moved))[inside] - force(p)[inside]
    assert np.abs(error).max() < 2e-3 * force(p)[-1]


def test_a_uniform_pressure_on_a_face_that_grows_evenly_falls_by_the_square(tables):
    motion = replace(tables.motion, outward_per_n=0.02 * tables.motion.r_mm * np.ones((5, 1)))
    ramps = tables.centred.ramps(replace(INCLUSION, size_mm=0.0))
    even = ramps._replace(baseline=Ramp(ramps.baseline.force_n, np.ones_like(ramps.baseline.fields_per_n)))
    w_per_n, p_per_n = motion.moved(even, 1.0, replace(INCLUSION, size_mm=0.0), NOMINAL).baseline.fields_per_n
    np.testing.assert_allclose(w_per_n, 1.0)
    expected = np.broadcast_to(1 / (1 + 0.02 * ramps.baseline.force_n[:, None]) ** 2, p_per_n.shape)
    np.testing.assert_allclose(p_per_n[:, 1:-1], expected[:, 1:-1], rtol=1e-6)


def test_the_motion_is_that_of_a_soft_block_pressed_flat(tables):
    """Outwards, more the further out, some hundredth of the radius at 0.6 N."""
    outward_mm = 0.6 * tables.motion.outward_per_n[-1]
    assert (np.diff(outward_mm) > 0).all()
    assert 0.01 < outward_mm[80] / 8.0 < 0.025


def test_without_its_table_a_moving_face_is_refused(tables):
    with pytest.raises(InvalidQuantity, match=r"world\.face_motion_ratio is given.*host_tools table --part motion"):
        replace(tables, motion=None).ramps(INCLUSION, NOMINAL, MOVED)


def test_the_motion_goes_on_smoothly_from_the_nominal_slab_and_soft_tissue_lets_less_of_it_out(tables):
    """Of points 8 mm from the axis, at the force of a ramp."""
    soft, nominal, near, stiffer = (
        tables.motion.outward_per_n_in(INCLUSION, of)[0][3, 80]
        for of in (Slab(2.7, 30.0), NOMINAL, Slab(5.001, 30.0), Slab(12.0, 30.0))
    )
    assert near == pytest.approx(nominal, rel=1e-3)
    assert soft < 0.97 * nominal < nominal < stiffer


def test_a_table_of_motion_of_another_scene_is_refused(tmp_path):
    shutil.copytree(MODELS, tmp_path / "tables")
    load_face_motion(MODELS).save(tmp_path / "tables", {"scene_defaults": {}, "strain": "finite"})
    with pytest.raises(InvalidQuantity, match=r"face motion's scene is {}.*host_tools table"):
        ProbeTables.load(tmp_path / "tables")
