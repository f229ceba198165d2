"""Where the files that come with the program lie: models, protocols, systemd's files, templates of pages.

In the source tree, also where that is installed as editable, they stand at its root, to be seen and edited. A wheel
carries them inside the package `device`, where setup.py puts them at build time. All else asks here.
"""

from __future__ import annotations

from pathlib import Path

FOLDERS = {"models": "models", "protocols": "protocols", "systemd": "systemd", "templates": "docs/templates"}
"""Name of each folder in the wheel, and where it stands in the source tree."""
IN_WHEEL = "device/shipped"
_ROOT = Path(__file__).resolve().parents[2]
_INSTALLED = (_ROOT / IN_WHEEL).is_dir()
SOURCE_TREE: Path | None = None if _INSTALLED else _ROOT
"""Root of the source tree that runs; none where a wheel was installed."""


def shipped(name: str) -> Path:
    """Return a folder of `FOLDERS`."""
    return _ROOT / IN_WHEEL / name if _INSTALLED else _ROOT / FOLDERS[name]


MODELS = shipped("models")
SIMULATED_PROBE = MODELS / "simulated_probe"
CERTIFICATES = {"physical": "calibration.json", "linear": "calibration_linear.json"}
"""Certificates of the simulated probe in there, by the light that it is to have."""
PROTOCOLS = shipped("protocols")
UNITS = shipped("systemd")
TEMPLATES = shipped("templates")
