"""What a refusal names: which block of the row is said to depart, of presses that differ in one thing.

Only presses that are refused for their misfit count; sizes are such that some are. Two inclusions and gel on the face
are recorded by the whole camera, all else are rows with noise as it is believed. Those two are no single round
inclusion, so it stands beside what their answers are worth where no test refuses them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.estimate import stands_out
from device.measurement.ramp_modes.misfit_blocks import BLOCKS, BlockMisfit, RowBlock
from device.measurement.ramp_modes.model import CriticalValues
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.ramp_modes.radial_profile import SeenPresses, press_profiles, seen_presses
from host_tools.commissioning.left_out import answer_to_seen
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least
from host_tools.press_models.recorded_presses import in_parallel, recorded_press
from host_tools.press_models.seeds import derived_seed, press_seed
from host_tools.scores.foreign_presses import ForeignPresses
from host_tools.scores.one_thing.causes import NOTHING, CauseToName, causes_to_name
from host_tools.scores.one_thing.press_answers import SHIPPED, TOLERANT, DesignToTry, with_tolerances
from host_tools.scores.one_thing.tried_presses import Setting, TruthDesign, random_design, tried_presses
from host_tools.scores.outside import WET_RATIO, draw_clear, neighbour_beside
from host_tools.scores.scored_presses import FIGURES, ScoredPresses, figures_of, scored

PRESSES, RECORDED_PRESSES = 16, 40
NAMED_AT_LEAST = 0.9
SPOKEN: dict[RowBlock, str] = {block: block.replace("_", " ") for block in BLOCKS}
HEADER = ("what differs", "by", "answered by", "stand out", "refused", *SPOKEN.values(), "none", "is of")
TWO, GEL = "two inclusions", "gel on the face"
RECORDED: dict[str, RowBlock | None] = {TWO: None, GEL: "reference_response"}


class Answering(NamedTuple):
    """What answers, by its name in the tables, and above what it refuses."""

    name: str
    answers: RampAnswers
    critical: CriticalValues


@dataclass(frozen=True)
class NamedBlocks:
    """Of presses in which something stands out: how many there are, how many are refused for their misfit, and what is
    named how often of these; misfits of the blocks of all presses."""

    shown: int
    refused: int
    named: Counter[RowBlock | None]
    blocks: list[dict[RowBlock, BlockMisfit]]

    def median_ratio(self, block: RowBlock) -> float:
        """Return the median misfit per column of a block."""
        return float(np.median([one[block].ratio for one in self.blocks]))


def named_blocks_chapter(
    design: DesignToTry,
    *,
    presses: int = PRESSES,
    recorded: int = RECORDED_PRESSES,
    things: Sequence[CauseToName] | None = None,
    seed: int = 1,
    jobs: int = -1,
) -> Chapter:
    """Return what is named of presses that differ in each of `causes_to_name`, or of those given, and of two inclusions
    and gel; and how well such are answered where they are, of so many `recorded`."""
    own, model = with_tolerances(design, seed), design.model
    answering = (
        Answering(SHIPPED, model.answers, model.critical["standard"]),
        Answering(TOLERANT, own.answers, own.critical["standard"]),
    )
    truths = random_design(presses, 0, seed)
    rows: list[tuple[str, ...]] = []
    found: dict[str, list[tuple[RowBlock, NamedBlocks]]] = {one.name: [] for one in answering}

    def add(quantity: str, size: str, block: RowBlock | None, seen: Sequence[SeenPresses]) -> None:
        for one in answering:
            named = named_in(seen, one, design, jobs)
            rows.append((quantity, size, one.name, *_cells(named, block)))
            if block:
                found[one.name].append((block, named))

    for thing in things or causes_to_name():
        add(thing.cause.quantity, thing.cause.size, thing.block, _tried(thing, design, truths, jobs))
    outside = {name: _recorded(name, design, recorded, seed, jobs) for name in RECORDED}
    for name, block in RECORDED.items():
        add(name, "", block, outside[name].seen)
    scores = {
        (name, by.name): scored(by.answers, model, by.critical, taken, jobs)
        for name, taken in outside.items()
        for by in answering
    }
    as_believed = _tried(CauseToName(NOTHING, None), design, truths, jobs)
    nothing = {one.name: named_in(as_believed, one, design, jobs) for one in answering}
    return Chapter(
        title="What a refusal names",
        claim=f"{presses} random presses that differ in one thing, in mode standard: which block of the row is named.",
        source="host_tools/scores/one_thing/named_blocks.py; device/measurement/ramp_modes/misfit_blocks.py",
        benchmarks=tuple(_benchmarks(found)),
        tables=(
            Table("Blocks named of the presses that are refused for their misfit", HEADER, tuple(rows)),
            _answered(scores),
            _medians(nothing),
        ),
        facts={"presses": presses, "recorded": recorded, "two": _facts(scores[TWO, TOLERANT])},
    )


def named_in(seen: Sequence[SeenPresses], by: Answering, design: DesignToTry, jobs: int) -> NamedBlocks:
    """Return what is named of the presses in which something stands out to who answers."""
    shown = [one for one in seen if stands_out(one.rows[0], by.answers.noise)]
    guess = design.model.first_guesses
    found = in_parallel(lambda number: answer_to_seen(by.answers, guess, shown[number]), len(shown), jobs)
    departures = [by.answers.departure(*pair) for pair in zip(shown, found, strict=True)]
    is_refused = [one.misfit_ratio > by.critical.misfit_ratio for one in found]
    named = Counter(one.block for one, refused in zip(departures, is_refused, strict=True) if refused)
    return NamedBlocks(len(shown), sum(is_refused), named, [dict(one.blocks) for one in departures])


def _tried(thing: CauseToName, design: DesignToTry, truths: TruthDesign, jobs: int) -> list[SeenPresses]:
    return tried_presses(
        truths,
        lambda number, rng: [Setting(design.tables, world) for world in thing.cause.worlds(rng)],
        design.model.answers.noise,
        jobs=jobs,
    ).single.seen


def _recorded(name: str, design: DesignToTry, presses: int, seed: int, jobs: int) -> ForeignPresses:
    """Return what is read of recordings of inclusions that show well, with a second one beside or gel on the face."""
    rng = np.random.default_rng(derived_seed(seed, name))
    parameters = draw_clear(presses, rng)
    neighbours = [neighbour_beside(one, rng) if name == TWO else None for one in parameters]
    wet_ratios = rng.uniform(*WET_RATIO, presses) if name == GEL else np.zeros(presses)

    def read(number: int) -> SeenPresses:
        recording = recorded_press(
            design.tables,
            parameters[number],
            "standard",
            press_seed(seed, number),
            levels=ErrorLevels(),
            neighbour=neighbours[number],
            wet_ratio=float(wet_ratios[number]),
        )
        return seen_presses(press_profiles(recording))

    return ForeignPresses(parameters, in_parallel(read, presses, jobs))


def _answered(scores: Mapping[tuple[str, str], ScoredPresses]) -> Table:
    """Return how many of what is no single round inclusion are answered, and how well: as the first inclusion."""
    rows = ((*case, *figures_of(found)) for case, found in scores.items())
    return Table(
        "Answers where no test refuses, in mode standard", ("what differs", "answered by", *FIGURES), tuple(rows)
    )


def _facts(found: ScoredPresses) -> dict[str, float | None]:
    """Return the shares of presses that are answered, and of determined sizes that are covered; None without any."""
    covered = float(found.determined_covered()[0])
    return {"answered": found.share_answered(), "size_covered": covered if covered == covered else None}


def _cells(found: NamedBlocks, block: RowBlock | None) -> tuple[str, ...]:
    counts = [f"{found.named[one]}" if found.refused else "" for one in (*BLOCKS, None)]
    return (f"{found.shown}", f"{found.refused}", *counts, SPOKEN[block] if block else "several")


def _benchmarks(found: dict[str, list[tuple[RowBlock, NamedBlocks]]]) -> list[Benchmark]:
    """Return how often the block that a thing is of is named, of all presses refused of things that are of one."""
    shares = {
        name: sum(one.named[block] for block, one in of_one) / max(sum(one.refused for _, one in of_one), 1)
        for name, of_one in found.items()
    }
    return [at_least(name, "right block named", share, NAMED_AT_LEAST) for name, share in shares.items()]


def _medians(nothing: dict[str, NamedBlocks]) -> Table:
    """Return the misfits of blocks where nothing differs."""
    rows = [
        (name, f"{found.shown}", *(f"{found.median_ratio(block):.2f}" for block in BLOCKS))
        for name, found in nothing.items()
    ]
    return Table(
        "Median misfit of a column where nothing differs", ("answered by", "stand out", *SPOKEN.values()), tuple(rows)
    )
