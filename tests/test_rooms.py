"""The plan of the house: every room says what it is for and names its modules, and none is a loft or a cupboard."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from daemon_process import ROOT

ROOMS = sorted({path.parent for program in ("device", "host_tools") for path in (ROOT / program).rglob("*.py")})
MOST_MODULES = 18


def modules(room: Path) -> set[str]:
    return {path.stem for path in room.glob("*.py")} - {"__init__", "__main__"}


def room_id(room: Path) -> str:
    return str(room.relative_to(ROOT))


@pytest.mark.parametrize("room", ROOMS, ids=room_id)
def test_a_room_names_its_modules_in_reading_order(room: Path) -> None:
    text = ast.get_docstring(ast.parse((room / "__init__.py").read_text(encoding="utf-8"))) or ""
    listed = re.search(r"Modules in reading order: ([^.]*)\.", text)
    named = re.findall(r"`(\w+)`", listed[1]) if listed else []
    assert len(named) == len(set(named))
    assert set(named) == modules(room)


@pytest.mark.parametrize("room", ROOMS, ids=room_id)
def test_a_room_is_not_two(room: Path) -> None:
    assert len(modules(room)) <= MOST_MODULES


def test_no_class_name_stands_for_two_things() -> None:
    """Public classes and type aliases, over both programs."""
    homes: dict[str, list[str]] = {}
    for room in ROOMS:
        for path in room.glob("*.py"):
            for name in public_types(ast.parse(path.read_text(encoding="utf-8"))):
                homes.setdefault(name, []).append(str(path.relative_to(ROOT)))
    assert {name: where for name, where in homes.items() if len(where) > 1} == {}


def public_types(tree: ast.Module) -> list[str]:
    classes = [node.name for node in tree.body if isinstance(node, ast.ClassDef)]
    assigned = [
        t.id for node in tree.body if isinstance(node, ast.Assign) for t in node.targets if isinstance(t, ast.Name)
    ]
    aliases = [name for name in assigned if re.fullmatch(r"[A-Z]+[a-z]\w*", name)]
    return [name for name in (*classes, *aliases) if not name.startswith("_")]
