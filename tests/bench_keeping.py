"""What lies between the last frame of a press and its answer besides the estimate: encode, write, draw, serve.

The processor's time, and the wall's where a disk is waited for: the folder is made beside this file, on the disk of the
source tree. "A folder" is how a recording was kept before: every frame encoded after the last one, in a file of its
own. Presses are recorded ones of the simulated probe.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import replace
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

from bench_table import PROCESSOR, WALL, Figure, timed
from bench_work import MODELS, PRESS

from device.files.recording_file import write_recording
from device.instrument.press.encoded_frames import EncodedFrames
from device.instrument.press.picture import tactile_png
from device.measurement.mode import Mode
from device.measurement.recording.recording import Recording
from device.records.store import Store
from device.simulation.virtual_probe import ProbeTables
from device.web.kept_files import KeptFiles
from host_tools.press_models.recorded_presses import recorded_press

CHAPTER = "keeping a press, and showing it again"
KEPT_BOUNDS: dict[Mode, float] = {"quick": 60.0, "standard": 80.0, "precise": 80.0}
DRAWN_BOUNDS: dict[Mode, float] = {"quick": 60.0, "standard": 80.0, "precise": 80.0}
SERVED_BOUND = 20.0
"""In yardsticks: 15 to 20 ms, and 5 ms, where that takes 0.25."""
REPEATS = 7
CLOCKS = {"processor": PROCESSOR, "wall": WALL}


class Press:
    """One press in a store of its own, below a folder that is there."""

    def __init__(self, recording: Recording, folder: Path) -> None:
        self.recording, self._folder, self._numbers = recording, folder, count()
        self._store, self._encoded = Store(folder / "var"), EncodedFrames()
        self._serving, self._picture = KeptFiles(self._store), tactile_png(recording)
        self._last = max(recording.frames, key=lambda frame: frame.t_s)
        self._encoded.follow(recording.frames)
        for frame in recording.frames:
            if frame is not self._last:
                self._encoded.png_of(frame)

    def keep(self) -> None:
        """Encode the last frame, all others being encoded; bring recording, picture and row to the disk."""
        number = next(self._numbers)
        self._encoded.follow([frame for frame in self.recording.frames if frame is not self._last], are_all=True)
        self._encoded.follow(self.recording.frames, are_all=True)
        record = {"id": f"m-{number}", "recording_id": f"r-{number}"}
        recording = replace(self.recording, id=record["recording_id"])
        self._store.add_measurement(record, recording, encode=self._encoded.png_of, picture=self._picture)

    def keep_as_before(self) -> None:
        """Encode every frame and bring each to the disk as a file of its own."""
        write_recording(self.recording, self._folder / f"folder-{next(self._numbers)}")

    def draw(self) -> None:
        """Make the picture."""
        tactile_png(self.recording)

    def serve(self) -> None:
        """Answer GET image.png."""
        asyncio.run(self._serving.picture("m-0"))

    def close(self) -> None:
        """Let go of the thread and the store."""
        self._encoded.close()
        self._store.close()


def figures() -> Iterator[Figure]:
    """Yield for each mode what keeping a press takes, now and as a folder, and its picture."""
    tables = ProbeTables.load(MODELS / "simulated_probe")
    for mode in KEPT_BOUNDS:
        with TemporaryDirectory(dir=Path(__file__).parent, prefix=".bench-") as folder:
            press = Press(recorded_press(tables, PRESS, mode, seed=3), Path(folder))
            try:
                yield from _figures_of(mode, press)
            finally:
                press.close()


def _figures_of(mode: Mode, press: Press) -> Iterator[Figure]:
    for clock_name, clock in CLOCKS.items():
        bound = KEPT_BOUNDS[mode] if clock is PROCESSOR else None
        name = f"{mode}: keep as one .zip, {clock_name}"
        kept = timed(CHAPTER, name, press.keep, bound, clock, REPEATS)
        name = f"{mode}: keep as a folder, {clock_name}"
        folder = timed(CHAPTER, name, press.keep_as_before, None, clock, REPEATS)
        yield from (kept, folder)
    yield timed(CHAPTER, f"{mode}: draw the picture", press.draw, DRAWN_BOUNDS[mode], repeats=REPEATS)
    yield timed(CHAPTER, f"{mode}: answer with the picture", press.serve, SERVED_BOUND, repeats=REPEATS)
