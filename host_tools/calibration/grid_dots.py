"""An image of a grid target to its dots: where each is seen, and which of the grid it is.

The image is taken over that of a blank plate: light falls by ten times towards the rim, in a step where that of an LED
begins, which would move dots by 0.06 mm. OpenCV's blob detector finds the dots; each is then placed by the centroid of
its darkness over a plane through its surroundings. The dot in the middle is the largest.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.frame_light import TOUCHED_N
from device.measurement.recording.recording import Recording
from device.measurement.recording.tactile_image import Frame, Image, saturated_ratio

AGAIN = "record the grid again: cap home on the face, oil between, all LEDs alike"
LEAST_DOTS = 30
LEAST_COUNTS = 8.0
"""Light of the blank plate above dark, of 8 bits, below which a dot is noise."""
MOST_SATURATED = 0.01
LARGER = 1.25
"""How much wider than the others the middle dot is at least."""
PITCH_OFF = 0.1
"""A grid whose dots stand farther from the pitch than so much of it has another pitch."""
NEAR = 0.25
"""Of the pitch: so near to where its neighbour says is a dot the next one."""
LEAST_REACHED = 0.8
"""Share of the dots that must belong to one grid."""
WINDOW, RIM = 0.5, 0.38
"""Of the pitch: radius about a dot that is looked at, and from where on it is background."""
ROUNDS = 3
FOUR_SIDES = ((1, 0), (0, 1), (-1, 0), (0, -1))


@dataclass(frozen=True, eq=False)
class SeenGrid:
    """Dots of one image: places [n, 2] in mm of the stated pixel size from its middle, x then y, and numbers [n, 2].

    The middle dot has the number (0, 0); along which of the four sides the first number counts, the image cannot tell.
    """

    image_mm: Array
    number: NDArray[np.int_]


def seen_grid(recording: Recording, pitch_mm: float) -> SeenGrid:
    """Return the grid in a recording's press frames; raise `InvalidQuantity` for what is none of this pitch."""
    light = printed_light(recording)
    scale = np.array([recording.camera.mm_per_px_x, recording.camera.mm_per_px_y])
    places_px, width_px = _blobs(light, pitch_mm / scale)
    _require_dots(len(places_px))
    middle = _middle(width_px)
    _require_pitch(scale * places_px, pitch_mm)
    placed = [_placed(light, place, pitch_mm, scale) for place in places_px]
    kept = [place for place in placed if place is not None]
    if placed[middle] is None:
        raise InvalidQuantity("middle dot of the grid", "at the edge of the light", "whole in the image", AGAIN)
    _require_dots(len(kept))
    at_mm = scale * (np.array(kept) - (np.array(light.shape[::-1]) - 1) / 2)
    begin = sum(place is not None for place in placed[:middle])
    numbers = _numbered(at_mm, begin, pitch_mm)
    if len(numbers) < LEAST_REACHED * len(kept):
        found = f"{len(numbers)} of {len(kept)}"
        raise InvalidQuantity("dots on one square grid", found, f"{LEAST_REACHED:.0%} of them at least", AGAIN)
    _require_dots(len(numbers))
    order = sorted(numbers)
    return SeenGrid(at_mm[order], np.array([numbers[i] for i in order]))


def printed_light(recording: Recording) -> Image:
    """Return the light of the press frames over that of the reference frames, a blank plate; NaN where that is dark.

    Raises `InvalidQuantity` for frames that are missing or tell no light.
    """
    means = {}
    for role, shows in (("dark", "no light"), ("reference", "a blank plate"), ("press", "the grid")):
        frames = _blank_frames(recording) if role == "reference" else recording.with_role(role)
        if not frames:
            action = "record the blank plate as the press beside the lesion, and the grid as that on it"
            if role == "reference":
                shows += (
                    f" and is pressed by more than {TOUCHED_N:g} N as the grid is, or is lit where no force is told"
                )
            raise InvalidQuantity(f"{role} frames", 0, f"at least one, which shows {shows}", action)
        saturated = max(saturated_ratio(frame.counts) for frame in frames)
        if saturated > MOST_SATURATED:
            bound, action = f"at most {MOST_SATURATED:.0%}", "lower camera.exposure_us while the grid is recorded"
            raise InvalidQuantity(f"saturated pixels of {role} frames", f"{saturated:.1%}", bound, action)
        means[role] = np.mean([frame.counts for frame in frames], axis=0, dtype=np.float32)
    blank, lit = means["reference"] - means["dark"], means["press"] - means["dark"]
    least = np.float32(LEAST_COUNTS * (1 if recording.camera.bits == 8 else 256))
    return np.divide(lit, blank, out=np.full_like(blank, np.nan), where=blank >= least)


def _blank_frames(recording: Recording) -> list[Frame]:
    """Return the reference frames that show the blank plate; those of the untouched face, for drift, are told by force.

    A cap round the face takes an outside cell's force away, from plate and grid alike: then all that are lit show it.
    Where the grid was pressed and nothing else, they are of the untouched face, and there is no plate.
    """
    frames = recording.with_role("reference")
    touched = [one for one in frames if one.force_n > TOUCHED_N]
    if touched or any(one.force_n > TOUCHED_N for one in recording.with_role("press")):
        return touched
    return [one for one in frames if any(one.led_ratio)]


def _blobs(light: Image, pitch_px: Array) -> tuple[Array, Array]:
    """Return centres [n, 2] in pixels and widths [n] of the dark blobs of a grid's size."""
    lit = np.isfinite(light)
    white = np.quantile(light[lit], 0.9) if lit.any() else 1.0
    settings = cv2.SimpleBlobDetector.Params()
    area_px = float(np.prod(pitch_px))
    settings.minArea, settings.maxArea = 0.02 * area_px, 0.6 * area_px
    settings.minThreshold, settings.maxThreshold, settings.thresholdStep = 40, 220, 10
    settings.minDistBetweenBlobs = 0.4 * float(pitch_px.min())
    settings.filterByInertia, settings.minConvexity = False, 0.8
    shown = np.clip(220 * np.where(lit, light, white) / white, 0, 255).astype(np.uint8)
    found = cv2.SimpleBlobDetector.create(settings).detect(shown)
    return np.array([one.pt for one in found]).reshape(-1, 2), np.array([one.size for one in found])


def _require_dots(count: int) -> None:
    if count < LEAST_DOTS:
        action = "use a finer grid, or " + AGAIN
        raise InvalidQuantity("dots of the grid", count, f"at least {LEAST_DOTS}", action)


def _middle(width_px: Array) -> int:
    """Return which blob is the middle dot: the only one that is larger than the others."""
    larger = np.flatnonzero(width_px > LARGER * np.median(width_px))
    if len(larger) != 1:
        bound = f"one dot, {LARGER:g} times as wide as the others"
        raise InvalidQuantity("middle dot of the grid", f"{len(larger)} larger dots", bound, AGAIN)
    return int(larger[0])


def _require_pitch(at_mm: Array, pitch_mm: float) -> None:
    apart = np.hypot(*(at_mm[:, None] - at_mm[None]).transpose(2, 0, 1)) + 1e9 * np.eye(len(at_mm))
    nearest_mm = float(np.median(apart.min(axis=1)))
    if abs(nearest_mm / pitch_mm - 1) > PITCH_OFF:
        bound = f"within {PITCH_OFF:.0%} of the pitch of {pitch_mm:g} mm"
        action = "name the pitch that is printed with --pitch-mm, or correct the pixel size"
        raise InvalidQuantity("distance of the grid's dots", f"{nearest_mm:.3f} mm", bound, action)


def _placed(light: Image, at_px: Array, pitch_mm: float, scale: Array) -> Array | None:
    """Return where a dot's darkness has its centroid (pixels), None for one whose surroundings are not all lit."""
    for _ in range(ROUNDS):
        low = np.floor(at_px - WINDOW * pitch_mm / scale).astype(int)
        high = np.ceil(at_px + WINDOW * pitch_mm / scale).astype(int) + 1
        if (low < 0).any() or (high > light.shape[::-1]).any():
            return None
        rows, columns = np.mgrid[low[1] : high[1], low[0] : high[0]]
        x_mm, y_mm = scale[0] * (columns - at_px[0]), scale[1] * (rows - at_px[1])
        within = np.hypot(x_mm, y_mm) <= WINDOW * pitch_mm
        x, y, seen = x_mm[within], y_mm[within], light[low[1] : high[1], low[0] : high[0]][within]
        around = np.hypot(x, y) >= RIM * pitch_mm
        if not np.isfinite(seen).all():
            return None
        terms = np.stack([np.ones_like(x), x, y], axis=1)
        background = terms @ np.linalg.lstsq(terms[around], seen[around], rcond=None)[0]
        darkness = np.where(around, 0.0, background - seen)
        at_px = at_px + np.array([darkness @ x, darkness @ y]) / darkness.sum() / scale
    return at_px


def _numbered(at_mm: Array, middle: int, pitch_mm: float) -> dict[int, tuple[int, int]]:
    """Return the number of each dot that is reached from the middle one, from neighbour to neighbour."""
    numbers, steps = {middle: (0, 0)}, {middle: _first_steps(at_mm, middle, pitch_mm)}
    waiting = deque([middle])
    while waiting:
        dot = waiting.popleft()
        for neighbour, side in _neighbours(at_mm, dot, steps[dot], pitch_mm):
            if neighbour not in numbers:
                column, row = numbers[dot]
                numbers[neighbour] = column + side[0], row + side[1]
                steps[neighbour] = _turned_to(steps[dot], side, at_mm[neighbour] - at_mm[dot])
                waiting.append(neighbour)
    return numbers


def _first_steps(at_mm: Array, middle: int, pitch_mm: float) -> Array:
    """Return the two steps [2, 2] of the grid at its middle, the first the nearest to the image's rows."""
    from_middle = at_mm - at_mm[middle]
    near = np.abs(np.hypot(*from_middle.T) / pitch_mm - 1) < NEAR
    fourfold = np.exp(4j * np.arctan2(from_middle[near, 1], from_middle[near, 0]))
    turn = float(np.angle(fourfold.sum())) / 4 if near.any() else 0.0
    along = pitch_mm * np.array([np.cos(turn), np.sin(turn)])
    return np.array([along, [-along[1], along[0]]])


def _neighbours(at_mm: Array, dot: int, steps: Array, pitch_mm: float) -> Iterator[tuple[int, tuple[int, int]]]:
    for side in FOUR_SIDES:
        from_there = np.hypot(*(at_mm - at_mm[dot] - np.array(side) @ steps).T)
        nearest = int(np.argmin(from_there))
        if from_there[nearest] < NEAR * pitch_mm:
            yield nearest, side


def _turned_to(steps: Array, side: tuple[int, int], seen: Array) -> Array:
    """Return the steps with the one along a side replaced by what was seen there."""
    changed = steps.copy()
    changed[0 if side[0] else 1] = seen * (side[0] or side[1])
    return changed
