"""Model folders as they are installed, or with one byte of the network changed, as a worn card changes it.

The installed files stay as they are: what is tampered with is a copy.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from device.simulation.faults import FaultTimeline

NETWORK = "model.onnx"


class EmulatedBundles:
    """The model folders of a scenario; copies are made below `scratch`."""

    def __init__(self, faults: FaultTimeline, scratch: Path) -> None:
        self._faults, self._scratch = faults, scratch

    def folder(self, installed: Path) -> Path:
        """Return the folder to read instead of an installed one: itself unless it is tampered with now."""
        if not (installed.is_dir() and self._faults.is_active("bundle_tampered")):
            return installed
        copy = self._scratch / installed.name
        shutil.copytree(installed, copy, dirs_exist_ok=True)
        network = bytearray((installed / NETWORK).read_bytes())
        network[len(network) // 2] ^= 1
        (copy / NETWORK).write_bytes(network)
        return copy
