"""What a press is asked for: how much time it may take, and so which frames it needs and who answers.

quick: one frame and one network. standard: ten frames over the force. precise: a scan, two to five presses as those of
standard at different places on the lesion. paper: ten frames at one force, three features, as Lee & Won 2013.
Measured error and time of each: the model cards, and docs/modes.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

from device.measurement.quantities import InvalidQuantity

Mode = Literal["quick", "standard", "precise", "paper"]
MODES: tuple[Mode, ...] = get_args(Mode)

RAMP_RATIO = 2.0
"""From this ratio of its largest to its smallest force on, a press is a ramp."""
RAMP_FROM_N, RAMP_TO_N = 0.08, 0.60
"""Forces of a ramp's first and last frame: some 0.4 to 3 mm of indentation."""


@dataclass(frozen=True)
class Frames:
    """Frames that a press of a mode takes, beside the lesion and again on it: at one force, or over a ramp.

    Beside the lesion it is one press; on it as many as `fewest_ramps` to `most_ramps`, each at another place.
    """

    count: int
    is_ramp: bool
    fewest_ramps: int = 1
    most_ramps: int = 1

    @property
    def is_scan(self) -> bool:
        """Whether the lesion is pressed more than once."""
        return self.most_ramps > 1


FRAMES: dict[Mode, Frames] = {
    "quick": Frames(1, is_ramp=False),
    "standard": Frames(10, is_ramp=True),
    "precise": Frames(10, is_ramp=True, fewest_ramps=2, most_ramps=5),
    "paper": Frames(10, is_ramp=False),
}


@dataclass(frozen=True)
class ModeWorth:
    """What a mode's answers are worth, as its model card says: measured on random presses of the simulated probe, or of
    a commissioned one as it is believed to be.

    `compute_s`: the time of an answer on the machine that measured. `answered_ratio`: the share of presses that got
    numbers; of those, by unknown, the median error in percent and the share that was called determined.
    `reachable_half_width`: half of the narrowest 90 % interval that can be had, by unknown in its own unit; None where
    nothing is known. `half_width_by_ramps`: of scans of so many ramps, those that 5, 10, ... 95 % of the inclusions
    have at most; {} where nothing is known.
    """

    compute_s: float
    answered_ratio: float
    median_percent: Mapping[str, float]
    determined_ratio: Mapping[str, float]
    reachable_half_width: Mapping[str, float] | None = None
    half_width_by_ramps: Mapping[int, Mapping[str, tuple[float, ...]]] = field(default_factory=dict)


def mode_of(force_n: Sequence[float], ramps: int = 1) -> Mode:
    """Return the mode that reads most of press frames at these forces, which are those of so many ramps."""
    if ramps > 1:
        return "precise"
    if not force_n or max(force_n) <= 0.0 or max(force_n) < RAMP_RATIO * min(force_n):
        return "quick" if len(force_n) == FRAMES["quick"].count else "paper"
    return "standard"


def is_possible(mode: Mode, frames: int, ramps: int) -> bool:
    """Return whether a press of a mode can have left so many press frames on the lesion, of so many ramps.

    A scan may be finished after its first ramp.
    """
    taken = FRAMES[mode]
    return 1 <= ramps <= taken.most_ramps and frames == taken.count * ramps


def mode_named(name: str) -> Mode:
    """Return the mode of a name; raise `InvalidQuantity` naming all of them."""
    for mode in MODES:
        if mode == name:
            return mode
    raise InvalidQuantity("mode", repr(name), f"one of {', '.join(MODES)}", "choose one of them")
