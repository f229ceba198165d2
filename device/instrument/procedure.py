"""The press procedure: reference press beside the lesion, press or scan on the lesion, estimate, keep.

One thread runs it and owns light and camera; a second only darkens when the daemon is to stop. A press begins by a
request or by itself, when the force passes the contact threshold. Everything that ends a press has a reason that the
operator reads.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path

from device.config import Config
from device.errors import (
    DeviceError,
    InterruptedPress,
    LightError,
    LightRestError,
    LoadCellError,
    NoContrastError,
    ZeroShiftError,
)
from device.hardware.interfaces import Newtons
from device.instrument.acquisition.bench import DARK, Bench
from device.instrument.acquisition.brightness_loop import BrightnessLoop
from device.instrument.acquisition.light_check import DimmingWatch
from device.instrument.press.capture import CalledAway, Capture, PressEnded
from device.instrument.press.cost import AnswerTimes, ModeOffer, press_cost
from device.instrument.press.encoded_frames import EncodedFrames
from device.instrument.press.probe_answers import ProbeAnswers
from device.instrument.press.record import SAVE_LIGHT_EVERY_S, PressAnswer, PressAnswers, PressBook
from device.instrument.press.requests import PressRequests
from device.instrument.press.scan import Scan, ScanTaken
from device.instrument.press.states import CANCELLED, Guidance, PressState, before_contact
from device.instrument.self_test.report import SelfTestJob
from device.instrument.self_test.requests import SelfTestRequests
from device.instrument.self_test.run import SelfTestRun
from device.instrument.status import PressJob, StatusBoard, kept_job
from device.instrument.watch.backup_watch import BackupWatch
from device.instrument.watch.calibration_watch import CalibrationWatch
from device.instrument.watch.clock_watch import ClockWatch
from device.instrument.watch.computer_watch import ComputerWatch
from device.instrument.watch.progress import ProgressBoard
from device.instrument.watch.readiness import HealthPart, PartHealth, parts_health
from device.instrument.watch.recordings_watch import RecordingsWatch, retention_rule
from device.instrument.watch.space_watch import SpaceWatch
from device.instrument.watch.zero_watch import ZeroWatch
from device.measurement.mode import FRAMES, Mode
from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require
from device.measurement.recording.tactile_image import Frame
from device.measurement.wanted_accuracy import WantedAccuracy
from device.records.asked_once import AskedOnce
from device.records.exams import AskedExam
from device.records.store import ENDED, Store, StoredRecord

log = logging.getLogger(__name__)

UNLOADED_VALID_S = 30.0
"""Dark and unloaded frames older than this are taken again before a press."""
AFTER_FAULT_S = 1.0
REST_AFTER_S = 10.0
"""Nobody has pressed for so long: the camera rests. The next press of a patient finds it awake."""
LOOK_EVERY_S = 0.1
"""So soon a request is seen; a touch is seen with the sample that shows it."""
WRITE_EVERY_S = 20.0
"""So often a write that nobody needs proves the store: seldom enough not to wear the card out."""


class Procedure:
    """Runs presses one after the other on a bench."""

    def __init__(
        self,
        config: Config,
        bench: Bench,
        answers: ProbeAnswers,
        store: Store,
        *,
        calibration: CalibrationWatch,
        opened: ExitStack,
        clock: ClockWatch | None = None,
        computer: ComputerWatch | None = None,
        progress: ProgressBoard | None = None,
        simulated_truth: Inclusion | None = None,
        folder_of: Callable[[Path], Path] = Path,
    ) -> None:
        """Take what this probe can answer: the settings' own mode is among it. `folder_of` says where an installed
        model lies."""
        self.config, self.bench, self.store, self._opened = config, bench, store, opened
        self.modes, self._worth, self.calibration = answers.modes, answers.worth, calibration
        self.mode = answers.mode_unless_asked(config.press.mode)
        self.board, self.progress = StatusBoard(), progress or ProgressBoard()
        self._show_what_was_kept()
        self._encoded = EncodedFrames()
        self._answers = PressAnswers(
            config, calibration, answers, store, self.progress, simulated_truth, self._encoded.png_of
        )
        self._capture = Capture(bench, config, self.board, self.progress, self._encoded)
        self._clock = clock or ClockWatch(config.clock.max_jump_s)
        self._computer, self._recordings = computer, RecordingsWatch(store, self._clock, retention_rule(config))
        self._space, self._backups = SpaceWatch(store, config), BackupWatch(store, config.store.warn_unsaved_days)
        self._zero = ZeroWatch(config.press.contact_n)
        self._dimming = DimmingWatch(config.light.max_dimming_ratio, config.light.commissioned_counts)
        self._brightness = BrightnessLoop(self._capture.lit, config.light.target_counts)
        self._requests = PressRequests(
            self.board,
            store,
            modes=answers.modes,
            mode=self.mode,
            cancelled=self._capture.cancelled,
            finished=self._capture.finished,
            called_away=self._capture.called_away,
            now=self._clock.now,
            is_clock_steady=lambda: self._clock.is_steady,
        )
        self._obeying_once = threading.Lock()
        self._book = PressBook(self.board, store, bench.budget)
        self._answer_times = AnswerTimes(config.data / "answer_times.json")
        self._written_s, self._used_s = -math.inf, time.monotonic()
        self.progress.exercise("storage", self._prove_store)
        stopping = self._capture.stopping
        believed = answers.flat_field_ratio
        test = SelfTestRun(config, bench, store, self._clock, self.board, stopping, folder_of, believed)
        self._self_tests = SelfTestRequests(self.board, test, self._clock.now, self._capture.called_away)
        self._thread = threading.Thread(target=self._run, name="procedure", daemon=True)
        self._darkening = threading.Thread(target=self._darken_at_stop, name="darkening", daemon=True)

    @property
    def is_simulated(self) -> bool:
        """Whether hand, light and tissue are simulated; everything above the chips is not."""
        return self._answers.is_simulated

    def offers(self) -> list[ModeOffer]:
        """Return what a press can be asked for, with what each mode costs and is worth as known now."""
        return self._answer_times.offers([press_cost(mode, self.config) for mode in self.modes], self._worth)

    def require_ready(self) -> None:
        """Raise the fault that keeps a press from being measured, if there is one."""
        if self.board.now.hindrance:
            raise self.board.now.hindrance
        _ = self.bench.force.latest_n

    def parts(self) -> dict[HealthPart, PartHealth]:
        """Return which parts were seen working just now; waits for none of them."""
        return parts_health(self.board.now, self.progress, self.bench.force.fault)

    def _show_what_was_kept(self) -> None:
        """Show the press before the start and its result, and tell of one that was broken off by the end before."""
        job, warnings = kept_job(self.store.last_press()), list[DeviceError](self.store.findings.warnings())
        if self.store.interrupted:
            asked_at = self.store.interrupted[-1].get("asked_at") or "an unknown time"
            cause = f"The press asked for at {asked_at} was broken off when the daemon ended."
            warnings.append(InterruptedPress(cause, "Press again; measurements that were shown are kept."))
        self.board.update(press=job, measurement_id=job.measurement_id if job else None, warnings=tuple(warnings))

    def start(self) -> None:
        """Begin to wait for presses."""
        self._darkening.start()
        if self._computer:
            self._computer.start()
        self._recordings.start()
        self._thread.start()

    def stop(self) -> None:
        """Darken the probe at once and end the press under way; waits for nothing, so a signal may ask for it."""
        if not self._capture.stopping.is_set():  # a signal may come while the event is being set
            self._capture.stopping.set()

    def close(self) -> None:
        """End the press under way, switch the light off and release every part that was opened."""
        self.stop()
        self._thread.join(timeout=5.0)
        self._darkening.join(timeout=1.0)
        if self._computer:
            self._computer.close()
        self._recordings.close()
        self._encoded.close()
        self._opened.close()

    def request(
        self,
        mode: Mode | None = None,
        wanted: WantedAccuracy | None = None,
        *,
        once: AskedOnce | None = None,
        exam: AskedExam | None = None,
    ) -> PressJob:
        """Ask for a measurement in a mode, that of the settings unless given; see `PressRequests.ask`.

        Raises `InvalidQuantity` for a wanted accuracy that the mode has not to offer.
        """
        mode = mode or self.mode
        if wanted:
            wanted.require_for(mode, self._worth.get(mode), press_cost(mode, self.config).seconds)
        return self._requests.ask(mode, wanted, once=once, exam=exam)

    def request_once(
        self,
        once: AskedOnce,
        mode: Mode | None = None,
        wanted: WantedAccuracy | None = None,
        *,
        exam: AskedExam | None = None,
    ) -> StoredRecord:
        """Ask for a measurement unless this very request was obeyed before; return what it was answered with then.

        What was refused is not kept: sent again it is asked anew. Raises `ReusedKey` for another request's key.
        """
        with self._obeying_once:
            return self.store.answer_to(once) or self.request(mode, wanted, once=once, exam=exam).as_record()

    def on_request(self, listener: Callable[[Mode], None]) -> None:
        """Call `listener` with the mode whenever a press is requested."""
        self._requests.on_request(listener)

    def cancel(self, press_id: str) -> None:
        """Cancel the press that waits or is under way; see `PressRequests.cancel`."""
        self._requests.cancel(press_id)

    def finish(self, press_id: str) -> None:
        """Answer the scan under way with what is there; see `PressRequests.finish`."""
        self._requests.finish(press_id)

    def idle(self) -> AbstractContextManager[None]:
        """While it is held no press begins; raises `BusyError` while a press or a self-test is under way."""
        return self._requests.idle()

    def tare(self) -> Newtons:
        """Take the load cell's tare anew while nothing touches the probe; return by how much (N) the zero has moved.

        Raises `BusyError` while a press or a self-test is under way, and the `LoadCellError` that forbids the tare,
        such as `ZeroShiftError` under load: then the zero is what it was.
        """
        with self._requests.idle():
            moved_n = self.bench.force.retare()
            self._capture.called_away.set()  # the unloaded frames were taken by the zero of before
        log.info("tared by request: the zero has moved by %+.4f N", moved_n)
        return moved_n

    def request_self_test(self, *, on_block: bool = False, weight_n: float | None = None) -> SelfTestJob:
        """Ask for a self-test, with the probe held on the reference block and with a known weight (N) if given.

        Raises `BusyError` while a press or a self-test is under way, `InvalidQuantity` for a weight that is too light
        to be told from none, or more than the load cell bears.
        """
        if weight_n is not None:
            bound = Bound(2 * self.config.press.contact_n, self.config.cell.max_load_n, "N")
            require("weight_n", weight_n, bound, "take another weight")
        with self._requests.idle():
            return self._self_tests.ask(on_block=on_block, weight_n=weight_n)

    @property
    def self_test(self) -> SelfTestJob:
        """The self-test under way or the last one; raises `UnknownResource` when there was none."""
        return self._self_tests.last

    def _darken_at_stop(self) -> None:
        """Darken as soon as the daemon is to stop: the procedure's own thread may be waiting for a camera."""
        self._capture.stopping.wait()
        try:
            self.bench.darken_for_good()
        except LightError as error:
            log.error("%s %s", error.code, error)

    def _run(self) -> None:
        self._run_presses()
        try:
            self._book.save_light_hours()
        except DeviceError as error:
            log.error("%s %s", error.code, error)

    def _run_presses(self) -> None:
        while not self._capture.stopping.is_set():
            self._capture.called_away.clear()
            try:
                self._self_tests.run_if_asked()
                self._one_press()
            except CalledAway:
                continue
            except DeviceError as error:
                self._at_fault(error)
            except Exception as error:
                log.exception("press failed")
                self._at_fault(DeviceError(f"The daemon failed: {error!r}.", "Restart it and report the log."))

    def _one_press(self) -> None:
        self.progress.beat()
        self._look_at_disk()
        self._book.save_light_hours(at_least_s=SAVE_LIGHT_EVERY_S)
        self._book.warn(self._clock.warning())
        self._warn_of_watches()
        self.calibration.require_valid(self._clock.now())
        self.bench.budget.require_for_press()
        self._capture.lit = self._brightness.ratio
        unloaded = self._capture.unloaded(self._while_touched)
        if self._capture.stopping.is_set() or self._capture.called_away.is_set():
            return  # it may have too few frames to judge, or they count from the zero of before a tare
        unloaded = self._follow_zero(unloaded)
        self._require_no_drift(unloaded)
        if self.board.now.step in ("starting", "fault"):
            guidance = before_contact("reference", self.mode)
            self.board.update(step="ready", state=PressState.IDLE, guidance=guidance, fault=None)
        if job := self._next_job(until_s=time.monotonic() + UNLOADED_VALID_S):
            self._measure(job, unloaded)
            self._used_s = time.monotonic()

    def _follow_zero(self, unloaded: list[Frame]) -> list[Frame]:
        """Let the cell's zero come to where it reads now; return the frames by it, or say by how much it is off."""
        try:
            unloaded = self._zero.saw(unloaded, self.bench.force)
            self._capture.count_from(unloaded)
            return unloaded
        finally:
            self.board.update(warnings=self._zero.warned(self.board.now.warnings))

    def _require_no_drift(self, unloaded: list[Frame]) -> None:
        """Compare the untouched face with the certificate's, under the light of then: the loop may have moved ours."""
        ratio = self.calibration.lit_ratio or self._capture.lit
        try:
            self.calibration.require_no_drift(self._capture.relit(unloaded, ratio))
        finally:
            self.board.update(warnings=self.calibration.warned(self.board.now.warnings))

    def _while_touched(self) -> None:
        """End a press that waits in vain for the probe to be lifted; forget a fault of the cell, which reads.

        A zero that is wrong is told by an untouched probe alone.
        """
        self._requests.give_up_waiting(self.config.press.timeout_s)
        fault = self.board.now.fault
        if isinstance(fault, LoadCellError) and not isinstance(fault, ZeroShiftError):
            self.board.update(step="starting", fault=None)

    def _next_job(self, until_s: float) -> PressJob | None:
        away = (self._capture.stopping, self._capture.called_away)
        while time.monotonic() < until_s and not any(event.is_set() for event in away):
            is_touched = self.bench.force.reaches(self.config.press.contact_n, timeout_s=LOOK_EVERY_S)
            if job := self._requests.begin(is_touched=is_touched):
                return job
            self.progress.beat()
            self._warn_of_watches()
            if time.monotonic() - self._used_s >= REST_AFTER_S:
                self.bench.rest()
        return None

    def _measure(self, job: PressJob, unloaded: list[Frame]) -> None:
        started_at = self._clock.now()
        self.bench.budget.begin_press()
        self._capture.clear()
        self.board.update(scan=None)
        try:
            self.bench.budget.require_for_press(FRAMES[job.mode].most_ramps)
            beside = [*unloaded, *self._frames_beside(job)]
            self._answers.look_ahead(beside, job.mode, started_at)
            frames, scan = self._frames_on_lesion(job, beside, started_at)
            with self._requests.deciding:  # whoever has cancelled until here was in time
                if self._capture.cancelled.is_set():
                    raise PressEnded("cancelled", CANCELLED)
                self._book.note(job, state="computing", progress=0.9)
            answer = self._answers.answer([*beside, *frames], job, started_at, self.board.now.warnings, scan)
            self.board.update(answer=answer.shown)  # the operator need not wait for the disk
            answered_s = time.monotonic() - frames[-1].t_s - (scan.idle_s if scan else 0.0)
            self._keep(answer, job)
        except PressEnded as end:
            self._reject(job, end.state, end.reason)
        except (LightRestError, NoContrastError) as error:
            self._reject(job, "rejected", str(error), error.code)
        except InvalidQuantity as error:
            self._reject(job, "rejected", str(error))
        else:
            self._answer_times.note(job.mode, answered_s)
            if scan and scan.fault:
                raise scan.fault
        finally:
            self._capture.forget_frames()
            if self.board.now.answer:  # it could not be kept
                self.board.update(answer=None)

    @property
    def is_clock_steady(self) -> bool:
        """Whether ages by the wall clock are believed; may be asked from any thread."""
        return self._clock.is_steady

    def _keep(self, answer: PressAnswer, job: PressJob) -> None:
        """Keep a measurement and that its press has ended with it, both or none, and then show them.

        Nobody reads that it has ended before the screen shows the result.
        """
        identifier = answer.measurement_id
        done = self._book.changed(job, state="done", progress=1.0, measurement_id=identifier)

        def show() -> None:
            self._capture.done()
            self.board.update(step="result", guidance=Guidance.DONE, press=done, measurement_id=identifier, answer=None)

        self._answers.keep(answer, done, show)

    def _frames_beside(self, job: PressJob) -> list[Frame]:
        """Lead the hand through the press beside the lesion; return its frames once the probe is lifted."""
        self._book.note(job, state="capturing", progress=0.1)
        self.board.update(step="reference", measurement_id=None)
        reference = self._capture.loaded("reference", job.mode)
        self._warn_of_watches()
        levels = self._capture.side_levels(reference)
        self._book.warn(self._dimming.warning(levels))
        self._book.warn(self._brightness.saw(levels))
        self._capture.release()
        self.board.update(guidance=Guidance.LIFT)
        self._capture.lifted()
        return reference

    def _frames_on_lesion(
        self, job: PressJob, beside: list[Frame], started_at: str
    ) -> tuple[list[Frame], ScanTaken | None]:
        """Lead the hand through the press on the lesion, or all of a scan; return the frames, and what a scan took."""
        self._book.note(job, state="capturing", progress=0.5)
        self.board.update(step="lesion")
        if FRAMES[job.mode].is_scan:
            scan = self._scan(job, beside, started_at).lead()
            frames = scan.frames
        else:
            scan, frames = None, self._capture.loaded("press", job.mode)
            self._capture.release()
        self._darken()
        self.board.update(step="computing", guidance=Guidance.LIFT)
        self._book.warn(self._clock.warning())
        self._warn_of_watches()
        return frames, scan

    def _scan(self, job: PressJob, beside: list[Frame], started_at: str) -> Scan:
        def note(ramps: int) -> None:
            progress = 0.5 + 0.4 * ramps / FRAMES[job.mode].most_ramps
            self._book.note(job, state="capturing", progress=round(progress, 2), ramps=ramps)

        return Scan(
            job,
            self._capture,
            self.board,
            advise=lambda frames: self._answers.advise([*beside, *frames], started_at),
            darken=self._darken,
            note=note,
        )

    def _warn_of_watches(self) -> None:
        """Show what the watches have seen since the last time; what is shown already is not logged again."""
        if self._computer:
            self.board.update(warnings=self._computer.warned(self.board.now.warnings))
        shown = [one.as_record() for one in self.board.now.warnings]
        for warning in (*(self._computer.taken() if self._computer else ()), *self._recordings.taken()):
            if warning.as_record() not in shown:
                self._book.warn(warning)

    def _reject(self, job: PressJob, state: str, reason: str, code: str | None = None) -> None:
        self._capture.end(reason)
        self.board.update(step="rejected", guidance=Guidance.REJECTED)
        self._book.note(job, state=state, reason=reason, code=code)

    def _look_at_disk(self) -> None:
        with self.progress.inside("storage"):
            warnings = self._backups.warned(self._space.warned(self.board.now.warnings))
            if warnings != self.board.now.warnings:
                self.board.update(warnings=warnings)
            self.store.require_space(self.config.store.min_free_mb)

    def _prove_store(self) -> None:
        """See that the store can be read, and now and then between presses that it can be written."""
        self._look_at_disk()
        press = self.board.now.press
        is_idle = press is None or press.state in ENDED
        is_due = time.monotonic() - self._written_s >= WRITE_EVERY_S
        with self.progress.inside("storage"):
            self.store.prove(writing=is_idle and is_due)
        if is_idle and is_due:
            self._written_s = time.monotonic()

    def _at_fault(self, error: DeviceError) -> None:
        self._capture.end(str(error), "failed")
        # The fault first: whoever is told that the press has ended finds out why.
        self.board.update(step="fault", guidance=Guidance.FAULT, fault=error)
        self._book.fail(self._requests.withdraw(), error)
        self._darken()
        self._capture.stopping.wait(AFTER_FAULT_S)

    def _darken(self) -> None:
        """Switch the light off; when that fails nothing is lost by it, and the next round raises the fault."""
        try:
            self.bench.light(DARK)
        except LightError as error:
            log.error("%s %s", error.code, error)
