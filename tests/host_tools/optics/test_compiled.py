"""The tracer's machine code is made once, found again by the next process, and never outlives its sources."""

import ast
import os
import subprocess
import sys

import pytest

from host_tools.optics import compiled
from host_tools.optics.compiled import ROOM

INSTALLED = """
from device.files import shipped
shipped.SOURCE_TREE = None
from host_tools.optics.fresnel import reflectance
print(reflectance(0.8, 1.41, 1.0))
print(sum(reflectance.stats.cache_hits.values()), sum(reflectance.stats.cache_misses.values()))
"""


@pytest.fixture
def sources(tmp_path, monkeypatch):
    """A room of two sources, in an installed package whose user keeps files under `tmp_path`."""
    room = tmp_path / "optics"
    room.mkdir()
    for name in ("caller.py", "called.py"):
        (room / name).write_text("x = 1\n")
    monkeypatch.setattr(compiled, "ROOM", room)
    monkeypatch.setattr(compiled, "SOURCE_TREE", None)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "kept"))
    return room


def test_the_next_process_finds_what_the_first_one_compiled(tmp_path):
    command, environment = [sys.executable, "-c", INSTALLED], {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    first, second = (
        subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout.splitlines()
        for _ in range(2)
    )
    assert first[0] == second[0]
    assert (first[1], second[1]) == ("0 1", "1 0")


@pytest.mark.parametrize("change", ["called.py", "new.py"])
def test_a_changed_or_new_source_has_a_folder_of_its_own(sources, change):
    before = compiled._kept_folder()
    assert compiled._kept_folder() == before
    (sources / change).write_text("x = 2\n")
    assert compiled._kept_folder() != before


def test_the_source_tree_keeps_it_where_it_builds(sources, tmp_path, monkeypatch):
    monkeypatch.setattr(compiled, "SOURCE_TREE", tmp_path / "clone")
    assert compiled._kept_folder().parent == tmp_path / "clone" / "build" / "tracer"


def test_where_nothing_can_be_written_nothing_is_kept(sources, tmp_path):
    (tmp_path / "kept").write_text("a file where the folder would be")
    assert compiled._kept_folder() is None


def test_compiled_functions_read_nothing_of_ours_from_another_room():
    """The folder's name knows this room's sources alone."""
    for source in sorted(ROOM.glob("*.py")):
        tree = ast.parse(source.read_text())
        foreign = {
            name.asname or name.name
            for one in tree.body
            if isinstance(one, ast.ImportFrom) and one.module.split(".")[0] in ("device", "host_tools")
            if not one.module.startswith("host_tools.optics.")
            for name in one.names
        }
        for function in (one for one in tree.body if isinstance(one, ast.FunctionDef)):
            if "compiled" in [getattr(d, "id", "") for d in function.decorator_list]:
                read = {node.id for statement in function.body for node in ast.walk(statement) if hasattr(node, "id")}
                assert not read & foreign, (source.name, function.name)
