"""Takes the frames a measurement is made of: unloaded ones, and those of a press in the mode that was asked for.

It drives the press machine: each frame becomes an observation, and what the machine makes of it goes to the board. A
press that the machine rejects ends with `PressEnded`. The light of each side is looked at while the reference press is
still held.
When all frames are there, the bright spot's centroid tells where the inclusion lies under the face. A scan presses on
the lesion again and again; the frames of its presses are numbered.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

from device.config import Config
from device.instrument.acquisition.bench import DARK, Bench
from device.instrument.acquisition.frame_check import TearWatch
from device.instrument.acquisition.frame_level import require_lit
from device.instrument.acquisition.light_check import (
    Levels,
    growth_ratio,
    level_counts,
    require_contrast,
    require_dark,
    require_every_side,
)
from device.instrument.press.encoded_frames import EncodedFrames
from device.instrument.press.frame_choice import WantedFrames, wanted_frames
from device.instrument.press.inclusion_spot import inclusion_spot_mm
from device.instrument.press.machine import PRESSED_RATIO, Ending, FrameSeen, PressRules, PressUnderWay
from device.instrument.press.states import ACTIVE, CANCELLED, Guidance, PressState, before_contact
from device.instrument.status import StatusBoard
from device.instrument.watch.progress import ProgressBoard
from device.instrument.watch.zero_watch import STEADY_N
from device.measurement.mode import Mode
from device.measurement.recording.camera_geometry import CameraGeometry
from device.measurement.recording.led_sides import SIDES, LedRatio
from device.measurement.recording.tactile_image import Frame, Role, saturated_ratio

UNLOADED_FRAMES = 4
POLL_S = 0.02
TELL_AFTER_S = 2.0
"""A hand that rests on the probe for so long after a press is told to lift: by then it has read how that went."""
LIFTED_WITHIN_S = 1.0
"""A hand that lifts takes so long at most from a contact's force to none."""
WOKEN_S = 1.0
"""A face that has waited in the dark is lit for so long by what is less than a contact."""
AIR_FRAMES, BEFORE_TOUCH_S, CLEAR_RATIO = 5, 0.5, 0.004
"""So many frames in the air tell what the cell reads there, until so long before the touch. A face is in the air whose
light differs from an untouched one's by less than this part of the reference press's: where light grows as the force,
which is slowest, that is a touch of 2.5 mN."""


class PressEnded(Exception):  # noqa: N818 - not every end is an error
    """The press ended without a measurement: rejected with a reason, or cancelled."""

    def __init__(self, state: Ending, reason: str) -> None:
        self.state, self.reason = state, reason
        super().__init__(reason)


class RampGivenUp(Exception):  # noqa: N818 - not an error: what is there is enough
    """No further press on the lesion is wanted: that which was to come, or is not complete, is left out."""


class CalledAway(Exception):  # noqa: N818 - not an error: something else is to be done first
    """The wait for an untouched probe was given up."""


class Capture:
    """The part of the procedure that moves the light and takes frames."""

    def __init__(
        self,
        bench: Bench,
        config: Config,
        board: StatusBoard,
        progress: ProgressBoard | None = None,
        encoded: EncodedFrames | None = None,
    ) -> None:
        """Take `encoded`, which is told of every frame that is kept, if they are to be PNGs at the end."""
        self._progress, self._encoded = progress or ProgressBoard(), encoded
        self.bench, self.config, self.press, self.light, self.board = bench, config, config.press, config.light, board
        self.lit = self.light.ratio
        self.cancelled, self.stopping, self.called_away = threading.Event(), threading.Event(), threading.Event()
        self.finished = threading.Event()
        self.machine = PressUnderWay()
        self.is_in_oil = False  # a plate in oil is pressed: all of its light is there at the first touch
        self._tears = TearWatch(config.camera.tear_counts)
        self._dark: list[Frame] = []
        self._untouched: list[Frame] = []
        self._reference: list[Frame] = []
        self._pressed: list[Frame] = []
        self._in_air: deque[Frame] = deque(maxlen=AIR_FRAMES)
        self._turned_n = self._clear_counts = self._clear_within_counts = 0.0
        self._is_enough: Callable[[bool], bool] = _never
        self._dark_counts = self._before_s = self._untouched_s = 0.0

    def unloaded(self, while_touched: Callable[[], None] = lambda: None) -> list[Frame]:
        """Return dark and lit frames of the untouched probe; waits until it is, and takes them again if it was not.

        `while_touched` is called again and again as long as the wait goes on.

        Raises `CalledAway` when something else is to be done meanwhile, `StuckLightError` or `AmbientLightError` when
        the dark ones are not dark, `OpenLedError` or `HotLedDriverError` when the LED chip says that current does not
        flow.
        """
        guidance = self.board.now.guidance
        try:
            while True:
                self._wait_until_untouched(while_touched)
                self._wait_until_settled()
                began_s = time.monotonic()
                frames = self._untouched_frames()
                # A flat field under load would be wrong in every pixel, and nothing else would tell.
                if self.stopping.is_set() or self.bench.peak_n(began_s, frames[-1].t_s) < self.press.contact_n:
                    return frames
                self.board.update(guidance=Guidance.LIFT)
        finally:
            # Not before the frames are there: whoever is told to press as soon as he lifts never gets beyond them.
            is_over = guidance is Guidance.FAULT and self.board.now.fault is None
            self.board.update(guidance=Guidance.WAIT if is_over else guidance)

    def count_from(self, unloaded: list[Frame]) -> None:
        """Take the untouched frames with their forces from a zero that was moved since."""
        self._untouched = unloaded

    def _wait_until_untouched(self, while_touched: Callable[[], None]) -> None:
        began_s = time.monotonic()
        self.bench.light(DARK)
        while not self.stopping.is_set() and self.bench.force.latest_n >= self.press.contact_n:
            self._progress.beat()
            if self.called_away.is_set():
                raise CalledAway
            while_touched()
            if self.board.now.guidance is Guidance.WAIT or time.monotonic() - began_s >= TELL_AFTER_S:
                self._ask_to_lift()
            time.sleep(POLL_S)

    def _wait_until_settled(self) -> None:
        """Return once the force is that of a probe that nothing touches, and not of one that is being lifted.

        What still rests on it by then is for the zero's watch.
        """
        until_s = time.monotonic() + LIFTED_WITHIN_S
        while not self.stopping.is_set() and (now_s := time.monotonic()) < until_s:
            if self.bench.range_n(now_s, around_line=False) <= STEADY_N:
                return
            time.sleep(POLL_S)

    def _ask_to_lift(self) -> None:
        """Tell to lift where that is awaited; how a press went stays until another one is asked for."""
        now = self.board.now
        is_awaited = now.press is not None and now.press.state == "waiting"
        if now.guidance not in (Guidance.DONE, Guidance.REJECTED) or is_awaited:
            self.board.update(guidance=Guidance.LIFT)

    def _untouched_frames(self) -> list[Frame]:
        self.bench.check_lights()
        dark = self._agreeing("dark", DARK)
        for frame in dark:
            require_dark(frame, self.light.max_dark_counts)
        self._dark, self._dark_counts = dark, level_counts(dark[-1])
        lit = self._agreeing("reference", self.lit)
        self.bench.light(DARK)
        self._clear_counts, self._clear_within_counts = level_counts(lit[-1]), 0.0
        self._untouched = dark + lit
        return self._untouched

    def relit(self, unloaded: list[Frame], ratio: LedRatio) -> list[Frame]:
        """Return the same with frames lit at another brightness, taken now; as they are if it is theirs. Ends dark."""
        if ratio == self.lit:
            return unloaded
        lit = self._agreeing("reference", ratio)
        self.bench.light(DARK)
        return [frame for frame in unloaded if frame.role == "dark"] + lit

    def loaded(self, role: Role, mode: Mode, ramp: int = 0) -> list[Frame]:
        """Return the frames of one press, as many as the mode needs; `ramp` is its number among those on the lesion.

        Where the first of them stood, the inclusion is under the face; the others stand beside that on purpose.

        Raises `PressEnded` when it fails, is too hard or is cancelled, `NoContrastError` when the image does not
        depend on it, `DarkSideError` when it shows no light at all, `OpenLedError` or `HotLedDriverError` when the
        light fails before it, `LightBudgetError` when it was on for too long. A face that nobody presses is not kept
        lit: the press waits for the touch in the dark.
        """
        wanted = wanted_frames(mode, role, self.press, self._tears)
        rules = PressRules.of(self.press, wanted.window_n, is_ramp=wanted.is_ramp)
        begin = before_contact(role, mode, ramp)
        if role == "reference":
            self._reference, self._pressed = [], []
        self._before_s = time.monotonic()
        self._in_air.clear()
        self._turned_n = 0.0
        self._become(self.machine.begin(role, self._before_s))
        self.board.update(guidance=begin, frames_taken=0, wanted_n=wanted.wanted_n)
        self.bench.check_lights()
        lit_s = self.bench.budget.on_s
        while not wanted.is_complete:
            self._require_wanted()
            if self._untouched_s >= self.light.untouched_s:
                self._wait_in_the_dark(rules, begin)
            self.bench.light(self.lit)
            frame = self._by_zero_of_reference(self._numbered(self.bench.take(role), ramp))
            self._become(self.machine.see(self._observation(frame, is_ramp=wanted.is_ramp), rules))
            before_s, lit_s = lit_s, self.bench.budget.on_s
            is_pressed = frame.force_n >= PRESSED_RATIO * self.press.contact_n
            self._untouched_s = 0.0 if is_pressed else self._untouched_s + lit_s - before_s
            if self.machine.is_touching:
                guidance = wanted.see(frame, self.machine.state)
                self._drop_outliers(wanted)
                self._encode(wanted.frames, are_all=wanted.is_complete)
            else:
                guidance = begin
                wanted.begin_again()
            self.board.update(guidance=guidance, frames_taken=len(wanted.frames), wanted_n=wanted.wanted_n)
        require_lit(wanted.frames, self._dark_counts)
        if not self.is_in_oil and (seen := wanted.light_and_hard()):
            require_contrast(*seen, self._dark_counts, self.light.min_contrast_ratio)
        spot_mm = None if ramp else self._spot_mm(role, wanted.frames)
        self._become(self.machine.hold(spot_mm, rules))
        if role == "press":
            self._pressed += wanted.frames
        return wanted.frames

    def _numbered(self, frame: Frame, ramp: int) -> Frame:
        return replace(frame, ramp=ramp) if ramp else frame

    def _by_zero_of_reference(self, frame: Frame) -> Frame:
        """Return a frame on the lesion with its force from the zero that the reference press had.

        What hangs on the cell weighs otherwise as the probe is turned: 30 g at 45 degrees 4 mN per degree, and 10 mN
        between the two presses make an answer wrong by more than its intervals. So what the cell reads in the air just
        before the touch counts against what it read when the untouched frames were taken. That nothing is touched the
        image tells: in the air a face is dark by total reflection. Where that is not seen forces stay as they are read.
        """
        if frame.role != "press":
            return frame
        if not self.machine.is_touching:
            self._see_air(frame)
        return replace(frame, force_n=frame.force_n - self._turned_n) if self._turned_n else frame

    def _see_air(self, frame: Frame) -> None:
        if self._in_air and frame.t_s - self._in_air[-1].t_s > BEFORE_TOUCH_S:
            self._in_air.clear()  # it may have been turned since
        if self._is_in_air(frame):
            self._in_air.append(frame)
        is_known = len(self._in_air) == AIR_FRAMES
        self._turned_n = _mean_n(self._in_air) - _mean_n(self._untouched) if is_known else 0.0

    def _is_in_air(self, frame: Frame) -> bool:
        return (
            abs(frame.force_n) < self.press.contact_n
            and self.bench.range_n(frame.t_s, around_line=False) <= STEADY_N
            and abs(level_counts(frame) - self._clear_counts) < self._clear_within_counts
        )

    def _wait_in_the_dark(self, rules: PressRules, begin: Guidance) -> None:
        """Return once the force says that the probe is about to touch; raises `PressEnded` when that takes too long.

        A zero that is off does not keep it lit: then it takes a rise. Who came so slowly that the light went out at the
        first touch is asked for that rise, too.
        """
        further = Guidance.PRESS_SLOWLY if rules.is_ramp else Guidance.PRESS_HARDER
        self.bench.light(DARK)
        lowest_n = force_n = self.bench.force.latest_n
        while force_n < PRESSED_RATIO * rules.contact_n and force_n - lowest_n < rules.contact_n / 2:
            self._require_wanted()
            self._become(self.machine.see(FrameSeen(time.monotonic(), force_n, force_n, 0.0, 0.0), rules))
            self.board.update(guidance=further if self.machine.is_touching else begin)
            time.sleep(POLL_S)
            force_n = self.bench.force.latest_n
            lowest_n = min(lowest_n, force_n)
        self._untouched_s = max(self.light.untouched_s - WOKEN_S, 0.0)

    def _encode(self, frames: list[Frame], *, are_all: bool) -> None:
        """Let the frames that are kept by now be encoded while the hand goes on."""
        if self._encoded:
            self._encoded.follow([*self._untouched, *self._reference, *self._pressed, *frames], are_all=are_all)

    def _drop_outliers(self, wanted: WantedFrames) -> None:
        """Take the frames again that are unlike the others, once all are there."""
        while wanted.is_complete and (dropped := wanted.drop_outlier(self._dark_counts)):
            self._become(self.machine.replace_frame(dropped.deviation_ratio))

    def _spot_mm(self, role: Role, frames: list[Frame]) -> tuple[float, float] | None:
        """Return where the inclusion lies from the middle of the face; None beside it, or when nothing stands out."""
        if role == "reference":
            self._reference = frames
            self._clear_within_counts = CLEAR_RATIO * (level_counts(frames[-1]) - self._dark_counts)
            return None
        if not (self._dark and self._reference):
            return None
        camera = self.config.camera
        geometry = CameraGeometry(camera.scale, camera.axis_x_mm, camera.axis_y_mm, camera.rim_distortion_percent)
        return inclusion_spot_mm(self._dark, self._reference, frames, geometry)

    def _observation(self, frame: Frame, *, is_ramp: bool) -> FrameSeen:
        since_s, self._before_s = self._before_s, frame.t_s
        return FrameSeen(
            t_s=frame.t_s,
            force_n=frame.force_n,
            peak_n=self.bench.peak_n(since_s, frame.t_s),
            range_n=self.bench.range_n(frame.t_s, around_line=is_ramp),
            rate_n_per_s=self.bench.rate_n_per_s(frame.t_s),
            saturated_ratio=saturated_ratio(frame.counts),
        )

    def _become(self, press: PressUnderWay) -> None:
        """Take over what the machine says, and tell the board; raise `PressEnded` when it is the end."""
        self.machine = press
        self.board.update(state=press.state)
        if press.ending:
            raise PressEnded(press.ending, press.reason)

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

    def release(self) -> None:
        """Let the hand lift: every frame is there."""
        self._become(self.machine.release(time.monotonic()))

    def drop_ramp(self) -> None:
        """Forget a press on the lesion that was not completed: the hand lifts, those before it stay."""
        self.machine = PressUnderWay(PressState.RELEASING, contact_s=time.monotonic())
        self.board.update(state=self.machine.state, frames_taken=0, wanted_n=())

    @contextmanager
    def unless(self, is_enough: Callable[[bool], bool]) -> Iterator[None]:
        """Within it, raise `RampGivenUp` as soon as that is so; it is told whether the probe is being pressed."""
        self._is_enough = is_enough
        try:
            yield
        finally:
            self._is_enough = _never

    def lifted(self) -> None:
        """Return once the probe touches nothing between two presses; raises `PressEnded` as `loaded` does."""
        self.bench.light(DARK)
        while (force_n := self.bench.force.latest_n) >= self.press.contact_n:
            self._require_wanted()
            self._become(self.machine.wait(time.monotonic(), force_n, self.press))
            time.sleep(POLL_S)

    def done(self) -> None:
        """Say that the measurement is kept."""
        self._become(self.machine.done())

    def end(self, reason: str, ending: Ending = "rejected") -> None:
        """End the press under way, if there is one, for a reason that the machine does not know."""
        if self.machine.state in ACTIVE:
            self.machine = self.machine.reject(reason, ending)
            self.board.update(state=self.machine.state)

    def clear(self) -> None:
        """Forget the last press: the next may begin."""
        self.machine = PressUnderWay()

    def forget_frames(self) -> None:
        """Let go of the frames of a press that has ended."""
        self._reference, self._pressed = [], []
        if self._encoded:
            self._encoded.clear()

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
        self._become(self.machine.check(self._observation(frames[-1], is_ramp=False), self.press))
        return frames[-1]

    def _require_wanted(self) -> None:
        self._require_going_on()
        if self._is_enough(self.machine.is_touching):
            raise RampGivenUp

    def _require_going_on(self) -> None:
        self._progress.beat()
        self.bench.budget.require_left()
        if self.cancelled.is_set():
            self._become(self.machine.reject(CANCELLED, "cancelled"))
        if self.stopping.is_set():
            self._become(self.machine.reject("The daemon was stopped during the press.", "failed"))


def _never(is_touching: bool) -> bool:
    return False


def _mean_n(frames: Collection[Frame]) -> float:
    return sum(frame.force_n for frame in frames) / len(frames)
