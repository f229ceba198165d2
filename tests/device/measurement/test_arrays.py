"""One name for one kind of array: `Array` and `Single` are declared in one module and imported from nowhere else."""

import ast

from daemon_process import ROOT

HOME = "device.measurement.arrays"
NAMES = {"Array", "Single"}


def declared(tree):
    """Names that a module assigns."""
    targets = (target for node in ast.walk(tree) if isinstance(node, ast.Assign) for target in node.targets)
    return {target.id for target in targets if isinstance(target, ast.Name)}


def imported_from_elsewhere(tree):
    """Names of arrays that a module takes from another module than their own."""
    imports = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module != HOME)
    return {alias.name for node in imports for alias in node.names}


def test_arrays_are_declared_once():
    sources = [path for room in ("device", "host_tools") for path in (ROOT / room).rglob("*.py")]
    assert len(sources) > 300
    for path in sources:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        own = path == ROOT / "device" / "measurement" / "arrays.py"
        assert own or not NAMES & (declared(tree) | imported_from_elsewhere(tree)), path
