"""A skin that is solved anew: the scene it is of, what it changes of a face, and a chapter of few presses."""

from dataclasses import replace

import numpy as np
import pytest

from device.files.bundle_file import read_quick_model, read_ramp_model
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.quantities import Inclusion
from device.simulation.physics.layer_table import LayerRatios
from device.simulation.physics.slab import Slab
from device.simulation.physics.world import World
from host_tools.commissioning.commission import MISFIT_LIMIT
from host_tools.press_models.press_derivatives import load_derivatives
from host_tools.scores.one_thing.press_answers import TOLERANT, DesignToTry
from host_tools.scores.one_thing.solved_layers import in_layers
from host_tools.scores.one_thing.solved_skins import SolvedSkin, solved_skins_chapter

SLAB, INCLUSION = Slab(6.0, 32.0), Inclusion(11.0, 6.0, 90.0)


def test_a_skin_is_the_tissues_uppermost_layer():
    (layer,) = SolvedSkin(2.0, 3.0).stack.scene(SLAB, INCLUSION).tissue.layers
    assert (layer.thickness_mm, layer.youngs_modulus_kpa) == (2.0, 18.0)
    assert SolvedSkin(2.0, 3.0).words == "2 mm, 3 times"


@pytest.mark.long
def test_skin_like_the_tissue_changes_nothing_and_that_of_the_tables_is_as_tabled(tables):
    """The tables' own skin was solved in other scenes: both miss the mesh's error and what lies between slabs."""
    as_tabled = tables.ramps(INCLUSION, SLAB, World())
    stacks = [SolvedSkin(1.5, ratio).stack for ratio in (1.0, 2.0)]
    alike, anew = in_layers(as_tabled, SLAB, INCLUSION, stacks)
    assert alike is as_tabled
    tabled = tables.ramps(INCLUSION, SLAB, World(layers=replace(LayerRatios(), skin_modulus_ratio=2.0)))
    for one, other, before in zip(
        *((of.baseline, of.inclusion_field) for of in (anew, tabled, as_tabled)), strict=True
    ):
        changed = other.fields_per_n[0] - before.fields_per_n[0]
        missed = one.fields_per_n[0] - other.fields_per_n[0]
        assert np.linalg.norm(missed) < 0.25 * np.linalg.norm(changed)


@pytest.mark.long
@pytest.mark.study
def test_a_few_presses_become_a_table(tables):
    design = DesignToTry(
        read_ramp_model(MODELS / "standard"),
        read_quick_model(MODELS / "quick"),
        load_derivatives(SIMULATED_PROBE),
        tables,
    )
    skins = SolvedSkin(1.0, 2.0), SolvedSkin(1.0, 60.0)
    chapter = solved_skins_chapter(design, presses=2, skins=skins, seed=2, jobs=1)
    (table,) = chapter.tables
    assert [row[:2] for row in table.rows] == [("1 mm, 2 times", TOLERANT), ("1 mm, 60 times", TOLERANT)]
    answered, misfit = table.header.index("answered"), table.header.index("median misfit")
    assert int(table.rows[0][answered]) > int(table.rows[1][answered])
    # No skin is so stiff: what is believed does not reach there.
    assert float(table.rows[0][misfit]) < 1.0 < MISFIT_LIMIT < float(table.rows[1][misfit])
    assert "1 mm, 2 times" in {one.case for one in chapter.benchmarks}
