"""The virtual operator's hand: it reads the screen's guidance and follows it, late and with a tremor.

A hand moves its force at a limited rate towards what it wants, so the force is a function of time that light, image
and load cell can all ask for. Physiological tremor: 8-12 Hz (Elble & Randall, 1978; Elble & Koller, Tremor, 1990), plus
a slow drift; that a force which is held is never still: Slifkin & Newell, J. Exp. Psychol. HPP 25 (1999). Amplitudes
are assumed.
"""

from __future__ import annotations

import math
import random
from collections import deque
from dataclasses import dataclass, replace
from threading import Lock

from device.measurement.mode import RAMP_TO_N
from device.measurement.quantities import Bound, require
from device.simulation.physics.pressed_face import ProbePlacement

BESIDE_MM = (40.0, 0.0)
"""Where the hand presses for the reference: far enough that the inclusion is not felt."""
TOUCH_N, RAMP_AIM_N = 0.06, RAMP_TO_N + 0.06
"""What a hand takes a touch to be, and how far it means to go when it is to press slowly harder."""
TAKEN_UP_FOR = ("hold_block", "put_weight")
"""In a self-test the probe is taken up when it says so; tissue beside the lesion is the block, `aim_n` the weight."""
TREMOR_HZ = 9.3
TREMOR_BEAT = 11.1 / 9.3
"""A second sine makes tremor swell and fade: its frequency over that of the first, and half its size."""
USUAL_ASIDE_MM = 4.0
"""How far this hand goes when it is to move aside and nobody says how far."""
ASIDE_TURN_DEG = 90.0
"""Each further place of a scan lies in another direction from the lesion's middle."""
OVERSHOOT_S = 0.15
"""How long after the hand has arrived an overshoot is largest."""
REMEMBERED_MOVES = 8
"""The last motions: light, image and load cell ask about a time that is a little past."""
ACTION = "describe a human hand"


@dataclass(frozen=True)
class HandSettings:
    """How this operator presses; `miss` is where the lesion is pressed beside its middle, `tilt` how it leans.

    `rate_n_per_s` is how fast it goes to a force that it then holds, `ramp_rate_n_per_s` what it takes for slowly,
    `ramp_aim_n` how far that goes. `corrects_to_n`: where it takes a held force when the screen says harder or lighter,
    not at all without. `overshoot_ratio`: how far it first goes beyond its aim. `fade_n_per_s`: how fast a force that
    it means to hold changes. `early_lifts`: so often it lifts a press `lifts_after_s` after it has begun it.
    `held_n`: the force with which it holds the probe on something from the start on, until the screen shows a fault.
    `aside_error_mm`: how far it places the probe from where a scan wants it next, standard deviation in x and in y;
    `seed` of these errors.
    """

    rate_n_per_s: float = 0.45
    ramp_rate_n_per_s: float = 0.15
    reaction_s: float = 0.25
    aim_n: float = 0.5
    ramp_aim_n: float = RAMP_AIM_N
    corrects_to_n: float | None = None
    overshoot_ratio: float = 0.0
    fade_n_per_s: float = 0.0
    early_lifts: int = 0
    lifts_after_s: float = 1.0
    held_n: float = 0.0
    tremor_hz: float = TREMOR_HZ
    tremor_n: float = 0.002
    drift_n: float = 0.006
    miss_x_mm: float = 0.0
    miss_y_mm: float = 0.0
    tilt_x_deg: float = 0.0
    tilt_y_deg: float = 0.0
    aside_error_mm: float = 1.0
    seed: int = 1

    def __post_init__(self) -> None:
        require("hand.rate_n_per_s", self.rate_n_per_s, Bound(0.01, 10.0, "N/s"), ACTION)
        require("hand.ramp_rate_n_per_s", self.ramp_rate_n_per_s, Bound(0.01, 10.0, "N/s"), ACTION)
        require("hand.reaction_s", self.reaction_s, Bound(0.0, 5.0, "s"), ACTION)
        for name in ("aim_n", "ramp_aim_n", "held_n"):
            require(f"hand.{name}", getattr(self, name), Bound(0.0, 5.0, "N"), ACTION)
        if self.corrects_to_n is not None:
            require("hand.corrects_to_n", self.corrects_to_n, Bound(0.0, 5.0, "N"), ACTION)
        require("hand.overshoot_ratio", self.overshoot_ratio, Bound(0.0, 5.0, ""), ACTION)
        require("hand.fade_n_per_s", self.fade_n_per_s, Bound(-5.0, 5.0, "N/s"), ACTION)
        require("hand.early_lifts", self.early_lifts, Bound(0, 1000, ""), ACTION)
        require("hand.lifts_after_s", self.lifts_after_s, Bound(0.01, 60.0, "s"), ACTION)
        require("hand.tremor_hz", self.tremor_hz, Bound(1.0, 30.0, "Hz"), ACTION)
        require("hand.tremor_n", self.tremor_n, Bound(0.0, 1.0, "N"), ACTION)
        require("hand.drift_n", self.drift_n, Bound(0.0, 1.0, "N"), ACTION)
        for name in ("miss_x_mm", "miss_y_mm"):
            require(f"hand.{name}", getattr(self, name), Bound(-30.0, 30.0, "mm"), ACTION)
        for name in ("tilt_x_deg", "tilt_y_deg"):
            require(f"hand.{name}", getattr(self, name), Bound(-10.0, 10.0, "deg"), ACTION)
        require("hand.aside_error_mm", self.aside_error_mm, Bound(0.0, 10.0, "mm"), ACTION)
        require("hand.seed", self.seed, Bound(0, 2**63, ""), "give a whole number from 0")

    @property
    def on_lesion_mm(self) -> tuple[float, float]:
        """Where this hand presses for the lesion."""
        return self.miss_x_mm, self.miss_y_mm


@dataclass(frozen=True)
class Move:
    """One motion of the hand: from when, from which force to which, how fast, and where.

    `overshoot_n` is how far it first goes beyond, `fade_n_per_s` how the force changes once it is there;
    `pressed_since_s`: when the press began, where that is before this motion.
    """

    since_s: float
    from_n: float
    aim_n: float
    rate_n_per_s: float
    position_mm: tuple[float, float]
    overshoot_n: float = 0.0
    fade_n_per_s: float = 0.0
    pressed_since_s: float | None = None

    def steady_n(self, t_s: float) -> float:
        """Return the force on the way from one to the other, at a limited rate, and after that."""
        gap_n = self.aim_n - self.from_n
        step_n = self.rate_n_per_s * max(t_s - self.since_s, 0.0)
        held_s = t_s - self.since_s - abs(gap_n) / self.rate_n_per_s
        if held_s <= 0.0:
            return self.from_n + math.copysign(min(step_n, abs(gap_n)), gap_n)
        beyond_n = self.overshoot_n * held_s / OVERSHOOT_S * math.exp(1 - held_s / OVERSHOOT_S)
        return self.aim_n + math.copysign(beyond_n, gap_n) + self.fade_n_per_s * held_s

    @property
    def press_began_s(self) -> float:
        """When the press began that this motion is part of."""
        return self.since_s if self.pressed_since_s is None else self.pressed_since_s


class VirtualHand:
    """Force (N) and position (mm) over time."""

    def __init__(self, settings: HandSettings) -> None:
        self.settings = settings
        self._lock = Lock()
        at_first = Move(0.0, settings.held_n, settings.held_n, settings.rate_n_per_s, BESIDE_MM)
        self._moves = deque([at_first], maxlen=REMEMBERED_MOVES)
        self._following, self._is_ramp = settings.held_n > 0.0, False
        self._lifts_left = settings.early_lifts
        self._ramp_rate_n_per_s = settings.ramp_rate_n_per_s
        self._random, self._asides = random.Random(settings.seed), 0

    def begin(self) -> None:
        """Take up the probe: from now on the hand follows the guidance."""
        self._following = True
        self._ramp_rate_n_per_s = self.settings.ramp_rate_n_per_s

    def follow(self, guidance: str, now_s: float, aside_mm: float | None = None) -> None:
        """Read one line of guidance (its code) and act on it after the reaction time.

        `aside_mm`: how far beside the lesion's middle the screen wants the next press of a scan.
        """
        self._following |= guidance in TAKEN_UP_FOR
        if not self._following:
            return
        act_s = now_s + self.settings.reaction_s
        match guidance:
            case "press_beside" | "hold_block" | "put_weight":
                self._hold(act_s, self.settings.aim_n, BESIDE_MM)
            case "press_lesion":
                self._hold(act_s, self.settings.aim_n, self.settings.on_lesion_mm)
            case "touch_beside":
                self._ramp(act_s, TOUCH_N, BESIDE_MM)
            case "touch_lesion":
                self._asides = 0
                self._ramp(act_s, TOUCH_N, self.settings.on_lesion_mm)
            case "move_aside":
                self._ramp(act_s, TOUCH_N, self._aside(USUAL_ASIDE_MM if aside_mm is None else aside_mm))
            case "press_harder" | "press_lighter" if not self._is_ramp and self.settings.corrects_to_n is not None:
                self._hold(act_s, self.settings.corrects_to_n, None)
            case "press_slowly" | "press_lighter" | "slower" | "hold_still" if self._is_ramp:
                self._go_on(act_s, guidance)
            case "lift" | "take_weight_off":
                self._hold(act_s, 0.0, None)
                self._lifts_left = self.settings.early_lifts
            case "done" | "rejected" | "fault":
                self._hold(act_s, 0.0, None)
                self._following = False

    def _aside(self, aside_mm: float) -> tuple[float, float]:
        """Return the next place of a scan: so far from where it takes the middle to be, each time to another side."""
        angle_rad = math.radians(ASIDE_TURN_DEG * self._asides)
        self._asides += 1
        (x_mm, y_mm), error_mm = self.settings.on_lesion_mm, self.settings.aside_error_mm
        return (
            x_mm + aside_mm * math.cos(angle_rad) + self._random.gauss(0.0, error_mm),
            y_mm + aside_mm * math.sin(angle_rad) + self._random.gauss(0.0, error_mm),
        )

    def _go_on(self, act_s: float, guidance: str) -> None:
        """Follow a ramp's guidance: whoever was too fast once stays slower; to hold still is to stay at the force."""
        before = self._move_at(act_s)
        if guidance == "slower":
            self._ramp_rate_n_per_s /= 2
        aim_n = {"press_slowly": self.settings.ramp_aim_n, "press_lighter": TOUCH_N, "slower": before.aim_n}
        self._ramp(act_s, aim_n.get(guidance, before.steady_n(act_s)), None)

    def _hold(self, act_s: float, aim_n: float, position_mm: tuple[float, float] | None) -> None:
        self._is_ramp = False
        self._aim(act_s, aim_n, self.settings.rate_n_per_s, position_mm)

    def _ramp(self, act_s: float, aim_n: float, position_mm: tuple[float, float] | None) -> None:
        self._is_ramp = True
        self._aim(act_s, aim_n, self._ramp_rate_n_per_s, position_mm)

    def _aim(self, act_s: float, aim_n: float, rate_n_per_s: float, position_mm: tuple[float, float] | None) -> None:
        before = self._move_at(act_s)
        force_n = before.steady_n(act_s)
        place = position_mm or before.position_mm
        holds = aim_n > 0.0 and not self._is_ramp
        overshoot_n = self.settings.overshoot_ratio * abs(aim_n - force_n) if holds else 0.0
        fade_n_per_s = self.settings.fade_n_per_s if holds else 0.0
        with self._lock:
            since_s = before.press_began_s if force_n > 0.0 else None
            self._moves.append(Move(act_s, force_n, aim_n, rate_n_per_s, place, overshoot_n, fade_n_per_s, since_s))
            if self._lifts_left and aim_n > TOUCH_N:
                self._lift_early(self._moves[-1])

    def _lift_early(self, move: Move) -> None:
        """Append that this hand lifts by itself in the middle of a move; needs the lock."""
        self._lifts_left -= 1
        at_s = move.since_s + self.settings.lifts_after_s
        lifting = Move(at_s, move.steady_n(at_s), 0.0, self.settings.rate_n_per_s, move.position_mm)
        self._moves.append(replace(lifting, pressed_since_s=move.press_began_s))

    def _move_at(self, t_s: float) -> Move:
        """Return the motion under way at a time: until the reaction time is over, that is still the one before."""
        with self._lock:
            return next((move for move in reversed(self._moves) if move.since_s <= t_s), self._moves[0])

    def force_n(self, t_s: float) -> float:
        """Return the force on the probe: the steady part, and tremor in proportion to how hard it is held."""
        steady_n = self._move_at(t_s).steady_n(t_s)
        if steady_n <= 0.0:
            return 0.0
        held = min(steady_n / 0.1, 1.0)
        hz = self.settings.tremor_hz
        tremor = math.sin(2 * math.pi * hz * t_s) + 0.5 * math.sin(2 * math.pi * TREMOR_BEAT * hz * t_s + 1.0)
        drift = math.sin(2 * math.pi * 0.4 * t_s) + 0.4 * math.sin(2 * math.pi * 1.1 * t_s + 2.0)
        return max(0.0, steady_n + held * (self.settings.tremor_n * tremor + self.settings.drift_n * drift))

    def pressed_s(self, t_s: float) -> float:
        """Return how long the probe is pressed by now."""
        return t_s - self._move_at(t_s).press_began_s

    def place(self, t_s: float) -> ProbePlacement:
        """Return where the probe stands relative to the lesion and how it leans; it moves only while it is lifted."""
        return ProbePlacement(*self._move_at(t_s).position_mm, self.settings.tilt_x_deg, self.settings.tilt_y_deg)
