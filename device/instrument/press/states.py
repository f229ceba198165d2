"""The states of a press as one table: which follow which, what the operator is told in each, and why one is rejected.

One measurement runs through them twice, beside the lesion and on it; a scan once more for each further place. Guidance
is one code for machines and one sentence for the screen; a reason says what was seen, its bound, and what to do.
docs/press.md shows the table; a test compares.
"""

from __future__ import annotations

from enum import Enum
from math import hypot

from device.measurement.mode import FRAMES, Mode
from device.measurement.recording.tactile_image import Role

CANCELLED = "Cancelled by the operator."


class PressState(Enum):
    """Where a press is: a code for machines and one sentence for the documents."""

    IDLE = "idle", "no press is under way"
    APPROACH = "approach", "the light is on, and the probe touches nothing yet, or no longer"
    TOO_LIGHT = "too_light", "the probe touches with less force than any frame is wanted at"
    TOO_HARD = "too_hard", "with more force than any frame is wanted at, but less than an overload"
    UNSTEADY = "unsteady", "the force is right but varies, or changes too fast, for a frame to count"
    HOLDING = "holding", "the force is right and settles, or every frame is there and each side's light is looked at"
    CAPTURING = "capturing", "the force is right and steady: this frame counts"
    RELEASING = (
        "releasing",
        "the frames are there: the hand lifts, and after a press on the lesion an answer is computed",
    )
    DONE = "done", "the measurement is kept"
    REJECTED = "rejected", "the press ended without a measurement, and says why"

    def __init__(self, code: str, meaning: str) -> None:
        self.code, self.meaning = code, meaning


TOUCHING = (
    PressState.TOO_LIGHT,
    PressState.TOO_HARD,
    PressState.UNSTEADY,
    PressState.HOLDING,
    PressState.CAPTURING,
)
"""States in which the probe is pressed; the force leads from each of them to each other."""
SEEING = (PressState.APPROACH, *TOUCHING)
"""States in which frames are taken."""
ACTIVE = (*SEEING, PressState.RELEASING)
"""States in which a press is under way: each can be cancelled or rejected."""


def _transitions() -> dict[PressState, frozenset[PressState]]:
    table = {state: frozenset((*SEEING, PressState.REJECTED)) for state in SEEING}
    table[PressState.IDLE] = frozenset((PressState.APPROACH,))
    table[PressState.HOLDING] |= {PressState.RELEASING}
    table[PressState.RELEASING] = frozenset(
        (PressState.RELEASING, PressState.APPROACH, PressState.DONE, PressState.REJECTED)
    )
    table[PressState.DONE] = table[PressState.REJECTED] = frozenset()
    return table


TRANSITIONS = _transitions()
"""The states that may follow each state; a state that frames are seen in may also stay."""


class IllegalTransition(RuntimeError):  # noqa: N818 - reads as what it says
    """The driver asked for a step that the table does not have: a mistake in the program, never in a press."""

    def __init__(self, state: PressState, step: str) -> None:
        super().__init__(f"A press that is {state.code} cannot {step}; see device/instrument/press/states.py.")


class Guidance(Enum):
    """The whole vocabulary of the screen's instruction."""

    WAIT = "wait", "Please wait"
    PRESS_BESIDE = "press_beside", "Press beside the lesion"
    PRESS_LESION = "press_lesion", "Press on the lesion"
    TOUCH_BESIDE = "touch_beside", "Touch beside the lesion"
    TOUCH_LESION = "touch_lesion", "Touch the lesion"
    MOVE_ASIDE = "move_aside", "Move the probe a little to the side, touch again"
    PRESS_HARDER = "press_harder", "Press harder"
    PRESS_SLOWLY = "press_slowly", "Press slowly harder"
    PRESS_LIGHTER = "press_lighter", "Press lighter"
    SLOWER = "slower", "Slower"
    HOLD_STILL = "hold_still", "Hold still"
    LIFT = "lift", "Lift the probe"
    KEEP_FREE = "keep_free", "Keep the probe free"
    HOLD_BLOCK = "hold_block", "Hold the probe on the reference block"
    PUT_WEIGHT = "put_weight", "Put the weight on the probe"
    TAKE_WEIGHT_OFF = "take_weight_off", "Take the weight off"
    DONE = "done", "Done"
    REJECTED = "rejected", "Press rejected"
    FAULT = "fault", "The probe has a fault"

    def __init__(self, code: str, text: str) -> None:
        self.code, self.text = code, text


def spoken(guidance: Guidance, aside_mm: float | None) -> str:
    """Return what the operator reads; of a move aside with how far (mm) it goes, where that is known."""
    if guidance is Guidance.MOVE_ASIDE and aside_mm is not None:
        return f"Move the probe about {aside_mm:.0f} mm to the side, touch again"
    return guidance.text


def never_lifted(waited_s: float) -> str:
    """Return why a press that was asked for has ended before it began."""
    return f"The probe was not lifted for {waited_s:.0f} s: lift it, or tare it if nothing touches it."


def before_contact(role: Role, mode: Mode, ramp: int = 0) -> Guidance:
    """Return how a press begins; a ramp begins with a touch, so that its small forces are not missed.

    From its second `ramp` on the lesion on, a scan wants another place first.
    """
    is_ramp = FRAMES[mode].is_ramp
    if ramp:
        return Guidance.MOVE_ASIDE
    if role == "reference":
        return Guidance.TOUCH_BESIDE if is_ramp else Guidance.PRESS_BESIDE
    return Guidance.TOUCH_LESION if is_ramp else Guidance.PRESS_LESION


HELD_GUIDANCE = {
    PressState.TOO_LIGHT: Guidance.PRESS_HARDER,
    PressState.TOO_HARD: Guidance.PRESS_LIGHTER,
    PressState.UNSTEADY: Guidance.HOLD_STILL,
    PressState.HOLDING: Guidance.HOLD_STILL,
    PressState.CAPTURING: Guidance.HOLD_STILL,
}
"""What to do in each state of a hold; a ramp's guidance depends on the forces that are still wanted, too."""


def too_hard(force_n: float, overload_n: float) -> str:
    """Return why a force is too much."""
    return f"The force rose to {force_n:.2f} N, above {overload_n:.2f} N: lift and press more gently."


def off_centre(spot_mm: tuple[float, float], max_offset_mm: float) -> str:
    """Return how far off the middle a lesion is, and where the probe has to go: +x is right, +y down in the image."""
    x_mm, y_mm = spot_mm
    towards = [
        f"{'+' if part > 0 else '-'}{axis}"
        for axis, part in (("x", x_mm), ("y", y_mm))
        if abs(part) >= max(abs(x_mm), abs(y_mm)) / 2
    ]
    return (
        f"The lesion lies {hypot(x_mm, y_mm):.1f} mm off the middle, above {max_offset_mm:g} mm: "
        f"move the probe towards {' and '.join(towards)}."
    )
