"""What the operator should do now: one code for machines, one sentence for the screen."""

from __future__ import annotations

from enum import Enum

from device.instrument.press_state import PressState
from device.measurement.mode import FRAMES, Mode
from device.measurement.tactile_image import Role


class Guidance(Enum):
    """The whole vocabulary of the screen's instruction."""

    WAIT = "wait", "Please wait"
    PRESS_BESIDE = "press_beside", "Press beside the lesion"
    PRESS_LESION = "press_lesion", "Press on the lesion"
    TOUCH_BESIDE = "touch_beside", "Touch beside the lesion"
    TOUCH_LESION = "touch_lesion", "Touch the lesion"
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


def before_contact(role: Role, mode: Mode) -> Guidance:
    """Return how a press begins; a ramp begins with a touch, so that its small forces are not missed."""
    is_ramp = FRAMES[mode].is_ramp
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
