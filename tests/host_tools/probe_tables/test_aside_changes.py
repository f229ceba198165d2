"""What other tissue changes off the axis: scattered inclusions, solved on one mesh, fitted exactly."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.physics.chebyshev import points_with_ends
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.off_axis_table import COSINES, aside_shapes
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import DEPTH_MM
from host_tools.forward.plan import model_plan
from host_tools.forward.solve import solve
from host_tools.probe_tables import aside_changes as module
from host_tools.probe_tables.aside_changes import (
    OFF_THE_RIM,
    OFFSETS_MM,
    PLACES,
    SEED,
    SIZE_MM,
    TableAside,
    as_rows,
    aside_in_slabs,
    build_aside_changes,
)
from host_tools.probe_tables.cosine_modes import face_modes
from host_tools.probe_tables.force_ramps import scene_in
from host_tools.probe_tables.slab_changes import ScatteredInclusion, scattered
from host_tools.scenes.scene import Placement, Press, Waveguide

MISMATCHES = np.array([0.1, 0.96])
AXES = InclusionAxes(points_with_ends(2.0, 15.0, 4), points_with_ends(4.0, 12.0, 4), MISMATCHES)
OFFSETS, K, RADIAL = points_with_ends(*OFFSETS_MM, 5), 4, 1 + 0.3 * np.arange(7)


def test_offsets_are_scattered_over_all_that_is_solved_in_the_nominal_slab():
    found = scattered(PLACES, (SIZE_MM, DEPTH_MM, OFFSETS_MM), SEED)
    for name, (low, high) in (("size_mm", SIZE_MM), ("depth_mm", DEPTH_MM), ("offset_mm", OFFSETS_MM)):
        values = np.array([getattr(one, name) for one in found])
        assert low <= values.min() < low + 0.01 * (high - low)
        assert high - 0.01 * (high - low) < values.max() <= high


def nominal_table():
    """Smooth in all, of another profile at every size, and of other cosines at every offset."""
    size, depth, mismatch, offset, cosine, radius = np.meshgrid(*AXES, OFFSETS, np.arange(K), RADIAL, indexing="ij")
    field = (
        (2 - 0.05 * size * radius) * (1 - 0.03 * depth) * (1 + 0.2 * mismatch) * np.exp(-0.02 * offset * (1 + cosine))
    )
    return TableAside(AXES, np.stack([field, 3 * field]), OFFSETS)


def effect(place, slab, kind):
    """The share of the field itself that a slab adds to a kind of cosine: none in the nominal one."""
    size_mm, depth_mm, offset_mm = place
    stiffness, thinness = np.log(slab.youngs_modulus_kpa / 5.0), slab.thickness_mm**-2 - 30.0**-2
    return (1 + 0.3 * kind) * (stiffness * (0.2 + 0.002 * size_mm * offset_mm) + 30 * thinness * (1 + 0.02 * depth_mm))


def changed(shapes, place, slab):
    """The field [..., 2, K, R] in a slab, from its shapes [..., 5, 2, K, R]; it grows a little with the offset, too."""
    field = shapes[..., 0, :, :, :] + 0.1 * np.log(slab.youngs_modulus_kpa / 5.0) * shapes[..., 3, :, :, :]
    for kind, cosines in enumerate(COSINES):
        field[..., cosines, :] += effect(place, slab, kind) * shapes[..., 0, :, cosines, :]
    return field


def test_what_changes_as_polynomials_is_fitted(monkeypatch):
    nominal = nominal_table()

    def on_paper(one, mismatches, waveguide):
        place = one.size_mm, one.depth_mm, one.offset_mm
        return np.array([changed(nominal.shapes(one), place, slab) for slab in one.slabs])

    monkeypatch.setattr(module, "aside_in_slabs", on_paper)
    heard = []
    changes = build_aside_changes(nominal, waveguide=Waveguide(), jobs=1, on_point=heard.append)
    slab, inclusion, place = Slab(2.05, 41.0), Inclusion(7.0, 5.5, 60.0), (7.0, 5.5, 6.5)
    shapes = aside_shapes(AXES, nominal.per_n_mm3, OFFSETS, inclusion, place[2], slab)
    expected = changed(shapes, place, slab) - shapes[0]
    found = changes.modes(shapes, inclusion, slab, place[2], OFFSETS_MM)
    assert np.abs(found - expected).max() < 2e-3 * np.abs(expected).max()
    assert heard == list(range(1, PLACES + 1))


def test_rows_have_one_part_for_each_kind_of_cosine_and_nothing_of_the_rim():
    one, shapes = scattered(1, (SIZE_MM, DEPTH_MM, OFFSETS_MM), SEED)[0], np.ones((2, 5, 2, K, 7))
    fields = np.ones((len(one.slabs), 2, 2, K, 7))
    fields[..., -3:] = np.inf
    parts = as_rows(one, fields, shapes, MISMATCHES)
    slabs = len(one.slabs) - 1
    for rows, cosines in zip(parts, (1, 1, K - 2), strict=True):
        assert rows.at.shape == (2 * slabs, 6)
        assert rows.changes.shape == (2 * slabs, 2, cosines * 4)
        assert rows.shapes.shape == (2 * slabs, 5, 2, cosines * 4)
        assert (rows.peaks == K).all()  # along +x all cosines are 1


@pytest.mark.long  # solves of two kinds in three dimensions
def test_solved_with_the_press_in_axisymmetry_slabs_are_as_solved_whole():
    """All on the coarse mesh, here with the base of another slab in it: w within 1 % of its peak, p 3 % rms."""
    one, mismatch = ScatteredInclusion(8.0, 5.0, (NOMINAL, Slab(5.0, 20.0)), 4.0), 0.8
    of_slabs = aside_in_slabs(one, np.array([mismatch]), Waveguide())[:, 0]
    angle = np.cos(np.outer(np.linspace(0, np.pi, 13), np.arange(of_slabs.shape[2])))
    for slab, solved in zip(one.slabs, of_slabs, strict=True):
        inclusion = Inclusion(8.0, 5.0, slab.modulus_kpa(mismatch))
        scene = scene_in(slab, inclusion).with_press(Press(force_n=1e-3))
        scene = replace(scene, placement=Placement(offset_x_mm=4.0))
        whole = solve(scene, replace(model_plan(scene), grading="coarse"))
        expected = face_modes(whole.r_mm, whole.pressed, whole.baseline) / (1e-3 * 8.0**3 * mismatch)
        (w, p), (true_w, true_p) = ((angle @ part)[..., OFF_THE_RIM] for part in (solved, expected))
        assert np.abs(w - true_w).max() < 0.01 * true_w.max(), slab
        assert np.sqrt(((p - true_p) ** 2).mean()) < 0.03 * true_p.max(), slab
