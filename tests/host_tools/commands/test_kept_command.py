"""The command that a page keeps measures the same again: parsed anew it asks for what was asked for."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
import typer

from device.files.shipped import SOURCE_TREE
from host_tools.__main__ import app
from host_tools.commands.measured_chapters import repeating
from host_tools.commands.modes import modes
from host_tools.commands.tradeoff import tradeoff
from host_tools.commands.verify import verify
from host_tools.commands.worlds import robustness

GIVEN = [
    (modes, {"model": Path("models/quick"), "table": Path("my tables"), "only": ["dial", "scan"], "seed": 7}),
    (robustness, {"probes": 20, "presses": 50, "seed": 2, "only": ["one at a time"], "phantoms": Path("p.toml")}),
    (tradeoff, {"only": ["light"], "short": True, "model": Path("models/x")}),
    (verify, {"only": ["hertz"], "extremes": True, "tolerances": True, "scenes": 9, "seed": 0}),
]


@pytest.mark.parametrize(("verb", "given"), GIVEN, ids=lambda part: getattr(part, "__name__", None))
def test_everything_that_was_asked_for_is_asked_for_again(
    verb: Callable[..., None], given: Mapping[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(SOURCE_TREE or ".")
    program, name, *words = shlex.split(repeating(verb, given))
    asked = typer.main.get_command(app).commands[name].make_context(name, words).params  # type: ignore[attr-defined]
    assert program == "host_tools"
    assert {one: asked[one] for one in given} == {one: _as_parsed(value) for one, value in given.items()}


def _as_parsed(value: object) -> object:
    """Return what Typer's parser makes of a value, before the verb has it."""
    if isinstance(value, list):
        return tuple(value)
    return str(value) if isinstance(value, Path) else value


def test_what_is_as_by_default_is_left_out() -> None:
    out = (SOURCE_TREE or Path()) / "docs" / "modes.md"
    assert repeating(modes, {"out": out, "only": None, "seed": 1}) == "host_tools modes --out docs/modes.md"
    assert repeating(robustness, {"probes": 20, "seed": 1}, always=["probes"]) == "host_tools robustness --probes 20"
