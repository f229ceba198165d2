"""The ramps of a press to their profiles, each read once: a scan's fifth ramp does not wait for four others.

What was read is remembered of the very frames that it was read of, and of those alone that were asked about last. The
frames themselves are not held. The numbers are those of `press_profiles`, to the last bit.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.radial_profile import (
    RadialProfile,
    ReadBeside,
    frames_of_ramps,
    read_beside,
)
from device.measurement.recording.led_sides import LedRatio
from device.measurement.recording.recording import CameraSettings, Recording
from device.measurement.recording.tactile_image import Counts, Frame, Role

Read = TypeVar("Read")
Told = tuple[Role, float, LedRatio]


@dataclass(frozen=True, eq=False)
class _Entry(Generic[Read]):
    """What was read of frames, which are told by their counts, as long as these live, and by all that matters else."""

    camera: CameraSettings
    counts: list[weakref.ref[Counts]]
    told: list[Told]
    read: Read

    def is_of(self, camera: CameraSettings, frames: Sequence[Frame]) -> bool:
        if camera != self.camera or _told(frames) != self.told:
            return False
        return all(counts() is frame.counts for counts, frame in zip(self.counts, frames, strict=True))


def _entry(
    known: Sequence[_Entry[Read]], camera: CameraSettings, frames: Sequence[Frame], read: Callable[[], Read]
) -> _Entry[Read]:
    """Return what is known of frames, or else what is read now."""
    found = next((entry for entry in known if entry.is_of(camera, frames)), None)
    return found or _Entry(camera, [weakref.ref(frame.counts) for frame in frames], _told(frames), read())


def _told(frames: Sequence[Frame]) -> list[Told]:
    return [(frame.role, frame.force_n, frame.led_ratio) for frame in frames]


class RememberedRamps:
    """A reader of ramps for one thread: that of the procedure, which presses one after the other."""

    def __init__(self) -> None:
        self._beside: list[_Entry[ReadBeside]] = []
        self._ramps: list[_Entry[RadialProfile]] = []

    def profiles(self, recording: Recording) -> list[RadialProfile]:
        """Return the profile of each ramp of a recording; raises as `press_profiles`."""
        before, beside = _beside(recording), self._read_beside(recording)

        def entry(frames: Sequence[Frame]) -> _Entry[RadialProfile]:
            return _entry(self._ramps, recording.camera, [*before, *frames], lambda: beside.profile_of(frames))

        self._ramps = [entry(frames) for frames in frames_of_ramps(recording)]
        return [entry.read for entry in self._ramps]

    def look_beside(self, recording: Recording) -> None:
        """Read dark and reference frames, before there is a press on the lesion; what cannot be read is told later."""
        try:
            self._read_beside(recording)
        except InvalidQuantity:
            return

    def _read_beside(self, recording: Recording) -> ReadBeside:
        self._beside = [_entry(self._beside, recording.camera, _beside(recording), lambda: read_beside(recording))]
        return self._beside[0].read


def _beside(recording: Recording) -> list[Frame]:
    return [frame for frame in recording.frames if frame.role != "press"]
