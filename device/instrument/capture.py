"""Takes the frames a measurement is made of: unloaded ones, and ten in the force band while the hand holds still.

A frame counts when its own force lies in the band and the force hardly varied just before it; a hand that lifts early
begins again. Source: Lee & Won 2013, section IV: ten frames averaged per lesion.
"""

from __future__ import annotations

import threading
import time

from device.config import LightSection, PressSection
from device.instrument.bench import DARK, Bench
from device.instrument.guidance import Guidance, advise
from device.instrument.status import StatusBoard
from device.measurement.tactile_image import Frame, LedRatio, Role

UNLOADED_FRAMES = 4
POLL_S = 0.02


class PressEnded(Exception):  # noqa: N818 - not every end is an error
    """The press ended without a measurement: rejected with a reason, or cancelled."""

    def __init__(self, state: str, reason: str) -> None:
        self.state, self.reason = state, reason
        super().__init__(reason)


class Capture:
    """The part of the procedure that moves the light and takes frames."""

    def __init__(self, bench: Bench, press: PressSection, light: LightSection, board: StatusBoard) -> None:
        self.bench, self.press, self.board = bench, press, board
        self.lit = (light.ratio[0], light.ratio[1], light.ratio[2], light.ratio[3])
        self.cancelled, self.stopping = threading.Event(), threading.Event()

    def unloaded(self) -> list[Frame]:
        """Return dark and lit frames of the untouched probe; waits until it is untouched."""
        self.bench.light(DARK)
        while not self.stopping.is_set() and self.bench.force.latest_n >= self.press.contact_n:
            time.sleep(POLL_S)
        frames: list[Frame] = []
        lights: tuple[tuple[Role, LedRatio], ...] = (("dark", DARK), ("reference", self.lit))
        for role, ratio in lights:
            self.bench.light(ratio)
            frames += [self.bench.take(role) for _ in range(UNLOADED_FRAMES)]
        self.bench.light(DARK)
        return frames

    def loaded(self, role: Role, before_contact: Guidance) -> list[Frame]:
        """Return the frames of one press; raises `PressEnded` when it fails, is too hard or is cancelled."""
        self.bench.light(self.lit)
        taken: list[Frame] = []
        last_contact_s = time.monotonic()
        while len(taken) < self.press.frames:
            self._require_going_on()
            frame = self.bench.take(role)
            if frame.force_n >= self.press.contact_n:
                last_contact_s = time.monotonic()
            else:
                taken.clear()
            self._require_bearable(frame, last_contact_s)
            guidance = advise(frame.force_n, self.press.band_n, self.press.contact_n, before_contact=before_contact)
            if guidance is Guidance.HOLD_STILL and self.bench.is_steady(frame.t_s, self.press.steady_n):
                taken.append(frame)
            self.board.update(guidance=guidance, frames_taken=len(taken))
        return taken

    def lifted(self) -> None:
        """Return once the probe touches nothing between the two presses; raises `PressEnded` as `loaded` does."""
        self.bench.light(DARK)
        deadline_s = time.monotonic() + self.press.timeout_s
        while self.bench.force.latest_n >= self.press.contact_n:
            self._require_going_on()
            if time.monotonic() > deadline_s:
                raise PressEnded("rejected", f"The probe was not lifted for {self.press.timeout_s:.0f} s: begin again.")
            time.sleep(POLL_S)

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
