"""A bundle of modes standard and precise judged anew: its own answers to fresh presses, and its card rewritten.

Nothing is trained: networks, surrogate and golden vectors stay byte by byte. Random presses tell how often intervals
hold, recordings with every drift the critical values, as after a training (`ramp_training.ModeEvaluation`).
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from device.files.bundle_file import read_ramp_model
from device.measurement.bundle import CARD_FILE
from device.measurement.mode import Mode
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.simulation.virtual_probe import ProbeTables
from host_tools.paper_network.export import write_folder
from host_tools.press_models.export import mode_entry
from host_tools.press_models.onnx_networks import budget_entry
from host_tools.press_models.ramp_training import ModeEvaluation, TrainingBudget

COUNTED: dict[Mode, tuple[str, str]] = {
    "precise": ("evaluated_scans", "test_scans"),
    "standard": ("evaluated", "test_recordings"),
}
"""How many presses and recordings judge each mode: fields of `TrainingBudget`."""


def judge_bundle(
    folder: Path,
    tables: ProbeTables,
    *,
    budget: TrainingBudget | None = None,
    seed: int = 1,
    jobs: int = -1,
    say: Callable[[str], None] = lambda step: None,
) -> None:
    """Judge a bundle, mode by mode; each mode's entry is written as soon as it is known, whole or not at all.

    The dial of a mode stays. Raises `InvalidQuantity` for a commissioned probe's bundle, whose presses are others,
    and `BundleRefused` for one that does not hold.
    """
    model = read_ramp_model(folder)
    if isinstance(model.answers, OwnAnswers):
        raise InvalidQuantity("bundle", folder.name, "one of the design", "commission the probe again: that judges it")
    evaluation = ModeEvaluation(tables, model.answers, model.first_guesses, model.ranges.log_odds, seed, jobs, say)
    asked = asdict(budget or TrainingBudget())
    for mode, names in COUNTED.items():
        counts = {name: asked[name] for name in names}
        entry = mode_entry(mode, evaluation.of_mode(mode, *counts.values()))
        files = {path.name: path.read_bytes() for path in folder.iterdir()}
        card = json.loads(files[CARD_FILE])
        card["modes"][mode] |= entry
        card["effort"] |= budget_entry(counts)
        files[CARD_FILE] = (json.dumps(card, indent=1, allow_nan=False) + "\n").encode()
        write_folder(folder, files)
