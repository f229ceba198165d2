"""One press on a phantom whose inclusion is known, beside it and on it, to a recording with that truth.

It needs no certificate, and nothing is estimated: certificates are made of such recordings.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from device.config import Config
from device.errors import DeviceError, NoContrastError
from device.instrument.acquisition.bench import DARK, Bench
from device.instrument.acquisition.light_check import DimmingWatch
from device.instrument.press.capture import CalledAway, Capture, PressEnded
from device.instrument.press.record import recording_of
from device.instrument.press.states import CANCELLED, Guidance
from device.instrument.status import StatusBoard
from device.instrument.watch.clock_watch import ClockWatch
from device.instrument.watch.computer_watch import ComputerWatch
from device.instrument.watch.zero_watch import ZeroWatch
from device.measurement.mode import Mode
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.recording import Recording
from device.measurement.recording.tactile_image import Frame
from device.records.store import Store

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class PhantomTruth:
    """What is pressed: its inclusion, None in a bare block, and the serial number of its set, empty if it has none.

    A grid target has none either; `is_grid` says that its plates lie in oil. `tissue_kpa_mm` are modulus and thickness
    where they are known: a virtual probe is pressed on such tissue.
    """

    inclusion: Inclusion | None
    serial: str = ""
    is_grid: bool = False
    tissue_kpa_mm: tuple[float, float] | None = None


class PhantomPress:
    """Leads the operator, by the guidance on `board`, through a measurement that is recorded only."""

    def __init__(
        self,
        config: Config,
        bench: Bench,
        store: Store,
        *,
        clock: ClockWatch,
        opened: ExitStack,
        simulated: bool,
        computer: ComputerWatch | None = None,
    ) -> None:
        self.board = StatusBoard()
        self._config, self._bench, self._store, self._clock = config, bench, store, clock
        self._opened, self._simulated, self._computer = opened, simulated, computer
        if computer:
            computer.start()
        self._listeners: list[Callable[[Mode], None]] = []

    def on_request(self, listener: Callable[[Mode], None]) -> None:
        """Call `listener` with the mode when the press is to begin."""
        self._listeners.append(listener)

    def record(self, phantom: PhantomTruth, mode: Mode, folder: Path, cancelled: threading.Event) -> None:
        """Take the frames of a mode and write them to a new folder; ends dark, and so when `cancelled` is set.

        Raises `PressEnded` when the press is rejected or cancelled, and the `DeviceError` that ends it.
        """
        try:
            recording = self._recording(phantom, mode, cancelled)
            self._store.write_out(recording, folder)
        except (PressEnded, NoContrastError, InvalidQuantity):
            self.board.update(guidance=Guidance.REJECTED)
            raise
        except DeviceError:
            self.board.update(guidance=Guidance.FAULT)
            raise
        self.board.update(guidance=Guidance.DONE)

    def close(self) -> None:
        """Keep how long the light was on, and release every part that was opened."""
        try:
            self._store.add_light_on_s(self._bench.budget.unsaved_s)
        except DeviceError as error:
            log.error("%s %s", error.code, error)
        finally:
            if self._computer:
                self._computer.close()
            self._opened.close()

    def _recording(self, phantom: PhantomTruth, mode: Mode, cancelled: threading.Event) -> Recording:
        capture = Capture(self._bench, self._config, self.board, self._bench.progress)
        capture.cancelled = capture.called_away = cancelled
        capture.is_in_oil = phantom.is_grid
        try:
            unloaded = self._unloaded(capture)
            started_at = self._clock.now()
            frames = self._pressed(capture, mode)
        finally:
            self._darken()
        self._warn(self._clock.warning())
        for warning in self._computer.taken() if self._computer else ():
            self._warn(warning)
        recording = recording_of(
            [*unloaded, *frames], self._config, started_at=started_at, calibration_id=None, simulated_truth=None
        )
        return replace(recording, truth=phantom.inclusion, phantom_serial=phantom.serial, simulated=self._simulated)

    def _unloaded(self, capture: Capture) -> list[Frame]:
        try:
            if capture.cancelled.is_set():
                raise CalledAway
            unloaded = capture.unloaded()
        except CalledAway:
            raise PressEnded("cancelled", CANCELLED) from None
        zero = ZeroWatch(self._config.press.contact_n)
        unloaded = zero.saw(unloaded, self._bench.force)
        capture.count_from(unloaded)
        for warning in zero.warned(()):
            self._warn(warning)
        return unloaded

    def _pressed(self, capture: Capture, mode: Mode) -> list[Frame]:
        """Return the frames beside the inclusion and on it; each side's light is looked at as in any press."""
        self._bench.budget.begin_press()
        for listener in self._listeners:
            listener(mode)
        beside = capture.loaded("reference", mode)
        light = self._config.light
        dimming = DimmingWatch(light.max_dimming_ratio, light.commissioned_counts)
        self._warn(dimming.warning(capture.side_levels(beside)))
        capture.release()
        self.board.update(guidance=Guidance.LIFT)
        capture.lifted()
        on_it = capture.loaded("press", mode)
        capture.release()
        return [*beside, *on_it]

    def _warn(self, warning: DeviceError | None) -> None:
        if warning:
            log.warning("%s %s", warning.code, warning)

    def _darken(self) -> None:
        """Switch the light off; what ended the press is not hidden by a chip that does not answer any more."""
        try:
            self._bench.light(DARK)
        except DeviceError as error:
            log.error("%s %s", error.code, error)
