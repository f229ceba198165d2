"""Builds the virtual probe's table of tissue that is uneven in depth: each layer's modulus a little apart from others.

Every change is the difference of two solves on one mesh, whose layers are there in both, over the logarithm of the
layer's modulus. Inclusions and slabs are scattered as in `slab_changes`. What a layer changes of an inclusion's field
is small against what it changes of the face, so its size and width are kept and the rest is left out.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from itertools import pairwise, product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import LAYER_TOPS_MM
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.legendre import LegendreTerms
from device.simulation.physics.layer_table import TissueLayerTable
from device.simulation.physics.slab import Slab
from device.simulation.physics.slab_changes import coordinates, resampling
from host_tools.forward.plan import Level
from host_tools.forward.press_model import PressFailed
from host_tools.probe_tables.force_ramps import (
    CHANGES,
    FORCES_N,
    TissueStack,
    bare_per_n,
    first_that_can,
    per_n,
    ramp,
)
from host_tools.probe_tables.slab_changes import (
    FEWEST_FORCES,
    MODULI_KPA,
    SLAB_FORCES_N,
    THICKNESSES_MM,
    WITHOUT_INCLUSION,
    scattered,
)
from host_tools.probe_tables.surface_table import require_tabulated, solved_for
from host_tools.scenes.probe import Probe
from host_tools.scenes.probe_file import simulated_probe
from host_tools.scenes.scene import Waveguide

LAYERS = len(LAYER_TOPS_MM)
STEP = 0.1
"""Of the logarithm of a layer's modulus."""
THINNEST_MM = 0.5
"""A layer that reaches less far above the base is left out: thinner ones would make bad elements."""
PLACES = 60
"""Inclusions that are solved, each in two slabs: these changes are small."""
DEGREE, RIDGE = 3, 1e-4
"""Highest total degree of the terms of an inclusion's part, and how far they are held to 0."""


def stack_in(slab: Slab, stiffer: int | None) -> TissueStack:
    """Return the layers of a slab, one of them `STEP` stiffer; of None all are as the slab."""
    tops_mm = layers_in(slab)
    ratios = tuple(math.exp(STEP * (layer == stiffer)) for layer in range(len(tops_mm)))
    return TissueStack(tuple(base - top for top, base in pairwise(tops_mm)), ratios)


def layers_in(slab: Slab) -> list[float]:
    """Return the depths at which the layers of a slab begin (mm)."""
    return [top for top in LAYER_TOPS_MM if top < slab.thickness_mm - THINNEST_MM]


class SlabAndInclusion(NamedTuple):
    """Coordinates [n, 6] of an inclusion in a slab at n forces, and what each layer changes of its field there.

    `shares` [n, layer, 2, 2] of both shapes of `TissueLayerTable`.
    """

    at: Array
    shares: Array


def changes_without_inclusion_per_n(slab: Slab, waveguide: Waveguide) -> Array:
    """Return what each layer changes of the face of a slab without an inclusion [layer, 2, F, R], at `SLAB_FORCES_N`.

    Layers below its base change nothing. Raises `PressFailed` where a force cannot be reached on any level.
    """

    def on(level: Level) -> Array:
        def solved(stiffer: int | None) -> Array:
            return bare_per_n(stack_in(slab, stiffer).scene(slab, waveguide=waveguide), SLAB_FORCES_N, (level,))

        return _changes(slab, solved(None), solved)

    return first_that_can(on, WITHOUT_INCLUSION)


def _changes(slab: Slab, usual: Array, solved: Callable[[int | None], Array]) -> Array:
    """Return what each layer changes [layer, ...] of what is solved, over the logarithm of its modulus."""
    found = np.zeros((LAYERS, *usual.shape))
    for layer in range(len(layers_in(slab))):
        found[layer] = (solved(layer) - usual) / STEP
    return found


def inclusion_changes(slab: Slab, inclusion: Inclusion, waveguide: Waveguide) -> SlabAndInclusion:
    """Return what each layer changes of an inclusion's field in a slab, at as many of `SLAB_FORCES_N` as are reached.

    Raises `PressFailed` where not even `FEWEST_FORCES` are.
    """

    def to(reached: int) -> SlabAndInclusion:
        forces_n = SLAB_FORCES_N[:reached]

        def solved(stiffer: int | None) -> Array:
            scene = stack_in(slab, stiffer).scene(slab, inclusion, waveguide=waveguide)
            return per_n(ramp(scene, forces_n, CHANGES), forces_n)[1]

        usual = solved(None)
        shares = _shares(usual, _changes(slab, usual, solved))
        return SlabAndInclusion(coordinates(inclusion, slab, forces_n), shares)

    return first_that_can(to, range(len(SLAB_FORCES_N), FEWEST_FORCES - 1, -1))


def _shares(field: Array, changes: Array) -> Array:
    """Return how much of a field [2, F, R] itself, and of it times the squared radius, changes [L, 2, F, R] are.

    As [F, L, 2 shapes, 2], by least squares over the face.
    """
    wider = np.linspace(0.0, 1.0, field.shape[-1]) ** 2
    found = np.empty((field.shape[1], len(changes), 2, len(field)))
    for number, force in np.ndindex(field.shape[:2]):
        shapes = np.stack([field[number, force], field[number, force] * wider], axis=1)
        found[force, :, :, number] = np.linalg.lstsq(shapes, changes[:, number, force].T, rcond=None)[0].T
    return found


def fitted(at: Array, shares: Array) -> tuple[NDArray[np.uint8], Array]:
    """Return degrees [N, 6] of all terms up to `DEGREE` together, and theirs [N, ...] of shares [n, ...] at [n, 6]."""
    degrees = np.array([one for one in product(range(DEGREE + 1), repeat=6) if sum(one) <= DEGREE], np.uint8)
    terms = LegendreTerms(degrees).values(at)
    padded = np.vstack([terms, math.sqrt(RIDGE * len(at)) * np.eye(len(degrees))])
    values = np.concatenate([shares.reshape(len(at), -1), np.zeros((len(degrees), shares[0].size))])
    found, *_ = np.linalg.lstsq(padded, values, rcond=None)
    return degrees, found.reshape(len(degrees), *shares.shape[1:])


def build_tissue_layers(
    *,
    waveguide: Waveguide | None = None,
    places: int = PLACES,
    moduli_kpa: tuple[float, ...] = MODULI_KPA,
    thicknesses_mm: tuple[float, ...] = THICKNESSES_MM,
    jobs: int = -1,
    on_point: Callable[[int, int], None] = lambda done, n: None,
) -> TissueLayerTable:
    """Solve every slab and inclusion of the table (half an hour on two cores); `on_point` hears done and total.

    Of a waveguide, the simulated probe's unless given; raise `InvalidQuantity` for one whose face no table holds.
    """
    waveguide = waveguide or Waveguide()
    require_tabulated(waveguide)
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    slabs = [Slab(*one) for one in product(moduli_kpa, thicknesses_mm)]
    wanted = [
        (slab, Inclusion(one.size_mm, one.depth_mm, slab.modulus_kpa(mismatch)))
        for one, mismatch in zip(scattered(places), np.linspace(0.1, 0.95, places).tolist(), strict=True)
        for slab in one.slabs[1:3]
    ]
    without = Parallel(n_jobs=jobs)(delayed(changes_without_inclusion_per_n)(slab, waveguide) for slab in slabs)
    solving = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(_if_it_can)(slab, inclusion, waveguide) for slab, inclusion in wanted
    )
    solved: list[SlabAndInclusion] = []
    for done, one in enumerate(solving, start=1):
        solved += [one] if one else []
        on_point(done, len(wanted))
    degrees, shares = fitted(*(np.concatenate(part) for part in zip(*solved, strict=True)))
    to_own, of_slabs = resampling(SLAB_FORCES_N, FORCES_N), np.moveaxis(np.array(without), 0, 1)
    of_slabs = np.einsum("gf,lkxfr->lkxgr", to_own, of_slabs)
    grid = LAYERS, len(moduli_kpa), len(thicknesses_mm)
    return TissueLayerTable(
        slab_modulus_kpa=np.array(moduli_kpa),
        slab_thickness_mm=np.array(thicknesses_mm),
        force_n=FORCES_N,
        bare_change_per_n=of_slabs.reshape(*grid, *of_slabs.shape[2:]).astype(np.float32),
        change_degrees=degrees,
        shape_shares=shares.astype(np.float32),
        reached_n=SLAB_FORCES_N,
    )


def _if_it_can(slab: Slab, inclusion: Inclusion, waveguide: Waveguide) -> SlabAndInclusion | None:
    """Return the same, or None for one that no solver follows: polynomials do without."""
    try:
        return inclusion_changes(slab, inclusion, waveguide)
    except PressFailed:
        return None


def write_tissue_layers(table: TissueLayerTable, folder: Path, probe: Probe | None = None) -> None:
    """Write the table with the surroundings and the probe that it was solved for."""
    table.save(folder, {**solved_for(probe or simulated_probe()), "strain": "finite"})
