"""What the operator should do now: one code for machines, one sentence for the screen."""

from __future__ import annotations

from enum import Enum


class Guidance(Enum):
    """The whole vocabulary of the screen's instruction."""

    WAIT = "wait", "Please wait"
    PRESS_BESIDE = "press_beside", "Press beside the lesion"
    PRESS_LESION = "press_lesion", "Press on the lesion"
    PRESS_HARDER = "press_harder", "Press harder"
    PRESS_LIGHTER = "press_lighter", "Press lighter"
    HOLD_STILL = "hold_still", "Hold still"
    LIFT = "lift", "Lift the probe"
    DONE = "done", "Done"
    REJECTED = "rejected", "Press rejected"
    FAULT = "fault", "The probe has a fault"

    def __init__(self, code: str, text: str) -> None:
        self.code, self.text = code, text


def advise(force_n: float, band_n: tuple[float, float], contact_n: float, *, before_contact: Guidance) -> Guidance:
    """Return what to do at a force: begin, press harder, press lighter, or hold still inside the band."""
    if force_n < contact_n:
        return before_contact
    if force_n < band_n[0]:
        return Guidance.PRESS_HARDER
    if force_n > band_n[1]:
        return Guidance.PRESS_LIGHTER
    return Guidance.HOLD_STILL
