"""`phantoms.toml`: a set that holds is read, and everything that contradicts itself in another is told at once."""

import re
import tomllib
from pathlib import Path

import pytest
import tomli_w

from device.files.bundle_file import read_paper_model
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.files.toml_record import InvalidRecord
from device.measurement.quantities import Inclusion
from host_tools.commands.model import phantoms_of
from host_tools.scenes.phantom_set import read_phantoms
from host_tools.scenes.scene import Tissue


def stated(name, value, tolerance, measured_by="calliper"):
    return {name: value, f"{name}_tolerance": tolerance, f"{name}_measured_by": measured_by}


def block(name, tissue_kpa=5.0, surface="dusted"):
    tissue = stated("tissue_modulus_kpa", tissue_kpa, 0.1, "indentation of a cast cylinder")
    return {"name": name, "surface": surface, **tissue, **stated("tissue_thickness_mm", 30.0, 0.2)}


def phantom(name, truth, tissue_kpa=5.0, surface="dusted"):
    size_mm, depth_mm, modulus_kpa = truth
    return {
        **block(name, tissue_kpa, surface),
        **stated("size_mm", size_mm, 0.1),
        **stated("depth_mm", depth_mm, 0.2, "mould"),
        **stated("youngs_modulus_kpa", modulus_kpa, 3.0, "indentation of a cast cylinder"),
    }


TRUTHS = [
    (14.0, 4.5, 110.0),
    (12.0, 7.0, 60.0),
    (9.0, 5.0, 80.0),
    (11.0, 9.0, 100.0),
    (6.0, 6.0, 50.0),
    (8.0, 4.5, 90.0),
]


def good():
    """Six inclusions and three bare blocks, in two tissues, with two surfaces."""
    inclusions = [phantom(f"A{i}", truth, (5.0, 6.0)[i % 2]) for i, truth in enumerate(TRUTHS)]
    blocks = [block("B0"), block("B1", 6.0), block("B2", surface="oiled")]
    return {"serial": "PH-7", "phantoms": [*inclusions, *blocks]}


def written(folder, table) -> Path:
    path = folder / "phantoms.toml"
    path.write_text(tomli_w.dumps(table))
    return path


def refused(folder, table, **options):
    with pytest.raises(InvalidRecord) as refusal:
        read_phantoms(written(folder, table), **options)
    return [problem.quantity for problem in refusal.value.problems], str(refusal.value)


def test_a_set_says_each_phantoms_inclusion_and_tissue(tmp_path):
    found = read_phantoms(written(tmp_path, good()), blocks_needed=3)
    assert found.serial == "PH-7"
    assert [one.inclusion.as_tuple() for one in found.with_inclusion] == TRUTHS
    assert found.phantoms[1].tissue == Tissue(youngs_modulus_kpa=6.0, thickness_mm=30.0)
    assert found.phantoms[-1].inclusion is None
    assert list(found.advice()) == []


def test_a_set_of_one_surface_and_tissue_is_taken_and_told_what_would_tell_more(tmp_path):
    table = good()
    table["phantoms"] = [phantom(f"A{i}", truth) for i, truth in enumerate(TRUTHS)]
    assert len(list(read_phantoms(written(tmp_path, table)).advice())) == 2


def test_what_commissioning_will_refuse_is_told_when_the_set_is_checked(tmp_path):
    """A set is taken before anything is cast from it: other uses know more tissue."""
    table = good()
    table["phantoms"][0]["size_mm"], table["phantoms"][1]["tissue_modulus_kpa"] = 1.5, 31.0
    told = list(read_phantoms(written(tmp_path, table)).advice())
    assert len(told) == 2
    assert told[0].startswith("size_mm of ")
    assert "is 1.5, but must be at least 2 and at most 15" in told[0]
    assert "tissue_modulus_kpa of " in told[1]
    assert "cast one inside" in told[1]


def test_castings_whose_inclusion_is_not_possible_in_their_tissue_are_told(tmp_path):
    """Each number lies in its range: as soft as its tissue nothing shows, and no press is answered beyond 61 times."""
    table = good()
    of_soft, of_thin = table["phantoms"][:2]
    of_soft["tissue_modulus_kpa"], of_soft["youngs_modulus_kpa"] = 20.0, 22.0
    of_thin["tissue_thickness_mm"] = of_thin["size_mm"] + of_thin["depth_mm"] + 0.6
    told = list(read_phantoms(written(tmp_path, table)).advice())
    assert "youngs_modulus_kpa of " in told[0]
    assert "1.3 to 61 times as stiff" in told[0]
    assert any("size_mm + depth_mm of " in one and "cast a block of" in one for one in told)


@pytest.mark.parametrize("name", ["a/b", "A2.zip", "A2.TMP", "Phantom1 ", " A1", "A\n1", "..", "-A1"])
def test_a_name_that_no_recording_can_have_is_refused_before_anything_is_cast(tmp_path, name):
    table = good()
    table["phantoms"][1]["name"] = name
    [quantity], told = refused(tmp_path, table)
    assert quantity == "phantoms[1].name"
    assert told.startswith(
        f"phantoms[1].name is {name!r}, but must be a folder's name: without / and spaces at its ends"
    )


@pytest.mark.parametrize("name", ["A-1", "block_2", "2026.11", "tmp", "Phantom 1", "A(1)", "Gr\u00f6\u00dfe"])
def test_a_name_that_a_folder_can_have_is_taken(tmp_path, name):
    table = good()
    table["phantoms"][1]["name"] = name
    assert read_phantoms(written(tmp_path, table)).phantoms[1].name == name


def test_everything_that_is_wrong_is_told_at_once(tmp_path):
    table = good()
    first, second, third, fourth, *_ = table["phantoms"]
    first["depth_mm"] = 17.0  # 31 mm in 30
    second["youngs_modulus_kpa"] = 6.0  # as its tissue
    third |= {"name": "A1", "size_mm_tolerance": 0.0}
    del fourth["depth_mm_measured_by"]
    table["phantoms"][4]["youngs_modulus_kpa_tolerance"] = 60.0
    table["phantoms"][5]["size_cm"] = table["phantoms"][5].pop("size_mm")
    table["phantoms"][6]["tissue_modulus_kpa_tolerance"] = -1.0
    table["phantoms"].pop()
    quantities, told = refused(tmp_path, table, blocks_needed=3)
    assert sorted(quantities) == sorted(
        [
            "phantoms[0].depth_mm + size_mm",
            "phantoms[1].youngs_modulus_kpa",
            "phantoms[2].name",
            "phantoms[2].size_mm_tolerance",
            "phantoms[3].depth_mm_measured_by",
            "phantoms[4].youngs_modulus_kpa_tolerance",
            "phantoms[5].size_cm",
            "phantoms[5].size_mm",
            "phantoms[6].tissue_modulus_kpa_tolerance",
            "bare blocks",
        ]
    )
    assert "'A1' again, with another size_mm and depth_mm and youngs_modulus_kpa and tissue_modulus_kpa" in told
    assert "phantoms[0].depth_mm + size_mm is 31 mm, but must be below phantoms[0].tissue_thickness_mm of 30 mm" in told
    assert "bare blocks is 2, but must be at least 3: cast more of them" in told


def test_too_few_inclusions_are_no_set(tmp_path):
    table = good()
    table["phantoms"] = table["phantoms"][1:]
    quantities, told = refused(tmp_path, table)
    assert quantities == ["phantoms with an inclusion"]
    assert "is 5, but must be at least 6" in told


def test_a_phantom_that_is_listed_twice_is_refused_though_both_agree(tmp_path):
    table = good()
    table["phantoms"].append(table["phantoms"][0])
    quantities, told = refused(tmp_path, table)
    assert quantities == ["phantoms[9].name"]
    assert "'A0' again, but must be one of its own" in told


def test_the_set_of_the_simulated_probe_is_what_host_tools_phantom_records():
    found = read_phantoms(SIMULATED_PROBE / "phantoms.toml", blocks_needed=3)
    recorded = phantoms_of(read_paper_model(MODELS / "paper"))
    assert [one.inclusion for one in found.with_inclusion] == recorded
    assert [one.name for one in found.with_inclusion] == [f"phantom{i}" for i in range(1, 10)]
    assert {one.tissue for one in found.phantoms} == {Tissue()}


def test_the_phantom_of_the_page_is_one(tmp_path):
    page = (Path(__file__).parents[3] / "docs" / "own_probe.md").read_text(encoding="utf-8")
    [example] = re.findall(r"^```toml\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    table = good()
    table["phantoms"][1:2] = tomllib.loads(example)["phantoms"]
    assert read_phantoms(written(tmp_path, table)).phantoms[1].inclusion == Inclusion(10.0, 6.1, 82.0)


def test_a_truth_agrees_within_three_tolerances(tmp_path):
    first = read_phantoms(written(tmp_path, good())).phantoms[0]
    assert first.agrees_with(Inclusion(14.3, 4.5, 101.0))
    assert not first.agrees_with(Inclusion(14.31, 4.5, 101.0))
    assert not first.agrees_with(Inclusion(14.0, 4.5, 100.9))
