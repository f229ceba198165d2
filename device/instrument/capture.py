"""Takes the frames a measurement is made of: unloaded ones, and those of a press in the mode that was asked for.

Which frames of a press count is for `HoldFrames` or `RampFrames` to say; a hand that lifts early begins again.
The light of each side is looked at while the reference press is still held.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence

from device.config import Config
from device.instrument.bench import DARK, Bench
from device.instrument.frame_check import TearWatch
from device.instrument.frame_level import require_lit
from device.instrument.guidance import before_contact
from device.instrument.hold_frames import TOUCH_RATIO, HoldFrames
from device.instrument.light_check import (
    Levels,
    growth_ratio,
    level_counts,
    require_contrast,
    require_dark,
    require_every_side,
)
from device.instrument.ramp_frames import RampFrames, ramp_targets_n
from device.instrument.status import StatusBoard
from device.measurement.mode import FRAMES, Mode
from device.measurement.tactile_image import SIDES, Frame, LedRatio, Role

UNLOADED_FRAMES = 4
POLL_S = 0.02


class PressEnded(Exception):  # noqa: N818 - not every end is an error
    """The press ended without a measurement: rejected with a reason, or cancelled."""

    def __init__(self, state: str, reason: str) -> None:
        self.state, self.reason = state, reason
        super().__init__(reason)


class Capture:
    """The part of the procedure that moves the light and takes frames."""

    def __init__(self, bench: Bench, config: Config, board: StatusBoard) -> None:
        self.bench, self.press, self.light, self.board = bench, config.press, config.light, board
        self.lit = (self.light.ratio[0], self.light.ratio[1], self.light.ratio[2], self.light.ratio[3])
        self.cancelled, self.stopping = threading.Event(), threading.Event()
        self._tears = TearWatch(config.camera.tear_counts)
        self._dark_counts = 0.0

    def unloaded(self) -> list[Frame]:
        """Return dark and lit frames of the untouched probe; waits until it is untouched.

        Raises `StuckLightError` or `AmbientLightError` when the dark ones are not dark, `OpenLedError` or
        `HotLedDriverError` when the LED chip says that current does not flow.
        """
        self.bench.light(DARK)
        while not self.stopping.is_set() and self.bench.force.latest_n >= self.press.contact_n:
            time.sleep(POLL_S)
        self.bench.check_lights()
        dark = self._agreeing("dark", DARK)
        for frame in dark:
            require_dark(frame, self.light.max_dark_counts)
        self._dark_counts = level_counts(dark[-1])
        lit = self._agreeing("reference", self.lit)
        self.bench.light(DARK)
        return dark + lit

    def loaded(self, role: Role, mode: Mode) -> list[Frame]:
        """Return the frames of one press, as many as the mode needs.

        Raises `PressEnded` when it fails, is too hard or is cancelled, `NoContrastError` when the image does not
        depend on it, `DarkSideError` when it shows no light at all, `OpenLedError` or `HotLedDriverError` when the
        light fails before it, `LightBudgetError` when it was on for too long.
        """
        wanted, begin = self._wanted(role, mode), before_contact(role, mode)
        self.board.update(guidance=begin, frames_taken=0, wanted_n=wanted.wanted_n)
        self.bench.check_lights()
        self.bench.light(self.lit)
        last_contact_s = time.monotonic()
        while not wanted.is_complete:
            self._require_going_on()
            frame = self.bench.take(role)
            is_touching = frame.force_n >= self.press.contact_n
            if is_touching:
                last_contact_s = time.monotonic()
            self._require_bearable(frame, last_contact_s)
            if is_touching:
                guidance = wanted.see(frame)
            else:
                guidance = begin
                wanted.begin_again()
            self.board.update(guidance=guidance, frames_taken=len(wanted.frames), wanted_n=wanted.wanted_n)
        require_lit(wanted.frames, self._dark_counts)
        if seen := wanted.light_and_hard():
            require_contrast(*seen, self._dark_counts, self.light.min_contrast_ratio)
        return wanted.frames

    def _wanted(self, role: Role, mode: Mode) -> HoldFrames | RampFrames:
        count = FRAMES[mode].count
        if FRAMES[mode].is_ramp:
            return RampFrames(ramp_targets_n(count, role), self.press, self.bench, self._tears)
        return HoldFrames(count, self.press, self.bench, self._tears)

    def side_levels(self, reference: Sequence[Frame]) -> Levels:
        """Return the light of each side alone, under the load of the reference press that is being held.

        The levels are those at the target force; the frames of the press tell how its light grows with the force.
        Raises `DarkSideError` when a side gives none, `StuckLightError` or `AmbientLightError` when the dark is not
        dark, `PressEnded` when the hand lifts meanwhile.
        """
        dark = self._under_load(DARK)
        require_dark(dark, self.light.max_dark_counts)
        levels = []
        for side, ratio in enumerate(self.lit):
            plus_x, plus_y, minus_x, minus_y = (ratio if side == number else 0.0 for number in range(len(SIDES)))
            frame = self._under_load((plus_x, plus_y, minus_x, minus_y))
            light = level_counts(frame) - level_counts(dark)
            growth = growth_ratio(reference, self._dark_counts, frame.force_n, self.press.target_n)
            levels.append(light / ratio * growth)
        require_every_side(tuple(levels), self.light.min_side_ratio)
        return tuple(levels)

    def lifted(self) -> None:
        """Return once the probe touches nothing between the two presses; raises `PressEnded` as `loaded` does."""
        self.bench.light(DARK)
        deadline_s = time.monotonic() + self.press.timeout_s
        while self.bench.force.latest_n >= self.press.contact_n:
            self._require_going_on()
            if time.monotonic() > deadline_s:
                raise PressEnded("rejected", f"The probe was not lifted for {self.press.timeout_s:.0f} s: begin again.")
            time.sleep(POLL_S)

    def _agreeing(self, role: Role, ratio: LedRatio) -> list[Frame]:
        self.bench.light(ratio)
        frames: list[Frame] = []
        while len(frames) < UNLOADED_FRAMES:
            self._tears.append(frames, self.bench.take(role))
        return frames

    def _under_load(self, ratio: LedRatio) -> Frame:
        """Return the second of two frames that agree, taken under a light while the probe is held pressed."""
        self.bench.light(ratio)
        frames: list[Frame] = []
        while len(frames) < 2:
            self._require_going_on()
            self._tears.append(frames, self.bench.take("reference"))
        if frames[-1].force_n < TOUCH_RATIO * self.press.target_n:
            raise PressEnded("rejected", "The probe was lifted too early: hold it until the screen says so.")
        return frames[-1]

    def _require_going_on(self) -> None:
        self.bench.budget.require_left()
        if self.cancelled.is_set():
            raise PressEnded("cancelled", "Cancelled by the operator.")
        if self.stopping.is_set():
            raise PressEnded("failed", "The daemon was stopped during the press.")

    def _require_bearable(self, frame: Frame, last_contact_s: float) -> None:
        limit_n, timeout_s = self.press.overload_n, self.press.timeout_s
        if frame.force_n > limit_n:
            reason = f"The force rose to {frame.force_n:.2f} N, above {limit_n:.2f} N: lift and press more gently."
            raise PressEnded("rejected", reason)
        if time.monotonic() - last_contact_s > timeout_s:
            raise PressEnded("rejected", f"No press came for {timeout_s:.0f} s: begin again.")
