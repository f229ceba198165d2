"""Presses of probes and hands as a builder's tolerances allow to the networks that tell their ranges.

The design's own networks know neither tilts nor skin: where these are, they see inclusions outside the ranges, so the
limit by presses of a commissioned probe was ten in log odds, and hardly any press outside was refused. These
have seen the same presses in and around the ranges, each of another probe, hand and skin. One set is for all
commissioned probes: what is believed of one is taken off its rows before, and its limit is by its own presses.
Source: `press_models/train_range`; docs/own_probe.md.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array, Single
from device.measurement.bundle import CARD_FILE
from device.measurement.parameters import normalise
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.commissioned.own_posterior import to_bright_side
from device.measurement.ramp_modes.commissioned.own_probe import Place
from device.measurement.ramp_modes.estimate import stands_out
from device.measurement.ramp_modes.radial_profile import network_rows
from device.measurement.ramp_modes.range_classifier import OWN_ENTRY, OWN_RANGE_FILE, RangeClassifier
from device.simulation.virtual_probe import ProbeTables
from host_tools.commissioning.believed_presses import moved
from host_tools.paper_network.export import write_folder
from host_tools.press_models.mode_outcome import CRITICAL_RATIO
from host_tools.press_models.noisy_presses import BLOCK, NoiseSampler, PressSet
from host_tools.press_models.onnx_networks import build_range_network, range_entry
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed
from host_tools.press_models.train_range import (
    RangeBudget,
    TrainedRange,
    WideSurrogate,
    draw_wide_parameters,
    is_outside,
    train_network,
    wide_presses,
)
from host_tools.probe_tables.out_of_range_table import WideTable

DRAWN = 500
"""Presses that one job draws."""
JUDGED = 8_000
"""Presses in and around the ranges, of which it is told how many outside are noticed."""


class OwnRange(NamedTuple):
    """The trained networks, and of presses outside that stand out the share that they notice, at the limit that
    refuses `1 - CRITICAL_RATIO` of those inside; and the share by the design's networks."""

    trained: TrainedRange
    noticed: float
    noticed_by_design: float


def train_own_range(
    tables: ProbeTables,
    wide: WideTable,
    answers: OwnAnswers,
    of_design: RangeClassifier,
    *,
    budget: RangeBudget | None = None,
    seed: int = 1,
    jobs: int = -1,
    say: Callable[[str], None] = lambda step: None,
) -> OwnRange:
    """Return the networks; `answers` believe in a builder's tolerances, `of_design` knows none. As `train_range`."""
    asked = budget or RangeBudget()
    found = wide_presses(tables, wide, asked, seed, jobs, say)
    say(f"{asked.trained_on} of them on probes of random tolerances")
    presses = tolerant_press_set(found.surrogate, answers, asked.trained_on, seed, jobs)
    say(f"{asked.members} networks for the ranges of commissioned probes")
    network = train_network(presses, derived_seed(seed, "ranges of commissioned probes"), asked, jobs)
    judged = tolerant_press_set(found.surrogate, answers, JUDGED, derived_seed(seed, "judged"), jobs)
    own, design = (lambda rows: network.log_odds(network_rows(rows))), of_design.log_odds
    shares = (noticed_outside(log_odds, judged, answers, seed) for log_odds in (own, design))
    return OwnRange(TrainedRange(network, found.error, found.sha256, asked), *shares)


def noticed_outside(log_odds: Callable[[Array], Array], presses: PressSet, answers: OwnAnswers, seed: int) -> float:
    """Return of the presses outside whose contrast stands out the share whose odds exceed the limit of those inside."""
    rng = np.random.default_rng(derived_seed(seed, "judged noise"))
    rows = presses.noisy(np.arange(len(presses.rows)), rng).astype(np.float64)
    shown = np.array([stands_out(row, answers.noise) for row in rows])
    outside, odds = is_outside(presses.normalised)[shown], log_odds(rows[shown])
    return float(np.mean(odds[outside] > np.quantile(odds[~outside], CRITICAL_RATIO)))


def tolerant_press_set(
    surrogate: WideSurrogate, answers: OwnAnswers, count: int, seed: int, jobs: int = -1
) -> PressSet:
    """Return random presses in and around the ranges, each of a probe, a hand and a skin as `answers` believe in them.

    What these change is known inside the ranges; outside it is that of the nearest press inside.
    """
    rng = np.random.default_rng(derived_seed(seed, "presses of commissioned probes around the ranges"))
    parameters = draw_wide_parameters(count, rng)
    direction_rad, at = rng.uniform(0, 2 * np.pi, count), normalise(parameters)
    of_blocks = [slice(start, start + BLOCK) for start in range(0, count, BLOCK)]
    rows = np.concatenate([surrogate.rows(parameters[one], direction_rad[one]) for one in of_blocks])
    blocks = [slice(start, start + DRAWN) for start in range(0, count, DRAWN)]

    def drawn(number: int) -> Single:
        own, one = np.random.default_rng([seed, number]), blocks[number]
        each = zip(rows[one], np.clip(at[one], -1, 1), direction_rad[one], strict=True)
        return np.array([_seen(answers, *press, own) for press in each], np.float32)

    seen = np.concatenate(in_parallel(drawn, len(blocks), jobs))
    return PressSet(at.astype(np.float32), seen, direction_rad, NoiseSampler(answers.noise))


def _seen(answers: OwnAnswers, row: Array, at: Array, direction_rad: float, rng: np.random.Generator) -> Array:
    """Return the row [P] of one press, along its bright side, as probe and hand may have it."""
    towards = np.array([direction_rad])
    seen = moved(answers, Place(at[None], np.zeros(1), towards), row[None], rng)
    return np.asarray(to_bright_side(seen, towards).rows[0])


def publish_own_range(folder: Path, trained: TrainedRange, command: str) -> None:
    """Write the networks into the bundle of the design's ramp modes, and to its card; whole or not at all.

    Raises `ExportRefused` when onnxruntime and NumPy differ.
    """
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    card, network = json.loads(files[CARD_FILE]), build_range_network(trained.network)
    entry = range_entry(trained, network, np.array(card["golden"]["features"]))
    card[OWN_ENTRY] = {"training_command": command, **entry}
    files |= {OWN_RANGE_FILE: network, CARD_FILE: (json.dumps(card, indent=1, allow_nan=False) + "\n").encode()}
    write_folder(folder, files)
