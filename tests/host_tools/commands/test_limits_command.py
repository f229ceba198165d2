"""`host_tools limits` as a researcher types it: bounds of one scene, as a table and as JSON, and what is refused."""

import json
from pathlib import Path

import pytest
from toolkit_process import run_toolkit

from device.measurement.quantities import InvalidQuantity
from host_tools.commands.limits import limits

SCENE = "[inclusion]\nsize_mm = 10\ndepth_mm = 6\nyoungs_modulus_kpa = 80\n"
QUICK = 'forces_n = [0.5]\nstrain = "small"\nobservable = "displacement"\nsystematic_ratio = 0.002\n'


@pytest.fixture
def files(tmp_path):
    scene, protocol = tmp_path / "scene.toml", tmp_path / "protocol.toml"
    scene.write_text(SCENE)
    protocol.write_text(QUICK)
    return scene, protocol


def test_bounds_of_a_scene_as_json(files):
    scene, protocol = files
    done = run_toolkit("limits", scene, "--protocol", protocol, "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert set(record["by_order"]) == {"3", "4"}
    for name in ("size_mm", "depth_mm", "youngs_modulus_kpa"):
        bounds = [order["std_percent"][name] for order in record["by_order"].values()]
        assert record["std_percent"][name] == pytest.approx(max(bounds))
        assert 0 < record["std_with_box_percent"][name] < record["std_percent"][name]
    assert record["identifiable"]["youngs_modulus_kpa"] is False  # one small-strain image of w: known to a factor only
    assert record["worst_direction"][2] == pytest.approx(1, abs=0.05)


def test_bounds_of_a_scene_as_a_table(files, capsys):
    limits(protocol=files[1], size_mm=10.0, depth_mm=6.0, modulus_kpa=80.0)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["size_mm", "depth_mm", "youngs_modulus_kpa"]
    assert [line[:22].strip() for line in lines[1:6]] == [
        "measurement alone",
        "with the box as prior",
        "alone, order 3",
        "alone, order 4",
        "identifiable",
    ]
    assert lines[5].split()[-1] == "no"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"size_mm": 10.0}, "not given whole"),
        ({"scene": Path("scene.toml"), "size_mm": 10.0}, "given twice"),
        ({"whole_map": True}, "add --out"),
        ({"whole_map": True, "out": Path("page.txt")}, "page.txt"),
        ({"whole_map": True, "out": Path("page.md"), "depth_mm": 6.0}, "no scene"),
        ({"scene": Path("scene.toml"), "out": Path("page.md")}, "add --map"),
        ({"whole_map": True, "out": Path("page.md"), "protocol": Path("own.toml")}, "left out with --map"),
        ({"whole_map": True, "out": Path("page.md"), "as_json": True}, "left out with --map"),
        ({"scene": Path("scene.toml"), "scheduler": "tcp://host:8786"}, "left out without --map"),
        ({"scene": Path("missing.toml")}, "missing.toml"),
    ],
)
def test_what_cannot_be_asked_is_refused_in_one_sentence(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidQuantity, match=words):
        limits(**arguments)
    assert list(tmp_path.iterdir()) == []
