"""The virtual probe's committed table of the face's motion against fresh finite-element force ramps."""

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.physics.slab import NOMINAL, Slab
from host_tools.probe_tables.face_motion import outward_mm
from host_tools.probe_tables.force_ramps import FORCES_N, ramp, scene_in

TRUTHS = [(14.3, 11.2, 47.0), pytest.param((10.5, 5.1, 80.0), marks=pytest.mark.long)]


@pytest.mark.parametrize("truth", TRUTHS)
def test_the_way_outwards_is_that_of_a_fresh_solve(tables, truth):
    """In the central window to 0.78 N: 0.012 of 0.24 mm, as meshes of the rim differ, and 0.001 of what one adds."""
    errors_mm = missed_mm(tables.motion, Inclusion(*truth), NOMINAL, FORCES_N)
    assert (errors_mm < (0.012, 0.001)).all(), errors_mm


@pytest.mark.long
@pytest.mark.parametrize("slab", [Slab(3.0, 22.0), Slab(18.0, 45.0)])
def test_the_way_outwards_in_other_slabs_is_that_of_fresh_solves(tables, slab):
    """As near as in the nominal slab up to 0.4 N; at 0.64 N tissue of 3 kPa folds at the rim."""
    errors_mm = missed_mm(tables.motion, Inclusion(10.5, 6.7, 90.0), slab, FORCES_N[:4])
    assert (errors_mm[:3] < (0.012, 0.0012)).all(), errors_mm
    assert (errors_mm[3] < (0.012, 0.006)).all(), errors_mm


def missed_mm(motion, inclusion, slab, forces_n):
    """The largest errors in the central window [F, without the inclusion and what it adds]."""
    inside, per_n = motion.r_mm <= 9.9, motion.outward_per_n_in(inclusion, slab)
    errors_mm = []
    for at, (force_n, solution) in enumerate(zip(forces_n, ramp(scene_in(slab, inclusion), forces_n), strict=True)):
        found = force_n * np.array([of[at] for of in per_n])[:, inside]
        errors_mm.append(np.abs(found - np.array(outward_mm(solution))[:, inside]).max(axis=1))
    return np.array(errors_mm)
