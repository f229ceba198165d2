"""Runs the self-test on the bench: every check one after the other, also when one before it has failed.

It runs on the procedure's thread, which owns light and camera, between presses. It waits for what the operator does:
keep the probe free, hold it on a block, put a weight on it. It ends dark.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from device.config import Config
from device.errors import DeviceError
from device.instrument.acquisition.bench import DARK, Bench
from device.instrument.acquisition.force_recorder import ForceRecorder
from device.instrument.press.states import Guidance
from device.instrument.self_test.checks import (
    FLAT_FIELD,
    NO_RAMP_MODEL,
    UNLIKE_PRESSES,
    camera_results,
    clock_results,
    disk_results,
    flat_field_result,
    model_results,
    rest_results,
    side_results,
    untested_flat_field,
    untested_sides,
    untested_weight,
    weight_result,
)
from device.instrument.self_test.report import CheckResult, SelfTestJob, broken, not_tested, overall
from device.instrument.status import StatusBoard
from device.instrument.watch.calibration_watch import UNTOUCHED_N
from device.instrument.watch.clock_watch import ClockWatch
from device.instrument.watch.progress import ProgressBoard
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.flat_field_error import flat_field_error
from device.measurement.recording.led_sides import SIDES, LedRatio
from device.measurement.recording.tactile_image import Counts, Frame
from device.records.store import Store

POLL_S = 0.02
SETTLED_S = 0.5
DARK_FRAMES = 8
REST_S = 0.5
FREE_TIMEOUT_S, LIFTED_TIMEOUT_S = 10.0, 3.0
OPERATOR_TIMEOUT_S = 30.0
RISE_FROM_RATIO, RISE_TO_RATIO, MOST_RISING, HELD_FRAMES = 0.6, 1.2, 24, 8
"""Frames of a press on the block count between these parts of the target force: so many last ones while it rises, so
many when it is held."""
HELD_RATIO = 0.7
"""Below this part of the target force a side lights the opposite half about as much as its own."""
ZERO_FIRST = "The load cell's zero comes first: without it nobody knows how hard the probe is pressed."
CheckOf = Callable[[SelfTestJob], list[CheckResult]]


class Operator:
    """Tells the operator what to do by the screen's guidance, and waits until the load cell says that it is done."""

    def __init__(
        self, board: StatusBoard, force: ForceRecorder, progress: ProgressBoard, stopping: threading.Event
    ) -> None:
        self._board, self._force, self._progress, self._stopping = board, force, progress, stopping

    def until(self, guidance: Guidance, is_done: Callable[[float], bool], timeout_s: float) -> bool:
        """Show what to do until the force (N) says that it is done; return False when that takes too long.

        Raises `LoadCellError` when the force is not known.
        """
        self._board.update(guidance=guidance)
        deadline_s = time.monotonic() + timeout_s
        while not self._stopping.is_set():
            if is_done(self._force.latest_n):
                return True
            if time.monotonic() > deadline_s:
                return False
            self._beat()
            time.sleep(POLL_S)
        return False

    def settle(self, steady_n: float, timeout_s: float) -> None:
        """Wait until the force has hardly changed (N) for half a second, or until that takes too long."""
        deadline_s = time.monotonic() + timeout_s
        while time.monotonic() < deadline_s and not self._stopping.is_set():
            self._beat()
            time.sleep(SETTLED_S)
            if self._force.range_n(time.monotonic(), window_s=SETTLED_S) <= steady_n:
                return

    def _beat(self) -> None:
        """Keep the idle parts going for the watchdog; what is wrong with one is for its own check to say."""
        with suppress(DeviceError):
            self._progress.beat()


class SelfTestRun:
    """Every check of this probe. `folder_of` says where an installed model lies.

    `flat_field_ratio` is the level of the flat field that the models of ramps believe in, None without any.
    """

    def __init__(
        self,
        config: Config,
        bench: Bench,
        store: Store,
        clock: ClockWatch,
        board: StatusBoard,
        stopping: threading.Event,
        folder_of: Callable[[Path], Path] = Path,
        flat_field_ratio: float | None = None,
    ) -> None:
        self._config, self._bench, self._store, self._clock = config, bench, store, clock
        self._board, self._operator = board, Operator(board, bench.force, bench.progress, stopping)
        self._folder_of, self._flat_field_ratio = folder_of, flat_field_ratio
        self._offset_s, self._zero_holds = 0.0, False
        self._first_press: list[Frame] | None = None
        """Of the block, for the flat field: empty where it did not come, None where nobody was to hold it, or could."""

    def results(self, job: SelfTestJob) -> Iterator[list[CheckResult]]:
        """Yield the results of each check as it ends; a fault is a result, too."""
        self._offset_s, self._zero_holds = self._clock.offset_s, False
        self._first_press = None
        checks: dict[str, CheckOf] = {
            "disk": self._disk,
            "models": self._models,
            "dark frames": self._camera,
            "LED circuits": self._circuits,
            "enable line": self._line,
            "zero": self._rest,
            "known weight": self._weight,
            "LED sides": self._sides,
            FLAT_FIELD: self._flat_field,
            "clock": self._time,
        }
        for name, check in checks.items():
            try:
                yield check(job)
            except DeviceError as error:
                yield [broken(name, error)]

    def _disk(self, job: SelfTestJob) -> list[CheckResult]:
        return disk_results(self._store, self._config.store.min_free_mb)

    def _models(self, job: SelfTestJob) -> list[CheckResult]:
        with self._bench.progress.inside("inference"):
            return model_results(self._config, self._folder_of)

    def _camera(self, job: SelfTestJob) -> list[CheckResult]:
        self._bench.light(DARK)
        dark = [self._bench.expose().counts for _ in range(DARK_FRAMES)]
        return camera_results(dark, self._config.light.max_dark_counts)

    def _circuits(self, job: SelfTestJob) -> list[CheckResult]:
        self._bench.check_lights()
        if self._config.light.chip == "pca9685":
            return [not_tested("Light", "LED circuits", "A pca9685 does not measure current.")]
        return [CheckResult("Light", "LED circuits", "passed")]

    def _line(self, job: SelfTestJob) -> list[CheckResult]:
        if self._config.light.enable_line is None:
            return [not_tested("Light", "enable line", "There is none: wire one, and set light.enable_line.")]
        if self._bench.check_line():
            return [CheckResult("Light", "enable line", "passed")]
        return [not_tested("Light", "enable line", "A pca9685 does not tell whether its outputs are enabled.")]

    def _rest(self, job: SelfTestJob) -> list[CheckResult]:
        press, cell = self._config.press, self._config.cell
        self._operator.until(Guidance.KEEP_FREE, lambda force_n: force_n < press.contact_n, FREE_TIMEOUT_S)
        time.sleep(REST_S)
        force = self._bench.force
        rest_n = force.mean_n(window_s=REST_S)
        results = rest_results(rest_n, force.zero_shift_n, cell.tare_spread_n, cell.tare_drift_n)
        self._zero_holds = overall(results) == "passed"
        return results

    def _weight(self, job: SelfTestJob) -> list[CheckResult]:
        weight_n, press = job.weight_n, self._config.press
        if weight_n is None:
            return [untested_weight()]
        if not self._zero_holds:
            return [untested_weight(ZERO_FIRST)]
        if not self._operator.until(Guidance.PUT_WEIGHT, lambda force_n: force_n > weight_n / 2, OPERATOR_TIMEOUT_S):
            return [untested_weight(f"No weight came within {OPERATOR_TIMEOUT_S:g} s: repeat it.")]
        self._operator.settle(press.steady_n, OPERATOR_TIMEOUT_S)
        measured_n = self._bench.force.mean_n(window_s=REST_S)
        self._operator.until(Guidance.TAKE_WEIGHT_OFF, lambda force_n: force_n < press.contact_n, OPERATOR_TIMEOUT_S)
        return [weight_result(measured_n, weight_n, self._config.cell.tare_spread_n)]

    def _sides(self, job: SelfTestJob) -> list[CheckResult]:
        if not job.on_block:
            return untested_sides()
        if not self._zero_holds:
            return untested_sides(ZERO_FIRST)
        try:
            pressed = self._pressed_on_block()
            found = self._held_sides() if pressed else untested_sides(self._not_held)
            self._first_press = pressed
            return found
        finally:
            self._bench.light(DARK)
            self._board.update(guidance=Guidance.LIFT)

    @property
    def _not_held(self) -> str:
        low_n, high_n = self._config.press.band_n
        return f"It was not held with {low_n:g} to {high_n:g} N within {OPERATOR_TIMEOUT_S:g} s."

    def _pressed_on_block(self) -> list[Frame]:
        """Return the frames of a press on the block as it rises, and some held ones; none if it did not come.

        There is light from `RISE_FROM_RATIO` of the target force on, within the light's budget. It is held still then,
        for more to come.
        """
        press, rising = self._config.press, deque[Frame](maxlen=MOST_RISING)
        from_n, to_n = RISE_FROM_RATIO * press.target_n, RISE_TO_RATIO * press.target_n
        low_n, _ = press.band_n

        def is_held(force_n: float) -> bool:
            """Take a frame if it is pressed, and return whether the press has come to its force."""
            if force_n < from_n:
                self._bench.light(DARK)
                rising.clear()  # a touch that was broken off is no part of the press
                return False
            self._bench.budget.require_left()
            self._bench.light(self._config.light.ratio)
            rising.append(self._bench.take("reference"))
            return force_n >= low_n

        if not self._operator.until(Guidance.HOLD_BLOCK, is_held, OPERATOR_TIMEOUT_S):
            return []
        self._board.update(guidance=Guidance.HOLD_STILL)
        frames = [*rising, *(self._bench.take("reference") for _ in range(HELD_FRAMES))]
        return [frame for frame in frames if from_n <= frame.force_n <= to_n]

    def _flat_field(self, job: SelfTestJob) -> list[CheckResult]:
        first, self._first_press = self._first_press, None
        if not job.on_block or (first is None and self._zero_holds):
            return untested_flat_field()
        if first is None:
            return untested_flat_field(ZERO_FIRST)
        if self._flat_field_ratio is None:
            return untested_flat_field(NO_RAMP_MODEL)
        if not first:
            return untested_flat_field(self._not_held)
        contact_n = self._config.press.contact_n
        if not self._operator.until(Guidance.LIFT, lambda force_n: force_n < contact_n, FREE_TIMEOUT_S):
            return untested_flat_field(f"It was not lifted within {FREE_TIMEOUT_S:g} s: repeat it.")
        try:
            second = self._pressed_on_block()
            dark = self._view(DARK).counts
        finally:
            self._bench.light(DARK)
            # So that the next press finds an untouched face; a zero that is off by a little takes the time.
            self._operator.until(Guidance.LIFT, lambda force_n: force_n <= UNTOUCHED_N, LIFTED_TIMEOUT_S)
        return self._compared(first, second, dark) if second else untested_flat_field(self._not_held)

    def _compared(self, first: list[Frame], second: list[Frame], dark: Counts) -> list[CheckResult]:
        """Return what two presses on the block say; nothing where they were too short or too fast to compare."""
        assert self._flat_field_ratio is not None  # `_flat_field` has asked
        try:
            found = flat_field_error(first, second, dark, self._config.camera.scale)
        except InvalidQuantity:
            return untested_flat_field(UNLIKE_PRESSES)
        if found.noise_ratio > self._flat_field_ratio:
            return untested_flat_field(UNLIKE_PRESSES)
        return [flat_field_result(found.level_ratio, self._flat_field_ratio)]

    def _held_sides(self) -> list[CheckResult]:
        light, least_n = self._config.light, HELD_RATIO * self._config.press.target_n
        views = [self._view(DARK), *(self._view(_alone(side, light.ratio[side])) for side in range(len(SIDES)))]
        if min(frame.force_n for frame in views) < least_n:
            return untested_sides(f"It was held with less than {least_n:g} N: hold it until the screen says so.")
        dark, *lit = (frame.counts for frame in views)
        return side_results(dark, lit, light.ratio, light.min_side_ratio)

    def _view(self, ratio: LedRatio) -> Frame:
        self._bench.light(ratio)
        return self._bench.take("reference")

    def _time(self, job: SelfTestJob) -> list[CheckResult]:
        drift_s = self._clock.offset_s - self._offset_s
        return clock_results(drift_s, self._config.clock.max_jump_s, self._clock.now())


def _alone(side: int, ratio: float) -> LedRatio:
    plus_x, plus_y, minus_x, minus_y = (ratio if side == number else 0.0 for number in range(len(SIDES)))
    return plus_x, plus_y, minus_x, minus_y
