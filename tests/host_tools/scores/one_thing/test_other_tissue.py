"""Presses in tissue that the models do not know: what is drawn, and what counts as wrong."""

from collections import namedtuple

import numpy as np
import pytest

from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, Quantity
from device.measurement.quantities import Inclusion
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.surface_table import Ramp
from host_tools.forward.press_model import PressFailed
from host_tools.probe_tables.force_ramps import FORCES_N
from host_tools.scenes.scene import Tissue
from host_tools.scores.one_thing import other_tissue
from host_tools.scores.one_thing.other_tissue import (
    HEADER,
    KINDS,
    LEAST_CONTRAST,
    MODES,
    SKINS,
    WRONG_AT_MOST,
    TissueKind,
    held_by,
    on_the_tables_mesh,
    other_tissue_chapter,
    presses_in,
    random_scene,
)

TRUTH = (8.0, 5.0, 60.0)
Tables = namedtuple("Tables", "centred")


def estimate(size: Quantity, modulus: Quantity) -> Estimate:
    depth = Quantity(5.5, 4.5, 6.0, 0.2, True)
    depth = UNKNOWN_QUANTITY if size is UNKNOWN_QUANTITY else depth
    return Estimate(size, depth, modulus, "ok", "", "standard", "m", "0", "c", True, features={})


RIGHT = estimate(Quantity(8.2, 7.5, 9.0, 0.3, True), Quantity(50.0, 30.0, 90.0, 9.0, True))
WRONG = estimate(Quantity(9.2, 8.5, 9.9, 0.3, True), Quantity(40.0, 10.0, 160.0, 30.0, False))
REFUSED = estimate(UNKNOWN_QUANTITY, UNKNOWN_QUANTITY)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_an_inclusion_is_stiffer_than_its_tissue_and_ends_above_the_base(kind):
    rng = np.random.default_rng(1)
    for scene in (random_scene(kind, rng) for _ in range(50)):
        size_mm, depth_mm, modulus_kpa = scene.inclusion.as_tuple()
        assert kind.modulus_kpa[0] <= scene.tissue.youngs_modulus_kpa <= kind.modulus_kpa[1]
        assert kind.thickness_mm[0] <= scene.tissue.thickness_mm <= kind.thickness_mm[1]
        assert size_mm + depth_mm < scene.tissue.thickness_mm
        assert LEAST_CONTRAST * scene.tissue.youngs_modulus_kpa <= modulus_kpa <= 150


def test_every_solve_is_pressed_on_several_skins_in_the_middle_and_what_folds_is_drawn_again(monkeypatch):
    folded = []

    def solved(scene, largest_n):
        if not folded:
            folded.append(scene)
            raise PressFailed("folded")
        return scene

    monkeypatch.setattr(other_tissue, "press_ramps", solved)
    monkeypatch.setattr(other_tissue, "in_parallel", lambda work, count, jobs, **_: [work(i) for i in range(count)])
    kind = TissueKind("firm", (10.0, 12.0), truth="meshed anew")
    parameters, scenes = presses_in(kind, None, 2, 1, jobs=1)
    assert len(parameters) == 2 * SKINS
    assert [tuple(one) for one in parameters[::SKINS, :3]] == [scene.inclusion.as_tuple() for scene in scenes]
    assert folded[0] not in scenes
    assert (parameters[:, -1] == 0).all()
    assert len(np.unique(parameters[:, 5])) == 2 * SKINS
    assert (parameters[:, 3:5] == (5.0, 30.0)).all()


def test_presses_of_the_tables_are_those_that_are_solved_beside_them(monkeypatch):
    """The same inclusions on the same skins, in the tissue that was drawn."""
    monkeypatch.setattr(other_tissue, "press_ramps", lambda scene, largest_n: scene)
    monkeypatch.setattr(other_tissue, "in_parallel", lambda work, count, jobs, **_: [work(i) for i in range(count)])
    anew, of_tables = (
        presses_in(TissueKind("", truth=truth), None, 2, 1, jobs=1) for truth in ("meshed anew", "tables")
    )
    assert of_tables.ramps == [None] * 2
    tissue = [one.tissue for one in anew.ramps]
    assert of_tables.parameters[::SKINS, 3].tolist() == [one.youngs_modulus_kpa for one in tissue]
    np.testing.assert_array_equal(np.delete(anew.parameters, (3, 4), 1), np.delete(of_tables.parameters, (3, 4), 1))


@pytest.mark.long
@pytest.mark.study
def test_in_nominal_tissue_the_press_beside_is_the_tables_own(table):
    """A slab of 30 mm and 5 kPa changes nothing; of 5.5 kPa what the table says, whose level is another: 0.2 % of the
    peak.
    """
    nothing = Ramp(FORCES_N, None)
    for kpa, slab, bound in ((5.0, NOMINAL, 0.001), (5.5, Slab(5.5), 0.002)):
        found = on_the_tables_mesh(nothing, Tissue(youngs_modulus_kpa=kpa), table).baseline.at(0.4)
        own, inside = table.ramps(Inclusion(0.0, 6.0, 80.0), slab).baseline.at(0.4), table.r_mm <= 9.9
        for one, other in zip(found, own, strict=True):
            assert np.abs(one - other)[inside].max() < bound * np.abs(other[inside]).max()


def test_an_interval_holds_or_does_not_and_a_refused_press_has_none():
    np.testing.assert_array_equal(
        held_by([RIGHT, WRONG, REFUSED], np.tile(TRUTH, (3, 1))), [[1, 1, 1], [0, 1, 1], [np.nan] * 3]
    )


def test_what_is_refused_is_not_wrong_and_what_does_not_hold_is(monkeypatch):
    """Four of ten sizes are wrong, three presses refused: beside the bound in standard, shown in quick."""
    found = [*[RIGHT] * 3, *[WRONG] * 4, *[REFUSED] * 3]
    parameters = np.tile([*TRUTH, 5.0, 30.0, 2.0, 0.5, 1.0, 0.0], (len(found), 1))
    monkeypatch.setattr(other_tissue, "presses_in", lambda *_: other_tissue.OtherPresses(parameters, [None] * 2))
    monkeypatch.setattr(other_tissue, "recorded_press", lambda tables, values, mode, seed, **_: seed)
    monkeypatch.setattr(other_tissue, "in_parallel", lambda work, count, jobs: [work(i) for i in range(count)])
    answers = iter(found * len(KINDS) * len(MODES))
    chapter = other_tissue_chapter(lambda recording, mode: next(answers), Tables(None))
    size, depth, modulus = chapter.benchmarks[:3]
    assert (size.measured, depth.measured, modulus.measured) == (0.4, 0.0, 0.0)
    assert not size.passed
    assert depth.bound == WRONG_AT_MOST
    assert len(chapter.benchmarks) == 3 * len(KINDS)
    (table,) = chapter.tables
    assert table.rows[0] == (KINDS[0].name, "standard", "30%", "43%", "100%", "43%", "100%", "+0.77", "+0.50")
    assert {len(row) for row in table.rows} == {len(HEADER)}


def test_where_all_are_refused_nothing_is_said_of_answers():
    rows = other_tissue._figures([REFUSED] * 2, np.tile(TRUTH, (2, 1)))
    assert rows == ("100%", *["-"] * 6)
