"""The committed table of inclusions off the axis against a fresh solve in three dimensions, and its parts on paper."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.physics.chebyshev import points_with_ends
from device.simulation.physics.pressed_face import PressedFace, ProbePlacement
from device.simulation.physics.slab import NOMINAL, Slab
from host_tools.forward.plan import model_plan
from host_tools.forward.solve import solve
from host_tools.probe_tables.aside_changes import OFFSETS_MM
from host_tools.probe_tables.cosine_modes import MODES, cosine_modes
from host_tools.probe_tables.force_ramps import ring_means
from host_tools.probe_tables.off_axis_table import POINTS, SMALLEST_SIZE_MM, off_axis_scene
from host_tools.probe_tables.surface_table import inclusion_axes
from host_tools.scenes.scene import Tissue

FORCE_N = 0.02
"""Small strain: the solve's, and the table's smallest."""


TRUTHS = [
    ((7.0, 7.0, 100.0), 9.0, NOMINAL, 0.02),
    *(
        pytest.param(*one, marks=pytest.mark.long)
        for one in (
            ((12.0, 6.0, 10.0), 5.0, NOMINAL, 0.02),
            ((5.4, 5.7, 46.0), 2.7, NOMINAL, 0.02),
            ((8.0, 5.0, 55.0), 4.0, Slab(5.0, 17.0), 0.03),
            ((6.0, 4.5, 220.0), 8.0, Slab(20.0), 0.04),
            ((13.2, 6.1, 25.0), 9.1, Slab(2.75, 56.0), 0.03),
            ((3.1, 4.3, 9.0), 9.8, Slab(3.5, 17.5), 0.07),
        )
    ),
]
"""Inclusion, offset (mm), slab, and how far off the peak a deformation may be."""


@pytest.mark.parametrize(("truth", "offset_mm", "slab", "bound"), TRUTHS)
def test_the_face_off_the_axis_is_near_a_fresh_solve(tables, truth, offset_mm, slab, bound):
    """Deformation within 2 % of the peak anywhere in the central window; ring means of pressure 4 % rms, for these jump
    from mesh to mesh. In other slabs deformations are up to 6 % off, most beside small inclusions.
    """
    inclusion = Inclusion(*truth)
    scene = off_axis_scene(inclusion, offset_mm, force_n=FORCE_N)
    scene = replace(scene, tissue=Tissue(slab.youngs_modulus_kpa, slab.thickness_mm))
    solution = solve(scene, replace(model_plan(scene), grading="coarse"))
    inclusion_mm = solution.pressed.w_mm - solution.baseline.w_mm
    rays_kpa = solution.pressed.p_kpa - solution.baseline.p_kpa
    inclusion_kpa = np.array([ring_means(solution.r_mm, ray) for ray in rays_kpa])
    x_mm, y_mm = (axis.reshape(1, -1).astype(np.float32) for axis in solution.rays.xy_mm)

    def fields(one, place):
        face = PressedFace(tables.centred.ramps(one, slab), tables.off_axis, one, x_mm, y_mm, slab)
        return (field.reshape(inclusion_mm.shape) for field in face.at(FORCE_N, place))

    inside = solution.r_mm <= 9.9
    found_mm, found_kpa = (
        one - none
        for one, none in zip(
            fields(inclusion, ProbePlacement(x_mm=-offset_mm)),
            fields(replace(inclusion, size_mm=0.0), ProbePlacement()),
            strict=True,
        )
    )
    assert np.abs(found_mm - inclusion_mm)[:, inside].max() < bound * inclusion_mm[:, inside].max()
    error_kpa = (found_kpa - inclusion_kpa)[:, inside]
    assert np.sqrt((error_kpa**2).mean()) < 0.04 * inclusion_kpa[:, inside].max()


def test_the_committed_table_is_of_the_points_that_are_solved_now(tables):
    """One of fewer sizes was kept for long: between them pressures were a tenth off."""
    of_inclusions, offsets_mm = inclusion_axes(POINTS[:3], SMALLEST_SIZE_MM), points_with_ends(*OFFSETS_MM, POINTS[3])
    for name, points in (*of_inclusions._asdict().items(), ("offset_mm", offsets_mm)):
        np.testing.assert_allclose(getattr(tables.off_axis, name), points, rtol=1e-6, err_msg=name)


@pytest.mark.parametrize("slab", [NOMINAL, Slab(2.0, 60.0), Slab(12.0, 30.0), Slab(27.0, 40.0), Slab(5.0, 17.5)])
def test_pressures_of_an_inclusion_add_no_force(tables, slab):
    """The force is the press's own: what an inclusion adds to the mean over the angle carries 0.2 % of it at most."""
    r_mm, inclusion = tables.off_axis.r_mm, Inclusion(10.0, 6.0, slab.modulus_kpa(0.7))
    for offset_mm in (2.0, 4.0, 8.0, 14.0):
        mean_kpa = tables.off_axis.modes(inclusion, offset_mm, slab)[1, 0]
        assert abs(np.trapezoid(2e-3 * np.pi * r_mm * mean_kpa, r_mm)) < 0.002


def test_cosine_modes_of_a_cosine_series_are_its_coefficients():
    angle = 2 * np.pi * np.arange(48) / 48
    modes = cosine_modes((3 + 2 * np.cos(angle) - 0.5 * np.cos(4 * angle))[:, None])
    expected = np.zeros(MODES)
    expected[[0, 1, 4]] = 3, 2, -0.5
    np.testing.assert_allclose(modes[:, 0], expected, atol=1e-14)


def test_moving_the_centred_field_aside_would_be_wrong(tables):
    """10 mm, 5 mm deep, 80 kPa, 2 mm off the axis: a probe that cannot turn answers with a moment."""
    inclusion = Inclusion(10.0, 5.0, 80.0)
    x_mm = np.linspace(-9.9, 9.9, 199, dtype=np.float32)[None, :]
    inside = np.hypot(x_mm, x_mm.T) <= 9.9
    ramps = tables.centred.ramps(inclusion)
    face = PressedFace(ramps, tables.off_axis, inclusion, x_mm, x_mm.T)
    solved = face.at(FORCE_N, ProbePlacement(-2.0, 0.0))[0] - face.at(FORCE_N, ProbePlacement(40.0, 0.0))[0]
    inclusion_mm = ramps.inclusion_field.at(FORCE_N).w_mm
    moved = np.interp(np.hypot(x_mm - 2.0, x_mm.T), ramps.r_mm, inclusion_mm)
    assert np.abs(moved - solved)[inside].max() > 0.15 * inclusion_mm.max()
