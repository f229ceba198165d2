"""The virtual probe's committed table of uneven tissue against fresh finite-element force ramps."""

import numpy as np
import pytest

from device.measurement.parameters import LAYER_TOPS_MM
from device.measurement.quantities import Inclusion
from device.simulation.physics.slab import Slab
from device.simulation.physics.world import AS_BELIEVED
from host_tools.forward.plan import Level
from host_tools.probe_tables import tissue_layers
from host_tools.probe_tables.force_ramps import TissueStack
from host_tools.probe_tables.tissue_layers import (
    THINNEST_MM,
    build_tissue_layers,
    fitted,
    inclusion_changes,
    layers_in,
)
from host_tools.scenes.scene import Waveguide
from host_tools.scores.one_thing.solved_layers import in_layers

INCLUSION, SLAB = Inclusion(9.0, 6.5, 60.0), Slab(8.0, 26.0)
"""Between slabs that were solved."""
LAYERS = range(len(LAYER_TOPS_MM))
QUICK = (Level("blunt", 2),)
"""A level of quick solves, for what is told by signs and rough sizes."""


def stack(ratios):
    return TissueStack(tuple(map(float, np.diff(LAYER_TOPS_MM))), tuple(map(float, ratios)))


def test_layers_end_at_the_base():
    assert layers_in(Slab(5.0, 60.0)) == list(LAYER_TOPS_MM)
    assert layers_in(Slab(5.0, 20.0 + THINNEST_MM / 2)) == layers_in(Slab(5.0, 16.0)) == [0.0, 4.0, 8.0, 12.0]


@pytest.mark.parametrize("layer", [0, *(pytest.param(one, marks=pytest.mark.long) for one in (2, 4))])
def test_a_stiffer_layer_changes_a_press_as_fresh_solves_say(tables, layer):
    """A tenth stiffer, in the central window: what is missed, over the change, and over the peak of the inclusion's."""
    ratios = np.where(np.arange(len(LAYER_TOPS_MM)) == layer, 1.1, 1.0)
    as_tabled, inside = tables.ramps(INCLUSION, SLAB, AS_BELIEVED), tables.centred.r_mm <= 9.0
    known = tables.ramps(INCLUSION, SLAB, AS_BELIEVED, tuple(map(float, ratios)))
    (fresh,) = in_layers(as_tabled, SLAB, INCLUSION, [stack(ratios)])
    for part, bound in (("baseline", 0.08), ("inclusion_field", 0.25)):
        usual, found, true = (getattr(one, part).fields_per_n[:, :4, inside] for one in (as_tabled, known, fresh))
        missed, size = (np.sqrt(np.mean(one**2, axis=(1, 2))) for one in (found - true, true - usual))
        assert (missed < np.maximum(bound * size, 0.005 * np.abs(usual).max(axis=(1, 2)))).all(), (part, missed / size)


def test_layers_add_up_and_even_ones_change_nothing(tables):
    def changes(*ratios):
        even, other = (tables.ramps(INCLUSION, SLAB, AS_BELIEVED, one) for one in ((1.0,) * 5, ratios))
        return other.baseline.fields_per_n - even.baseline.fields_per_n

    first, last = changes(1.1, 1.0, 1.0, 1.0, 1.0), changes(1.0, 1.0, 1.0, 1.0, 0.8)
    np.testing.assert_allclose(changes(1.1, 1.0, 1.0, 1.0, 0.8), first + last, atol=1e-12)
    assert not changes(1.0, 1.0, 1.0, 1.0, 1.0).any()


def test_polynomials_give_back_what_is_one():
    rng = np.random.default_rng(1)
    at, slope = rng.uniform(-1, 1, (400, 6)), rng.standard_normal((6, 5, 2, 2))
    degrees, found = fitted(at, np.tensordot(at, slope, 1))
    alone = [int(np.flatnonzero((degrees == np.eye(6, dtype=int)[i]).all(axis=1))[0]) for i in range(6)]
    np.testing.assert_allclose(found[alone], slope, atol=5e-3)


@pytest.mark.long
def test_a_table_is_built_of_solves(monkeypatch):
    """A cut-down one: its face without an inclusion is that of its slabs, and layers below the base change nothing."""
    monkeypatch.setattr(tissue_layers, "DEGREE", 0)
    monkeypatch.setattr(tissue_layers, "WITHOUT_INCLUSION", QUICK)
    monkeypatch.setattr(tissue_layers, "CHANGES", QUICK)
    built = build_tissue_layers(places=1, moduli_kpa=(5.0, 8.0), thicknesses_mm=(16.0, 26.0), jobs=1)
    assert built.bare_change_per_n.shape[:3] == (len(LAYER_TOPS_MM), 2, 2)
    assert not built.bare_change_per_n[4, :, 0].any()
    assert (np.abs(built.bare_change_per_n[:4]).max(axis=(1, 2, 3, 4, 5)) > 0.01).all()
    assert built.shape_shares.shape == (1, len(LAYER_TOPS_MM), 2, 2)


@pytest.mark.long
def test_a_stiffer_layer_around_an_inclusion_weakens_what_that_adds(monkeypatch):
    """Its mismatch is less; a stiffer layer above it passes more on."""
    monkeypatch.setattr(tissue_layers, "CHANGES", QUICK)
    shares = inclusion_changes(Slab(5.0, 30.0), Inclusion(4.0, 8.0, 40.0), Waveguide()).shares[2, :, 0, 1]
    assert shares[2] < -0.3
    assert shares[0] > 0
