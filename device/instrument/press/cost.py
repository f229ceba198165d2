"""What a press of a mode costs and what its answer is worth, for whoever chooses one.

The time of a press is that of one of those that make a measurement, from when its first frame may be taken. The time
to the answer, from the last frame until it is shown, is measured by the presses themselves: nothing else has frames to
answer. A mode that was not pressed yet is expected to be as much slower than its model
card says as the longest one that was; before the first press, to take what the card says. Errors are the card's,
measured on simulated presses (docs/modes.md) or on those that commissioning believes in (docs/own_probe.md).
"""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, Literal

from device.config import Config
from device.instrument.press.machine import STEADY_WINDOW_S
from device.measurement.mode import FRAMES, MODES, RAMP_FROM_N, RAMP_TO_N, Mode, ModeWorth

log = logging.getLogger(__name__)

EASY_RATIO = 0.5
"""A hand that is not driven takes this part of the largest rate of a ramp."""
KEPT_TIMES = 9
"""So many of the last presses of a mode tell how long its answer takes."""
LEAST_STATED_S = 1e-4
"""Cards round what an answer takes; one that says 0 takes less than this."""
LONGEST_ANSWER_S = 600.0


@dataclass(frozen=True)
class PressCost:
    """One mode: `frames` of each press, at one force (from_n = to_n) or over a ramp, and `seconds` of one press.

    `fewest_ramps` to `most_ramps` presses on the lesion follow the one beside it.
    """

    mode: Mode
    frames: int
    kind: Literal["hold", "ramp"]
    from_n: float
    to_n: float
    seconds: float
    fewest_ramps: int = 1
    most_ramps: int = 1


def press_cost(mode: Mode, config: Config) -> PressCost:
    """Return what a press of a mode costs on a probe with these settings."""
    press, of_mode = config.press, FRAMES[mode]
    frames_s, ramps = of_mode.count / config.camera.frame_rate_hz, (of_mode.fewest_ramps, of_mode.most_ramps)
    if of_mode.is_ramp:
        seconds = max((RAMP_TO_N - RAMP_FROM_N) / (EASY_RATIO * press.max_rate_n_per_s), frames_s)
        return PressCost(mode, of_mode.count, "ramp", RAMP_FROM_N, RAMP_TO_N, round(seconds, 1), *ramps)
    seconds = round(STEADY_WINDOW_S + frames_s, 1)
    return PressCost(mode, of_mode.count, "hold", press.target_n, press.target_n, seconds, *ramps)


@dataclass(frozen=True)
class ModeOffer:
    """One mode as a client chooses it: its cost, and what its answer is worth as far as that is known.

    `answer_s`: from the last frame to the answer, the median of `answer_presses` presses on this probe, of none what is
    expected. `worth` is the model card's.
    """

    cost: PressCost
    answer_s: float | None
    answer_presses: int
    worth: ModeWorth | None

    def as_record(self) -> dict[str, Any]:
        """Return the JSON object of `GET device`."""
        worth = self.worth
        return {
            **vars(self.cost),
            "answer_s": self.answer_s,
            "answer_presses": self.answer_presses,
            "typical_error_percent": worth and dict(worth.median_percent),
            "answered_ratio": worth and worth.answered_ratio,
            "determined_ratio": worth and dict(worth.determined_ratio),
            "reachable_half_width": _as_record(worth.reachable_half_width) if worth else None,
            "half_width_by_ramps": {f"{n}": dict(row) for n, row in worth.half_width_by_ramps.items()} if worth else {},
        }


def _as_record(numbers: Mapping[str, float] | None) -> dict[str, float] | None:
    return None if numbers is None else dict(numbers)


class AnswerTimes:
    """How long the last answers of each mode took on this probe (s), kept in a file for the next start.

    It may be lost or damaged: then it begins anew. The procedure's thread alone writes it.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._times_s: dict[Mode, list[float]] = {mode: [] for mode in MODES}
        try:
            kept = json.loads(path.read_text(encoding="utf-8"))
            self._times_s |= {mode: [one for one in kept.get(mode, []) if _is_time_s(one)] for mode in MODES}
        except FileNotFoundError:
            pass
        except (OSError, ValueError, AttributeError, TypeError) as error:
            log.warning("How long answers took, %s, cannot be read: %s.", path, error)

    def note(self, mode: Mode, seconds: float) -> None:
        """Add the time of an answer; a disk that is full keeps it from nothing but the next start."""
        self._times_s[mode] = [*self._times_s[mode], round(seconds, 4)][-KEPT_TIMES:]
        try:
            self._path.write_text(json.dumps(self._times_s), encoding="utf-8")
        except OSError as error:
            log.warning("How long answers took cannot be kept in %s: %s.", self._path, error)

    def offers(self, costs: Sequence[PressCost], worth: Mapping[Mode, ModeWorth | None]) -> list[ModeOffer]:
        """Return modes with what their answers took, or are expected to take."""
        measured_s = {mode: round(median(times_s), 3) for mode, times_s in self._times_s.items() if times_s}
        stated_s = {mode: one.compute_s for mode, one in worth.items() if one}
        both = sorted(measured_s.keys() & stated_s.keys(), key=lambda mode: stated_s[mode])
        slower = measured_s[both[-1]] / max(stated_s[both[-1]], LEAST_STATED_S) if both else 1.0
        expected_s = {mode: round(slower * one, 3) for mode, one in stated_s.items()}
        answer_s = {**expected_s, **measured_s}
        return [
            ModeOffer(cost, answer_s.get(cost.mode), len(self._times_s[cost.mode]), worth.get(cost.mode))
            for cost in costs
        ]


def _is_time_s(value: object) -> bool:
    return isinstance(value, float) and math.isfinite(value) and 0.0 <= value <= LONGEST_ANSWER_S
