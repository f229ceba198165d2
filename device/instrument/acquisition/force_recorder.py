"""The load cell's stream to force over time: newtons on the one clock, interpolated to when a frame was exposed.

One thread owns the serial line. It first takes the tare, again and again while that fails, as when the probe is held or
its cell unplugged. A silent, unplugged or overloaded cell is a fault that is kept until samples come that it can bear.
What is kept are counts: they become newtons when they are asked for, by the tare of then. A frame asks four times, so
they lie in arrays, sorted by time.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from device.errors import LoadCellError, OverloadedCellError
from device.hardware.interfaces import CellCounts, CellSample, ForceScale, LoadCell, Newtons
from device.instrument.acquisition.load_limit import LoadLimit
from device.instrument.watch.progress import ProgressBoard

KEPT_SAMPLES = 1000
FIRST_SAMPLE_S = 5.0
"""Opening the port resets an OpenScale: its banner may last three seconds."""
SILENCE_S = 1.0
REST_PAUSE_S = 0.06
"""While nobody presses, five samples of 80 Hz are taken at a time; waking the thread for each is most of its work."""
RETRY_S = 0.2
FEWEST_IN_WINDOW = 3
"""Fewer samples leave nothing of a straight line, and of a trembling hand they may see no difference."""

Zero = tuple[ForceScale, LoadLimit]
TareOf = Callable[[Callable[[], CellSample]], Zero]
"""Readings of the cell, one a call, to the scale of this start and the load from the zero of commissioning."""


def force_range_n(times_s: NDArray[np.float64], forces_n: NDArray[np.float64], *, around_line: bool) -> Newtons:
    """Return by how much one or more forces (N) vary, or what a straight line over their times (s) leaves of it."""
    if not around_line:
        return Newtons(float(np.ptp(forces_n)))
    centred = times_s - times_s.mean()
    slope = float(centred @ forces_n) / max(float(centred @ centred), 1e-12)
    return Newtons(float(np.ptp(forces_n - slope * centred)))


class SampleRing:
    """The last `KEPT_SAMPLES` samples, as views that hold until the next one: `times_s` (never falling) and `counts`.

    They lie side by side in arrays twice as long, whose end is moved to the front when it is full.
    """

    def __init__(self) -> None:
        self._both = np.empty((2, 2 * KEPT_SAMPLES))
        self._end = 0

    def __len__(self) -> int:
        return min(self._end, KEPT_SAMPLES)

    def append(self, sample: CellSample) -> None:
        """Add a sample, in place of the oldest when there are too many."""
        if self._end == self._both.shape[1]:
            self._both[:, :KEPT_SAMPLES] = self._both[:, -KEPT_SAMPLES:]
            self._end = KEPT_SAMPLES
        self._both[:, self._end] = sample.t_s, sample.counts
        self._end += 1

    @property
    def newest(self) -> CellSample:
        """The last sample; raises `IndexError` when there is none."""
        if not self._end:
            raise IndexError("no sample")
        t_s, counts = self._both[:, self._end - 1].tolist()
        return CellSample(t_s, CellCounts(counts))

    @property
    def times_s(self) -> NDArray[np.float64]:
        """When each was measured (s)."""
        return self._both[0, self._end - len(self) : self._end]

    @property
    def counts(self) -> NDArray[np.float64]:
        """What each was, of the cell's own scale."""
        return self._both[1, self._end - len(self) : self._end]

    def at(self, t_s: float) -> CellCounts:
        """Return the counts at a time between the first and the last sample, on the line between its two neighbours."""
        times_s, counts = self.times_s, self.counts
        after = int(np.searchsorted(times_s, t_s, side="right"))
        two = slice(max(after - 1, 0), after + 1)
        return CellCounts(float(np.interp(t_s, times_s[two], counts[two])))


class ForceRecorder:
    """Force history of the last seconds."""

    def __init__(self, cell: LoadCell, tare: TareOf, progress: ProgressBoard | None = None) -> None:
        """Start to tare and record; when this returns there is a sample, or a `fault` that says why there is none yet.

        `tare` raises the `LoadCellError` that forbids it; then it is asked again.
        """
        self._cell, self._tare = cell, tare
        self._zero: Zero | None = None
        self._timeout_s = FIRST_SAMPLE_S
        self._samples = SampleRing()
        self._news, self._stopping = threading.Condition(), threading.Event()
        self._has_reached, self._awaited_n = threading.Event(), math.inf
        self.fault: LoadCellError | None = None
        self._progress = progress or ProgressBoard()
        self._thread = threading.Thread(target=self._run, name="force", daemon=True)
        self._thread.start()
        with self._news:
            if not self._news.wait_for(lambda: self._samples or self.fault, timeout=2 * FIRST_SAMPLE_S):
                self.fault = LoadCellError("The load cell gives no samples.", "Check its cable and its power.")

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                self._zero = self._zero or self._tare(self._read)
                _, limit = self._zero
                self._record(limit)
            except OverloadedCellError as error:
                self._fail(error)  # and the next sample at once: those behind it must not grow old
            except LoadCellError as error:
                self._fail(error)
                self._stopping.wait(RETRY_S)

    def _read(self) -> CellSample:
        """Return the next sample; a tare that needs many of them ends with the recorder."""
        if self._stopping.is_set():
            raise LoadCellError("The load cell is read no more.", "Start the daemon again.")
        timeout_s, self._timeout_s = self._timeout_s, SILENCE_S
        with self._progress.inside("force"):
            return self._cell.read(timeout_s=timeout_s)

    def _record(self, limit: LoadLimit) -> None:
        sample = self._read()
        limit.require_bearable(sample.counts)
        with self._news:
            self._samples.append(sample)
            self.fault = None
            self._news.notify_all()
        if self._newtons(sample.counts) >= self._awaited_n:
            self._has_reached.set()

    def _fail(self, error: LoadCellError) -> None:
        with self._news:
            self.fault = error
            self._news.notify_all()
        self._has_reached.set()

    def retare(self) -> Newtons:
        """Take the tare anew, of samples from now on; return by how much (N) the zero has moved.

        Raises the `LoadCellError` that forbids it, or that the cell is at fault by: then the zero is what it was. How
        far it may go counts from that of commissioning, without which the first tare of this start stands in.
        """
        with self._news:
            if self.fault:
                raise self.fault
            before, limit = self._tared()
            last = self._samples.newest

            def following() -> CellSample:
                nonlocal last
                last = self._after(last.t_s)
                return last

            scale, _ = self._tare(following)
            limit.require_tare(scale.tare_counts)
            self._zero = scale, limit
        return before.newtons(scale.tare_counts)

    def move_zero(self, read_n: Newtons) -> None:
        """Let what is read as a force (N) be zero from now on; raises `ZeroShiftError` where that is too far."""
        with self._news:
            scale, limit = self._tared()
            tare_counts = CellCounts(scale.tare_counts + read_n * scale.sensitivity_counts_per_n)
            limit.require_tare(tare_counts)
            self._zero = replace(scale, tare_counts=tare_counts), limit

    def _after(self, t_s: float) -> CellSample:
        """Return the first sample after a time, of several that came at once; raise what comes instead of one."""
        with self._news:
            if not self._news.wait_for(lambda: self._samples.newest.t_s > t_s or self.fault, SILENCE_S) or self.fault:
                raise self.fault or _no_sample(SILENCE_S)
            first = int(np.searchsorted(self._samples.times_s, t_s, side="right"))
            time_s, counts = float(self._samples.times_s[first]), float(self._samples.counts[first])
            return CellSample(time_s, CellCounts(counts))

    def _tared(self) -> Zero:
        if self._zero is None:
            raise self.fault or LoadCellError("The load cell is not tared.", "Lift the probe.")
        return self._zero

    def _newtons(self, counts: CellCounts) -> Newtons:
        scale, _ = self._tared()
        return scale.newtons(counts)

    def _forces_n(self, counts: NDArray[np.float64]) -> NDArray[np.float64]:
        scale, _ = self._tared()
        return (counts - scale.tare_counts) / scale.sensitivity_counts_per_n

    @property
    def latest_n(self) -> Newtons:
        """Return the newest force; raise `LoadCellError` when the cell is at fault."""
        with self._news:
            if self.fault:
                raise self.fault
            return self._newtons(self._samples.newest.counts)

    def reaches(self, force_n: float, *, timeout_s: float) -> bool:
        """Return whether the newest force is at least so large (N), or becomes so within a time (s).

        Returns with the sample that says so; raises as `latest_n` does. For one thread alone, which no other sample
        wakes.
        """
        self._has_reached.clear()
        self._awaited_n = force_n
        if self.latest_n < force_n:
            self._has_reached.wait(timeout_s)
        self._awaited_n = math.inf
        return self.latest_n >= force_n

    def take_time(self) -> None:
        """Let samples gather until the force at a time is asked for: a touch is seen by so much later."""
        self._cell.pause_s = REST_PAUSE_S

    def at(self, t_s: float, *, timeout_s: float = SILENCE_S) -> Newtons:
        """Return the force at a time on the monotonic clock, waiting until a later sample has come.

        Raises `LoadCellError` when none comes, or when the history does not reach back so far.
        """
        self._cell.pause_s = 0.0
        deadline_s = time.monotonic() + timeout_s
        with self._news:
            while not self._samples or self._samples.newest.t_s < t_s:
                if not self._news.wait(max(0.0, deadline_s - time.monotonic())) and time.monotonic() >= deadline_s:
                    raise self.fault or _no_sample(timeout_s)
            first_s = float(self._samples.times_s[0])
            if t_s >= first_s:
                return self._newtons(self._samples.at(t_s))
        raise LoadCellError(f"No force is known {first_s - t_s:.3f} s before the first sample.", "Press again.")

    def mean_n(self, *, window_s: float) -> Newtons:
        """Return the mean force of the last seconds, as far as they are known; raises as `latest_n` does."""
        newest_n, now_s = self.latest_n, time.monotonic()
        with self._news:
            times_s = self._samples.times_s
            inside = self._samples.counts[np.searchsorted(times_s, now_s - window_s) :]
            return self._newtons(CellCounts(float(inside.mean()))) if len(inside) else newest_n

    @property
    def zero_shift_n(self) -> Newtons:
        """Return how far the tare of now is from that of commissioning; raises the fault until it is taken."""
        scale, limit = self._tared()
        return limit.commissioned.newtons(scale.tare_counts)

    def range_n(self, t_s: float, *, window_s: float, around_line: bool = False) -> Newtons:
        """Return by how much the force varied in a window that ends at a time, or around a straight line through it.

        Infinite where too few samples say nothing of it.
        """
        with self._news:
            times_s, counts = self._samples.times_s, self._samples.counts
            inside = slice(np.searchsorted(times_s, t_s - window_s), np.searchsorted(times_s, t_s, side="right"))
            times_s, forces_n = times_s[inside] - t_s, self._forces_n(counts[inside])
        if len(times_s) < FEWEST_IN_WINDOW:
            return Newtons(float("inf"))
        return force_range_n(times_s, forces_n, around_line=around_line)

    def peak_n(self, since_s: float, t_s: float) -> Newtons:
        """Return the largest force of the samples after one time and until another, and of that time itself.

        Waits for a later sample and raises `LoadCellError` as `at` does.
        """
        at_the_end = self.at(t_s)
        with self._news:
            first, last = np.searchsorted(self._samples.times_s, (since_s, t_s), side="right")
            forces_n = self._forces_n(self._samples.counts[first:last])
        return Newtons(max(at_the_end, float(np.max(forces_n, initial=-np.inf))))

    def close(self) -> None:
        """Stop the thread and release the cell."""
        self._stopping.set()
        self._thread.join(timeout=2 * SILENCE_S)
        self._cell.close()


def _no_sample(waited_s: float) -> LoadCellError:
    return LoadCellError(f"The load cell gave no sample for {waited_s:g} s.", "Check its cable and its power.")
