"""The states of a press and which of them follow which: the whole procedure as one table.

One measurement runs through them twice, beside the lesion and on it. docs/press.md shows the table; a test compares.
"""

from __future__ import annotations

from enum import Enum


class PressState(Enum):
    """Where a press is: a code for machines and one sentence for the documents."""

    IDLE = "idle", "no press is under way"
    APPROACH = "approach", "the light is on, and the probe touches nothing yet, or no longer"
    TOO_LIGHT = "too_light", "the probe touches with less force than any frame is wanted at"
    TOO_HARD = "too_hard", "with more force than any frame is wanted at, but less than an overload"
    UNSTEADY = "unsteady", "the force is right but varies, or changes too fast, for a frame to count"
    HOLDING = "holding", "the force is right and settles, or every frame is there and each side's light is looked at"
    CAPTURING = "capturing", "the force is right and steady: this frame counts"
    RELEASING = "releasing", "the frames are there: the hand lifts, and after the second press the answer is computed"
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
        super().__init__(f"A press that is {state.code} cannot {step}; see device/instrument/press_state.py.")
