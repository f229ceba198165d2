"""A press as a pure state machine: a state and what one frame shows, to the next state and the reason of its end.

No clock, thread or hardware: time comes with the observation (s, monotonic), so a thousand presses run in seconds.
Which frames are kept is for `HoldFrames` or `RampFrames`; every number of the rules is a setting or a constant here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot
from typing import Any, Literal

from device.config import PressSection
from device.instrument.press.states import (
    ACTIVE,
    SEEING,
    TOUCHING,
    TRANSITIONS,
    IllegalTransition,
    PressState,
    off_centre,
    too_hard,
)
from device.measurement.estimate import SATURATED_RATIO
from device.measurement.recording.tactile_image import Role

Ending = Literal["rejected", "cancelled", "failed"]

STEADY_WINDOW_S = 0.15
"""Over so long a time before a frame its force must have been steady: more than one period of tremor (8-12 Hz)."""
SETTLE_S = 0.5
"""A force that varies for longer than this is unsteady, not settling."""
PRESSED_RATIO = 2.0
"""A contact that never had this multiple of the contact force was a touch: lifting again is no second press."""
CHECKED_RATIO = 0.7
"""While each side's light is looked at, at least this part of the target force is held."""
MAX_LIFTS = 3
"""So often a press may be begun again because the hand lifted."""
MAX_SATURATED, MAX_REPLACED = 5, 5
"""So many frames of a press may be saturated, or unlike the others, and be taken again."""


@dataclass(frozen=True)
class FrameSeen:
    """What a frame shows of the hand and of itself.

    `t_s` and `force_n` are those of the middle of its exposure; `peak_n` is the largest force since the frame before,
    `range_n` by how much the force varied in `STEADY_WINDOW_S` before it, of a ramp around a straight line, and
    `rate_n_per_s` how fast it grew in that.
    """

    t_s: float
    force_n: float
    peak_n: float
    range_n: float
    rate_n_per_s: float
    saturated_ratio: float = 0.0


@dataclass(frozen=True)
class PressRules:
    """The bounds of one press; `low_n` and `high_n` are the ends of the forces at which its frames are wanted."""

    low_n: float
    high_n: float
    contact_n: float
    overload_n: float
    steady_n: float
    max_rate_n_per_s: float
    is_ramp: bool
    timeout_s: float
    max_offset_mm: float

    @classmethod
    def of(cls, press: PressSection, window_n: tuple[float, float], *, is_ramp: bool) -> PressRules:
        """Return the rules of a hold within a window of forces, or of a ramp over it.

        Where a ramp starts with the largest rate, a straight line through the kink leaves a
        quarter of that rate times the window: so much more may be left of it.
        """
        kink_n = press.max_rate_n_per_s * STEADY_WINDOW_S / 4 if is_ramp else 0.0
        return cls(
            low_n=window_n[0],
            high_n=window_n[1],
            contact_n=press.contact_n,
            overload_n=press.overload_n,
            steady_n=press.steady_n + kink_n,
            max_rate_n_per_s=press.max_rate_n_per_s,
            is_ramp=is_ramp,
            timeout_s=press.timeout_s,
            max_offset_mm=press.max_offset_mm,
        )

    def is_steady(self, seen: FrameSeen) -> bool:
        """Return whether the force is known at the exposure: neither trembling nor changing too fast."""
        return seen.range_n <= self.steady_n and not self.is_fast(seen)

    def is_fast(self, seen: FrameSeen) -> bool:
        """Return whether the force changes faster than it may."""
        return abs(seen.rate_n_per_s) > self.max_rate_n_per_s


@dataclass(frozen=True)
class PressUnderWay:
    """One moment of a press. Every method returns the next one, or raises `IllegalTransition` for a step out of turn.

    `contact_s` is when the probe last touched, or was first asked to; `touched_s` when it first did, `calm_s` when the
    force became right or was last steady, `peak_n` the largest force of this contact. `ending` and `reason` are those
    of REJECTED.
    """

    state: PressState = PressState.IDLE
    role: Role = "reference"
    contact_s: float = 0.0
    touched_s: float | None = None
    calm_s: float | None = None
    peak_n: float = 0.0
    lifts: int = 0
    saturated: int = 0
    replaced: int = 0
    ending: Ending | None = None
    reason: str = ""

    @property
    def is_touching(self) -> bool:
        """Whether the probe is pressed and frames are being taken."""
        return self.state in TOUCHING

    def begin(self, role: Role, t_s: float) -> PressUnderWay:
        """Return the press as it begins, beside the lesion or, once the probe is lifted, on it."""
        self._require((PressState.IDLE, PressState.RELEASING), "begin")
        return replace(PressUnderWay(self.state), role=role, contact_s=t_s)._to(PressState.APPROACH)

    def see(self, seen: FrameSeen, rules: PressRules) -> PressUnderWay:
        """Return the press after a frame of the capture."""
        self._require(SEEING, "take a frame")
        if seen.peak_n > rules.overload_n:
            return self.reject(too_hard(seen.peak_n, rules.overload_n))
        if self.touched_s is not None and seen.t_s - self.touched_s > rules.timeout_s:
            return self.reject(self._why_so_long(seen, rules))
        if seen.force_n < rules.contact_n:
            return self._untouched(seen, rules)
        touched_s = seen.t_s if self.touched_s is None else self.touched_s
        peak_n = max(self.peak_n, seen.peak_n)
        return replace(self, contact_s=seen.t_s, touched_s=touched_s, peak_n=peak_n)._pressed(seen, rules)

    def _untouched(self, seen: FrameSeen, rules: PressRules) -> PressUnderWay:
        if seen.t_s - self.contact_s > rules.timeout_s:
            return self.reject(f"No press came for {rules.timeout_s:.0f} s: begin again.")
        lifts = self.lifts + (self.peak_n >= PRESSED_RATIO * rules.contact_n)
        if lifts > MAX_LIFTS:
            return self.reject(
                f"The probe was lifted {lifts} times before its frames were taken: hold it until the screen says so."
            )
        return self._to(PressState.APPROACH, lifts=lifts, peak_n=0.0, calm_s=None)

    def _pressed(self, seen: FrameSeen, rules: PressRules) -> PressUnderWay:
        if not rules.low_n <= seen.force_n <= rules.high_n:
            is_light = seen.force_n < rules.low_n
            return self._to(PressState.TOO_LIGHT if is_light else PressState.TOO_HARD, calm_s=None)
        if not rules.is_steady(seen):
            calm_s = seen.t_s if self.calm_s is None else self.calm_s
            settles = seen.t_s - calm_s < SETTLE_S and not (rules.is_ramp and rules.is_fast(seen))
            return self._to(PressState.HOLDING if settles else PressState.UNSTEADY, calm_s=calm_s)
        if seen.saturated_ratio > SATURATED_RATIO:
            return replace(self, calm_s=seen.t_s)._saturated(seen.saturated_ratio)
        return self._to(PressState.CAPTURING, calm_s=seen.t_s)

    def _saturated(self, ratio: float) -> PressUnderWay:
        if self.saturated < MAX_SATURATED:
            return self._to(PressState.HOLDING, saturated=self.saturated + 1)
        return self.reject(
            f"The image is too bright: {ratio:.1%} of its pixels are saturated, above {SATURATED_RATIO:.1%}: shade the "
            "probe and press again; if the message stays, lower light.ratio or camera.exposure_us."
        )

    def replace_frame(self, deviation_ratio: float) -> PressUnderWay:
        """Return the press after a frame of it was dropped that was unlike the others by that part of the light."""
        self._require(TOUCHING, "replace a frame")
        if self.replaced < MAX_REPLACED:
            return self._to(PressState.HOLDING, replaced=self.replaced + 1)
        return self.reject(
            f"More than {MAX_REPLACED} frames were unlike the others, the last by {deviation_ratio:.0%}: "
            "shade the probe, hold it still and straight."
        )

    def hold(self, spot_mm: tuple[float, float] | None, rules: PressRules) -> PressUnderWay:
        """Return the press once every frame is there.

        `spot_mm` is where the inclusion lies from the middle of the face; None beside it, or when nothing stands out.
        """
        self._require(TOUCHING, "have its frames")
        if spot_mm is not None and hypot(*spot_mm) > rules.max_offset_mm:
            return self.reject(off_centre(spot_mm, rules.max_offset_mm))
        return self._to(PressState.HOLDING)

    def check(self, seen: FrameSeen, press: PressSection) -> PressUnderWay:
        """Return the press after a frame by which each side's light is looked at while the hand holds."""
        self._require((PressState.HOLDING,), "look at its light")
        if seen.peak_n > press.overload_n:
            return self.reject(too_hard(seen.peak_n, press.overload_n))
        if seen.force_n < CHECKED_RATIO * press.target_n:
            return self.reject("The probe was lifted too early: hold it until the screen says so.")
        return self

    def release(self, t_s: float) -> PressUnderWay:
        """Return the press when the hand may lift."""
        return self._to(PressState.RELEASING, contact_s=t_s)

    def wait(self, t_s: float, force_n: float, press: PressSection) -> PressUnderWay:
        """Return the press while the hand is to lift; it has lifted when the force is below `contact_n`."""
        self._require((PressState.RELEASING,), "wait")
        if force_n >= press.contact_n and t_s - self.contact_s > press.timeout_s:
            return self.reject(f"The probe was not lifted for {press.timeout_s:.0f} s: begin again.")
        return self

    def done(self) -> PressUnderWay:
        """Return the press whose measurement is kept."""
        return self._to(PressState.DONE)

    def reject(self, reason: str, ending: Ending = "rejected") -> PressUnderWay:
        """Return the press ended without a measurement, from any state in which one is under way."""
        self._require(ACTIVE, "be ended")
        return self._to(PressState.REJECTED, ending=ending, reason=reason)

    def _why_so_long(self, seen: FrameSeen, rules: PressRules) -> str:
        """Return why a press that touched long ago has not all of its frames, by what it is doing now."""
        within = f"for {rules.timeout_s:.0f} s"
        if seen.force_n >= rules.contact_n and not rules.is_steady(seen):
            return f"The force was not steady to {rules.steady_n:.2f} N {within}: rest the arm and hold still."
        if self.state is PressState.TOO_LIGHT:
            return f"The force stayed below {rules.low_n:.2f} N {within}: press harder."
        if self.state is PressState.TOO_HARD:
            return f"The force stayed above {rules.high_n:.2f} N {within}: press lighter."
        return (
            f"Not all frames could be taken {within}: press slowly up to {rules.high_n:.2f} N; "
            f"the force came to {self.peak_n:.2f} N."
        )

    def _require(self, states: tuple[PressState, ...], step: str) -> None:
        if self.state not in states:
            raise IllegalTransition(self.state, step)

    def _to(self, state: PressState, **changes: Any) -> PressUnderWay:
        if state not in TRANSITIONS[self.state]:
            raise IllegalTransition(self.state, f"become {state.code}")
        return replace(self, state=state, **changes)
