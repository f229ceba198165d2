"""The page's tables and numbers say what the study found, and a verdict stands only while its numbers do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from device.measurement.arrays import Array
from device.measurement.quantities import InvalidQuantity
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Table
from host_tools.pages.page import Results, write_page
from host_tools.paper_network import train as training
from host_tools.paper_network.train import TrainingRows
from host_tools.replication import study as paper_study
from host_tools.replication.page import paper_facts, paper_tables
from host_tools.replication.protocol import ProtocolStep, Views, require_waveguide
from host_tools.replication.study import PaperStudy


def fake_views(truth: Array, exact: Array, light: str, tables: ProbeTables, *, presses: int) -> Views:
    """Images on straight lines, bent in traced light, and frames with noise of 2 %."""
    image = exact if light == "linear" else np.sqrt(exact)
    noise = np.random.default_rng(1).normal(1.0, 0.02, (presses, *exact.shape[:1], 2, 3))
    return Views(exact, image, image[None, :, None] * noise)


@pytest.fixture(scope="module")
def rows() -> TrainingRows:
    """Scenes whose features give size and depth away, and little of Young's modulus."""
    rng = np.random.default_rng(7)
    truth = rng.uniform((3.0, 4.0, 40.0), (15.0, 12.0, 120.0), (80, 3))
    size, depth, modulus = truth.T
    features = np.column_stack([0.01 * size, size * depth * modulus**0.02, 10.0 * size])
    names = ("max_deformation_mm", "central_deformation_mm3", "deformation_area_mm2")
    return TrainingRows(names, features, truth, np.arange(9), "ab" * 32, {}, 0)


@pytest.fixture(scope="module")
def study(rows: TrainingRows) -> Iterator[PaperStudy]:
    """Two short trials a network."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(training, "MAX_ITERATIONS", 100)
        patch.setattr(training, "LM_MAX_ITERATIONS", 30)
        patch.setattr(paper_study, "views", fake_views)
        yield PaperStudy(rows, None, seeds=2, presses=3)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def found(study: PaperStudy) -> dict[str, Table]:
    return {name: table() for name, table in paper_tables(study).items()}


@pytest.fixture(scope="module")
def facts(study: PaperStudy) -> dict[str, Any]:
    return paper_facts(study)


def test_on_straight_lines_the_image_costs_nothing_and_noise_does(study: PaperStudy) -> None:
    exact = study.mean_percent("linear", ProtocolStep.FEATURES)
    assert study.mean_percent("linear", ProtocolStep.LETTER) == pytest.approx(exact)
    assert study.mean_percent("linear", ProtocolStep.REFITTED) == pytest.approx(exact)
    assert not np.allclose(study.mean_percent("linear", ProtocolStep.NOISE), exact)
    assert len(study.errors("linear", ProtocolStep.NOISE).percent) == 27


def test_each_phantom_is_left_out_of_its_own_networks_only(study: PaperStudy) -> None:
    for phantom, networks in enumerate(study.left_one_out):
        truth = networks.problem.scenes.truth
        assert len(truth) == 79
        assert not (truth == study.phantoms.truth[phantom]).all(axis=1).any()
    assert len(study.left_nine_out) == 4
    assert {len(sets[0].problem.scenes.truth) for sets in study.left_nine_out.values()} == {71}


def test_the_papers_figures_stand_beside_ours(study: PaperStudy, found: dict[str, Table]) -> None:
    table = found["letter"]
    assert table.header[:4] == ("", "size, the paper", "size, linear light", "size, traced light")
    papers = [(row[0], *row[1::3]) for row in table.rows]
    assert papers[::3] == [("mean", "7.0", "7.2", "5.1"), ("max", "20.0", "26.4", "11.7")]
    means = study.errors("physical", ProtocolStep.LETTER).totals()["mean"]
    assert table.rows[0][3::3] == tuple(f"{mean:.1f}" for mean in means)


def test_every_table_has_a_cell_under_every_heading(found: dict[str, Table]) -> None:
    assert len(found) == 9
    for table in found.values():
        assert {len(row) for row in table.rows} == {len(table.header)}


def test_both_methods_and_every_failure_are_in_the_side_by_side(found: dict[str, Table]) -> None:
    for table in (found["side_by_side"], found["side_by_side_ours"]):
        assert table.header == ("", "SCG", "LM")
        assert sum(row[0].startswith("failed:") for row in table.rows) == 3
        assert table.rows[-1][:2] == ("time, SCG = 1", "1")


def test_the_prose_quotes_the_numbers_of_the_tables(study: PaperStudy, facts: dict[str, Any]) -> None:
    letter, refitted = (study.mean_percent("linear", step) for step in (ProtocolStep.LETTER, ProtocolStep.REFITTED))
    assert facts["letter_percent"]["linear"] == pytest.approx(letter, rel=1e-5)
    assert facts["growth"]["refitted"]["linear"] == pytest.approx(refitted / letter, rel=1e-5)
    assert (facts["scenes"], facts["scenes_that_train"], facts["excluded_scenes"]) == (80, 71, 0)
    assert facts["lm_over_scg"]["time"] > 0


def test_a_verdict_that_the_numbers_do_not_bear_is_open(
    found: dict[str, Table], facts: dict[str, Any], tmp_path: Path
) -> None:
    good, bad = [1.0, 1.0, 500.0], [50.0, 50.0, 1.0]
    for means, supported in ((good, True), (bad, False)):
        of_means = facts | {"letter_percent": {"linear": means, "physical": means}}
        write_page(tmp_path / "paper.md", Results("paper_protocol", "paper", tables=found, facts=of_means))
        text = (tmp_path / "paper.md").read_text()
        verdicts = text.split("| what the paper")[1].split("\n\n")[0].splitlines()[2:]
        assert len(verdicts) == 7
        assert ["**open**" not in row for row in verdicts[:2]] == [supported, supported]
        assert "80 are used; 0, failed or without a number" in text
        assert "is simulated" in text
        assert "not known to us" in text


def test_rows_that_cannot_train_and_a_single_trial_are_refused(rows: TrainingRows, tables: ProbeTables) -> None:
    few = replace(rows, features=rows.features[:60], truth=rows.truth[:60])
    with pytest.raises(InvalidQuantity, match="training rows is 51, but must be at least 60"):
        PaperStudy(few, tables)
    with pytest.raises(InvalidQuantity, match="seeds is 1, but must be at least 2"):
        PaperStudy(rows, tables, seeds=1)


def test_scenes_of_another_force_than_that_of_the_images_are_refused(rows: TrainingRows) -> None:
    other = replace(rows, scene_defaults={"press": {"force_n": 0.3}})
    with pytest.raises(InvalidQuantity, match=r"press force of the sweep is 0\.3 N, but must be 0\.5 N"):
        PaperStudy(other, None, seeds=2)  # type: ignore[arg-type]


def test_scenes_of_another_waveguide_than_that_of_the_images_are_refused(rows: TrainingRows) -> None:
    design = {"waveguide": {"radius_mm": 11.0, "layer_moduli_kpa": [60.0, 40.0, 20.0], "face": "round"}}
    require_waveguide(rows, design)  # an older sweep says nothing: it is the design's
    softer = replace(rows, scene_defaults={"waveguide": {"layer_moduli_kpa": [60.0, 40.0, 16.0]}})
    with pytest.raises(
        InvalidQuantity, match="layer_moduli_kpa of the sweep is 60, 40, 16 kPa, but must be 60, 40, 20"
    ):
        require_waveguide(softer, design)
    with pytest.raises(InvalidQuantity, match="face of the sweep is round, but must be square, as the images"):
        require_waveguide(rows, {"waveguide": {"face": "square"}})
