"""Runs the self-test on the bench: every check one after the other, also when one before it has failed.

It runs on the procedure's thread, which owns light and camera, between presses. It ends dark.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from device.config import Config
from device.errors import DeviceError
from device.instrument.bench import DARK, Bench
from device.instrument.clock_watch import ClockWatch
from device.instrument.guidance import Guidance
from device.instrument.self_test.check_camera import camera_results
from device.instrument.self_test.check_clock import clock_results
from device.instrument.self_test.check_disk import disk_results
from device.instrument.self_test.check_force import rest_results, untested_weight, weight_result
from device.instrument.self_test.check_models import model_results
from device.instrument.self_test.check_sides import side_results, untested_sides
from device.instrument.self_test.job import SelfTestJob
from device.instrument.self_test.operator import Operator
from device.instrument.self_test.result import Result, broken, not_tested, overall
from device.instrument.status import StatusBoard
from device.measurement.led_sides import SIDES, LedRatio
from device.measurement.tactile_image import Frame
from device.records.store import Store

DARK_FRAMES = 8
REST_S = 0.5
FREE_TIMEOUT_S = 10.0
OPERATOR_TIMEOUT_S = 30.0
HELD_RATIO = 0.7
"""Below this part of the target force a side lights the opposite half about as much as its own."""
ZERO_FIRST = "The load cell's zero comes first: without it nobody knows how hard the probe is pressed."

Check = Callable[[SelfTestJob], list[Result]]


class SelfTest:
    """Every check of this probe. `folder_of` says where an installed model lies."""

    def __init__(
        self,
        config: Config,
        bench: Bench,
        store: Store,
        clock: ClockWatch,
        board: StatusBoard,
        stopping: threading.Event,
        folder_of: Callable[[Path], Path] = Path,
    ) -> None:
        self._config, self._bench, self._store, self._clock = config, bench, store, clock
        self._board, self._operator = board, Operator(board, bench.force, bench.progress, stopping)
        self._folder_of = folder_of
        self._offset_s, self._zero_holds = 0.0, False

    def results(self, job: SelfTestJob) -> Iterator[list[Result]]:
        """Yield the results of each check as it ends; a fault is a result, too."""
        self._offset_s, self._zero_holds = self._clock.offset_s, False
        checks: dict[str, Check] = {
            "disk": self._disk,
            "models": self._models,
            "dark frames": self._camera,
            "LED circuits": self._circuits,
            "zero": self._rest,
            "known weight": self._weight,
            "LED sides": self._sides,
            "clock": self._time,
        }
        for name, check in checks.items():
            try:
                yield check(job)
            except DeviceError as error:
                yield [broken(name, error)]

    def _disk(self, job: SelfTestJob) -> list[Result]:
        return disk_results(self._store, self._config.store.min_free_mb)

    def _models(self, job: SelfTestJob) -> list[Result]:
        with self._bench.progress.inside("inference"):
            return model_results(self._config, self._folder_of)

    def _camera(self, job: SelfTestJob) -> list[Result]:
        self._bench.light(DARK)
        dark = [self._bench.expose().counts for _ in range(DARK_FRAMES)]
        return camera_results(dark, self._config.light.max_dark_counts)

    def _circuits(self, job: SelfTestJob) -> list[Result]:
        self._bench.check_lights()
        if self._config.light.chip == "pca9685":
            return [not_tested("Light", "LED circuits", "A pca9685 does not measure current.")]
        return [Result("Light", "LED circuits", "passed")]

    def _rest(self, job: SelfTestJob) -> list[Result]:
        press, cell = self._config.press, self._config.cell
        self._operator.until(Guidance.KEEP_FREE, lambda force_n: force_n < press.contact_n, FREE_TIMEOUT_S)
        time.sleep(REST_S)
        force = self._bench.force
        rest_n = force.mean_n(window_s=REST_S)
        results = rest_results(rest_n, force.zero_shift_n, cell.tare_spread_n, cell.tare_drift_n)
        self._zero_holds = overall(results) == "passed"
        return results

    def _weight(self, job: SelfTestJob) -> list[Result]:
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

    def _sides(self, job: SelfTestJob) -> list[Result]:
        if not job.on_block:
            return untested_sides()
        if not self._zero_holds:
            return untested_sides(ZERO_FIRST)
        low_n, high_n = self._config.press.band_n
        if not self._operator.until(Guidance.HOLD_BLOCK, lambda force_n: low_n <= force_n, OPERATOR_TIMEOUT_S):
            return untested_sides(f"It was not held with {low_n:g} to {high_n:g} N within {OPERATOR_TIMEOUT_S:g} s.")
        self._board.update(guidance=Guidance.HOLD_STILL)
        try:
            return self._held_sides()
        finally:
            self._bench.light(DARK)
            self._board.update(guidance=Guidance.LIFT)

    def _held_sides(self) -> list[Result]:
        light, least_n = self._config.light, HELD_RATIO * self._config.press.target_n
        views = [self._view(DARK), *(self._view(_alone(side, light.ratio[side])) for side in range(len(SIDES)))]
        if min(frame.force_n for frame in views) < least_n:
            return untested_sides(f"It was held with less than {least_n:g} N: hold it until the screen says so.")
        dark, *lit = (frame.counts for frame in views)
        return side_results(dark, lit, light.ratio, light.min_side_ratio)

    def _view(self, ratio: LedRatio) -> Frame:
        self._bench.light(ratio)
        return self._bench.take("reference")

    def _time(self, job: SelfTestJob) -> list[Result]:
        drift_s = self._clock.offset_s - self._offset_s
        return clock_results(drift_s, self._config.clock.max_jump_s, self._clock.now())


def _alone(side: int, ratio: float) -> LedRatio:
    plus_x, plus_y, minus_x, minus_y = (ratio if side == number else 0.0 for number in range(len(SIDES)))
    return plus_x, plus_y, minus_x, minus_y
