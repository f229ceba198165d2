"""What every certificate holds, with lines or without: its age, what the untouched probe showed, which sources ran.

Each later start is compared with the untouched probe, dark and lit. Beside the version, which many states of the
sources share, a certificate names one hash of those that run.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np

from device.measurement.calibration import moment, written
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.flat_field_error import flat_field_error
from device.measurement.recording.recording import Recording
from device.measurement.recording.tactile_image import Frame
from device.measurement.recording.untouched_face import UntouchedFace, lit_counts, mean_led_ratio, side_levels, split

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("device", "host_tools")
UNTOUCHED_RATIO = 0.05
"""Reference frames at less than this part of the largest force are of the untouched probe."""
PRESSED_RATIO = 0.4
"""Frames from this part of the largest force on tell the flat field: below it a cell's light grows in another way."""


def oldest_at(recordings: Sequence[Recording]) -> str:
    """Return when the first of the recordings was made (RFC 3339): a calibration is as old as its oldest phantom."""
    return written(min(moment(one.started_at, f"started_at of {one.id}") for one in recordings))


def source_sha256() -> str:
    """Return the hash over names and contents of all Python files of both packages, in the order of their names."""
    digest = hashlib.sha256()
    for path in sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        digest.update(f"{path.relative_to(ROOT).as_posix()}\0".encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def untouched_face(recordings: Sequence[Recording]) -> UntouchedFace:
    """Return what the untouched probe showed: the mean over recordings, and how much a frame's level scatters.

    Light is a sum over the LEDs, each in proportion to its brightness: so the mean of frames of different brightness is
    that of the mean brightness, but scatters more.
    Raises `InvalidQuantity` when a recording has no dark, no unloaded lit or no pressed reference frames.
    """
    dark_counts, side_counts, pressed_counts = [], [], []
    untouched: list[Frame] = []
    for recording in recordings:
        dark, unloaded, pressed = frames_beside(recording)
        without = side_levels(dark).mean(axis=0)
        dark_counts.append(float(without.mean()))
        side_counts.append(lit_counts(unloaded, without))
        pressed_counts.append(float(lit_counts(pressed, without).mean()))
        untouched += unloaded
    levels, led_ratio = np.concatenate(side_counts), mean_led_ratio(untouched)
    return UntouchedFace(
        dark_counts=round(float(np.mean(dark_counts)), 4),
        side_counts=tuple(round(float(level), 4) for level in levels.mean(axis=0)),
        spread_counts=round(float(levels.std(axis=0, ddof=1).max()), 4),
        pressed_counts=round(float(np.mean(pressed_counts)), 4),
        led_ratio=led_ratio[0] if len(set(led_ratio)) == 1 else led_ratio,
    )


class FramesBeside(NamedTuple):
    """Frames of a recording without an inclusion: dark ones, lit ones of the untouched probe, and pressed ones."""

    dark: list[Frame]
    unloaded: list[Frame]
    pressed: list[Frame]


def frames_beside(recording: Recording) -> FramesBeside:
    """Return the frames that were taken beside the inclusion; raise `InvalidQuantity` without dark or unloaded ones."""
    unloaded, pressed = lit_beside(recording)
    return FramesBeside(*split([*recording.with_role("dark"), *unloaded]), pressed)


def lit_beside(recording: Recording) -> tuple[list[Frame], list[Frame]]:
    """Return the lit reference frames of the untouched probe and those that press, by their forces; either may lack."""
    lit = [frame for frame in recording.with_role("reference") if any(frame.led_ratio)]
    highest_n = max((frame.force_n for frame in lit), default=0.0)
    unloaded = [frame for frame in lit if frame.force_n <= UNTOUCHED_RATIO * highest_n]
    return unloaded, [frame for frame in lit if frame.force_n > UNTOUCHED_RATIO * highest_n]


def flat_field_ratio(of_blocks: Sequence[Recording]) -> float | None:
    """Return by how much the light of two presses on one bare block differs smoothly, the root mean square over blocks.

    None where no block tells it, as one that was pressed too shortly. It holds what differs between two places of a
    skin, too.
    """
    levels = []
    for recording in of_blocks:
        dark, _, beside = frames_beside(recording)
        press = [frame for frame in recording.with_role("press") if frame.ramp == 0]
        first, second = (_well_pressed(frames) for frames in (beside, press))
        with suppress(InvalidQuantity):
            levels.append(flat_field_error(first, second, dark[0].counts, recording.camera.scale).level_ratio)
    return round(float(np.sqrt(np.mean(np.square(levels)))), 6) if levels else None


def _well_pressed(frames: Sequence[Frame]) -> list[Frame]:
    largest_n = max((frame.force_n for frame in frames), default=0.0)
    return [frame for frame in frames if frame.force_n >= PRESSED_RATIO * largest_n]
