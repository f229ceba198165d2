"""Takes the frames a measurement is made of: unloaded ones, and ten in the force band while the hand holds still.

A frame counts when its own force lies in the band and the force hardly varied just before it; a hand that lifts early
begins again. Source: Lee & Won 2013, section IV: ten frames averaged per lesion.
"""

from __future__ import annotations

import threading
import time

from device.config import Config
from device.instrument.bench import DARK, Bench
from device.instrument.frame_check import TearWatch
from device.instrument.guidance import Guidance, advise
from device.instrument.light_check import Levels, level_counts, require_contrast, require_dark, require_every_side
from device.instrument.status import StatusBoard
from device.measurement.tactile_image import SIDES, Frame, LedRatio, Role

UNLOADED_FRAMES = 4
POLL_S = 0.02
TOUCH_RATIO = 0.7
"""A frame on the way to the hold, at less than this part of its force, shows what the force does to the image."""


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

        Raises `StuckLightError` or `AmbientLightError` when the dark ones are not dark.
        """
        self.bench.light(DARK)
        while not self.stopping.is_set() and self.bench.force.latest_n >= self.press.contact_n:
            time.sleep(POLL_S)
        dark = self._agreeing("dark", DARK)
        require_dark(dark[-1], self.light.max_dark_counts)
        self._dark_counts = level_counts(dark[-1])
        lit = self._agreeing("reference", self.lit)
        self.bench.light(DARK)
        return dark + lit

    def loaded(self, role: Role, before_contact: Guidance) -> list[Frame]:
        """Return the frames of one press.

        Raises `PressEnded` when it fails, is too hard or is cancelled, `NoContrastError` when the image does not
        depend on it.
        """
        self.bench.light(self.lit)
        taken: list[Frame] = []
        touch: Frame | None = None
        last_contact_s = time.monotonic()
        while len(taken) < self.press.frames:
            self._require_going_on()
            frame = self.bench.take(role)
            if frame.force_n >= self.press.contact_n:
                last_contact_s = time.monotonic()
                touch = touch or frame
            else:
                taken.clear()
                touch = None
            self._require_bearable(frame, last_contact_s)
            guidance = advise(frame.force_n, self.press.band_n, self.press.contact_n, before_contact=before_contact)
            if guidance is Guidance.HOLD_STILL and self.bench.is_steady(frame.t_s, self.press.steady_n):
                self._append(taken, frame)
            self.board.update(guidance=guidance, frames_taken=len(taken))
        if touch and touch.force_n < TOUCH_RATIO * self.press.target_n:
            require_contrast(touch, taken, self._dark_counts, self.light.min_contrast_ratio)
        return taken

    def side_levels(self) -> Levels:
        """Return the light of each side alone, under the load of the press that is being held, at the target force.

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
            # Light grows with force, nearly in proportion: this takes out that a hand is never quite still.
            levels.append(light / ratio * self.press.target_n / frame.force_n)
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
            self._append(frames, self.bench.take(role))
        return frames

    def _append(self, frames: list[Frame], frame: Frame) -> None:
        """Add a frame, unless it or the one before is torn: then neither stays."""
        if frames and not self._tears.agree(frames[-1], frame):
            frames.pop()
        else:
            frames.append(frame)

    def _under_load(self, ratio: LedRatio) -> Frame:
        """Return the second of two frames that agree, taken under a light while the probe is held pressed."""
        self.bench.light(ratio)
        frames: list[Frame] = []
        while len(frames) < 2:
            self._require_going_on()
            self._append(frames, self.bench.take("reference"))
        if frames[-1].force_n < TOUCH_RATIO * self.press.target_n:
            raise PressEnded("rejected", "The probe was lifted too early: hold it until the screen says so.")
        return frames[-1]

    def _require_going_on(self) -> None:
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
