"""A scene to a TOML file and back: what is written reads as the same scene, and a misspelt key is refused."""

from __future__ import annotations

from pathlib import Path

import tomli_w

from device.files.durable import write_durably
from device.files.toml_record import as_table, read_toml
from host_tools.scenes.scene import Scene


def read_scene(path: Path) -> Scene:
    """Return the scene of a TOML file; keys that are absent take the defaults.

    Raise `InvalidQuantity` naming the key, the line or the two quantities that contradict each other.
    """
    return read_toml(Scene, path)


def write_scene(scene: Scene, path: Path) -> None:
    """Write a scene with every value in it, so that later defaults do not change it."""
    write_durably(path, tomli_w.dumps(as_table(scene, without_none=True)).encode())
