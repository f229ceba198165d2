"""A scene to a TOML file and back: what is written reads as the same scene, and a misspelt key is refused."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import tomli_w

from device.files.durable import write_durably
from device.files.toml_record import read_toml
from host_tools.scenes.scene import Scene


def read_scene(path: Path) -> Scene:
    """Return the scene of a TOML file; keys that are absent take the defaults.

    Raise `InvalidQuantity` naming the key, the line or the two quantities that contradict each other.
    """
    return read_toml(Scene, path)


def write_scene(scene: Scene, path: Path) -> None:
    """Write a scene with every value in it, so that later defaults do not change it."""
    write_durably(path, tomli_w.dumps(_without_none(asdict(scene))).encode())


def _without_none(table: dict[str, Any]) -> dict[str, Any]:
    """Leave out what is None, all the way down: TOML has no null, absence says it."""
    kept = {key: value for key, value in table.items() if value is not None}
    return {key: _without_none(value) if isinstance(value, dict) else value for key, value in kept.items()}
