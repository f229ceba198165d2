"""One inclusion solved for itself: a sphere is the table's, an oblong one is longer one way, beside it is none."""

from __future__ import annotations

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.physics.pressed_face import PressedFace
from device.simulation.physics.pressed_face import ProbePlacement as At
from host_tools.probe_tables.ellipsoid import UNDER_THE_PROBE_MM, SolvedInclusion, solved_inclusion
from host_tools.scenes.scene import Placement, Scene

INCLUSION = Inclusion(8.0, 5.0, 80.0)
FORCE_N = 0.02
"""Small strain: the solve's, and the table's smallest."""
X_MM = np.linspace(-9.9, 9.9, 67, dtype=np.float32)[None, :]
INSIDE = np.hypot(X_MM, X_MM.T) <= 9.9


@pytest.fixture(scope="module")
def sphere(tables) -> SolvedInclusion:
    return solved_inclusion(Scene(INCLUSION), tables.off_axis)


@pytest.fixture(scope="module")
def oblong(tables) -> SolvedInclusion:
    return solved_inclusion(Scene(INCLUSION, placement=Placement(width_ratio_x=2.0)), tables.off_axis)


def added(tables, table, place: At, force_n: float = FORCE_N) -> tuple[np.ndarray, np.ndarray]:
    """Return the deformation and the pressure that an inclusion adds to the face of the tissue alone."""
    ramps = tables.centred.ramps(INCLUSION)
    face, known = (PressedFace(ramps, one, INCLUSION, X_MM, X_MM.T) for one in (table, tables.off_axis))
    found, baseline = face.at(force_n, place), known.at(force_n, At(80.0, 0.0))
    return found[0] - baseline[0], found[1] - baseline[1]


def test_a_sphere_under_the_probe_is_the_centred_tables(tables, sphere):
    """Deformation within 3 % of its peak; the pressure, which jumps at the rim, within 5 % root mean square."""
    (found_mm, found_kpa), (mm, kpa) = (added(tables, table, At()) for table in (sphere, tables.off_axis))
    assert np.abs(found_mm - mm)[INSIDE].max() < 0.03 * mm[INSIDE].max()
    assert np.sqrt(np.mean((found_kpa - kpa)[INSIDE] ** 2)) < 0.05 * kpa[INSIDE].max()


def test_a_sphere_is_the_same_in_every_direction_and_an_oblong_inclusion_is_not(sphere, oblong):
    """The second cosine says longer along x than along y; symmetry in x allows no odd one."""
    peak_mm = oblong.modes_per_n[0].max()
    assert not sphere.modes_per_n[:, 1:].any()
    assert oblong.modes_per_n[0, 2].max() > 0.05 * peak_mm
    assert np.abs(oblong.modes_per_n[:, 1::2]).max() < 1e-9 * peak_mm


def test_the_spot_of_an_oblong_inclusion_is_longer_along_it(tables, oblong):
    """Second moments of the added deformation about the middle, along x and along y."""
    w_mm = np.where(INSIDE, np.maximum(added(tables, oblong, At())[0], 0), 0)
    along_x, along_y = (float(np.sum(w_mm * axis**2) / np.sum(w_mm)) for axis in (X_MM, X_MM.T))
    assert along_x > 1.1 * along_y


def test_beside_the_inclusion_nothing_of_it_is_left(tables, sphere):
    """And nearer than 5 mm it stands under the middle, wherever the probe is told to stand."""
    none, whole = (added(tables, sphere, At(UNDER_THE_PROBE_MM + step, 0.0))[0] for step in (0.01, -0.01))
    assert np.abs(none).max() < 1e-7
    assert np.abs(whole - added(tables, sphere, At())[0]).max() < 1e-6 * np.abs(whole).max()


def test_it_keeps_the_radii_and_the_tilt_of_the_probes_own_table(tables, oblong):
    np.testing.assert_array_equal(oblong.r_mm, tables.off_axis.r_mm)
    np.testing.assert_array_equal(oblong.tilt_per_deg, tables.off_axis.tilt_per_deg)
    assert oblong.modes_per_n.shape[-1] == len(tables.off_axis.r_mm)
