"""The virtual probe's committed table of other layers against fresh finite-element force ramps."""

from functools import lru_cache

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.physics.layer_table import IN_SLABS_RATIO, SOLVED_RATIOS, LayerRatios
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.world import World
from host_tools.probe_tables.force_ramps import CHANGES, fields, ramp
from host_tools.probe_tables.layer_table import WAVEGUIDE_LAYERS, LayeredScene

INCLUSION = Inclusion(10.5, 6.7, 55.0)
"""Between the table's sizes, depths and mismatches."""
FORCES_N = np.array([0.1, 0.55])
OTHERS = [
    ("face_modulus_ratio", 1.1, 0.1),
    *(
        pytest.param(*case, marks=pytest.mark.long)
        for case in (
            ("middle_modulus_ratio", 1.1, 0.1),
            ("backing_modulus_ratio", 1.1, 0.1),
            ("deep_modulus_ratio", 1.4, 0.3),
            ("skin_modulus_ratio", 3.0, 1.5),
        )
    ),
]
"""Ratios between those solved, and the error of the change in per cent of the peaks; the changes are 0.2-4 % of them,
those of the skin 4-17 %."""


def solved(scene_of, slab=NOMINAL):
    """The fields [F, baseline or inclusion, w or p, R] of a scene."""
    return np.array([fields(solution) for solution in ramp(scene_of(slab, INCLUSION), FORCES_N, CHANGES)])


@lru_cache(maxsize=4)  # as few as the tests ask for in turn
def solved_as_usual(in_tissue, slab=NOMINAL):
    return solved(LayeredScene(LayerRatios(), in_tissue), slab)


def tabulated(tables, layers, slab=NOMINAL):
    ramps = tables.ramps(INCLUSION, slab, World(layers=layers))
    return np.array([[ramps.baseline.at(force_n), ramps.inclusion_field.at(force_n)] for force_n in FORCES_N])


@pytest.mark.parametrize(("name", "ratio", "percent"), OTHERS)
def test_what_a_layer_changes_is_that_of_fresh_solves_on_one_mesh(tables, name, ratio, percent):
    """In the central window, over the peaks of the face without and of what the inclusion adds."""
    in_tissue = list(SOLVED_RATIOS).index(name) >= WAVEGUIDE_LAYERS
    layers, inside = LayerRatios(**{name: ratio}), tables.centred.r_mm <= 9.9
    usual, other = solved_as_usual(in_tissue), solved(LayeredScene(layers, in_tissue))
    change = tabulated(tables, layers) - tabulated(tables, LayerRatios())
    peaks = np.abs(usual)[..., inside].max(axis=-1)
    errors = np.abs(change - (other - usual))[..., inside].max(axis=-1) / peaks
    assert (100 * errors < percent).all(), (100 * errors).round(3)


@pytest.mark.long
@pytest.mark.parametrize("name", list(IN_SLABS_RATIO))
@pytest.mark.parametrize("slab", [Slab(3.0, 22.0), Slab(18.0, 45.0)])
def test_in_other_slabs_the_change_of_deformation_is_nearly_that_of_fresh_solves(tables, name, slab):
    """A layer a tenth stiffer, in the central window and between what was solved: within a tenth of its change of w.

    Pressures, which change by a hundredth at most, within 0.15 % of their peak. Skin stiffer by half changes both by
    1-3 % of their peaks: within a quarter of that of w, and 0.4 % of the peak of p.
    """
    in_tissue = list(SOLVED_RATIOS).index(name) >= WAVEGUIDE_LAYERS
    layers, inside = LayerRatios(**{name: 1.5 if in_tissue else 1.1}), tables.centred.r_mm <= 9.9
    usual, other = (
        one[..., inside] for one in (solved_as_usual(in_tissue, slab), solved(LayeredScene(layers, in_tissue), slab))
    )
    change, known = (
        other - usual,
        (tabulated(tables, layers, slab) - tabulated(tables, LayerRatios(), slab))[..., inside],
    )
    missed, size = (np.sqrt(np.mean(one**2, axis=-1)) for one in (known - change, change))
    ratio, of_w, of_peak_p = missed / size, 0.25 if in_tissue else 0.1, 0.004 if in_tissue else 0.0015
    assert (ratio[..., 0] < of_w).all(), ratio
    assert (missed[..., 1] < of_peak_p * np.abs(usual).max(axis=-1)[..., 1]).all()
