"""Speed and accuracy of a bundle's modes into its model card, so that a probe can say what each mode is worth.

Every bundle is measured on the same presses. Times are of the machine that trained, which the card names.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

from device.measurement.estimate import Estimate
from device.measurement.mode import Mode
from device.measurement.model_card import CARD_FILE
from device.measurement.recording import Recording
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.export import write_folder
from host_tools.study.mode_dial import dial_entry, timed_presses


def publish_dial(
    folder: Path, modes: Sequence[Mode], answer: Callable[[Recording, Mode], Estimate], tables: ProbeTables
) -> None:
    """Measure modes of the bundle in a folder, and write what was found to its card; whole or not at all."""
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    card = json.loads(files[CARD_FILE])
    for mode in modes:
        card["modes"][mode]["dial"] = dial_entry(mode, timed_presses(answer, mode, tables))
    files[CARD_FILE] = (json.dumps(card, indent=1, allow_nan=False) + "\n").encode()
    write_folder(folder, files)
