"""Dots of a grid target to the camera's geometry, with its covariance: least squares over all recordings at once.

Where the dots are on the face is known but for how the cap was put on: its turn is free in each recording, its place
has its play as prior. Distances from the grid are what is left; their root mean square is the noise of one dot, from
which the covariance follows. The printed pitch is known no better than its tolerance, and pixel sizes with it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from device.files.toml_record import InvalidRecord
from device.measurement.arrays import Array
from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.recording.camera_geometry import RIM_MM, CameraGeometry
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.recording import Recording
from host_tools.calibration.gates import given_again
from host_tools.calibration.grid_dots import SeenGrid, seen_grid
from host_tools.scenes.probe import Probe
from host_tools.scenes.stated import SIGMAS, SUFFIX

OF_A_CAMERA, OF_A_CAP = 5, 3
"""Unknowns of the camera (pixel sizes over the stated ones, axis, distortion) and of a cap (turn, and its middle)."""
MOST_LEFT_MM = 0.03
"""Root mean square distance of dots from the grid above which it is no grid, or no lens of one distortion."""
FIRST_NOISE_MM, LEAST_NOISE_MM = 0.003, 1e-4
LEAST_SIZE_RATIO, LEAST_DISTORTION = 3e-4, 1e-4
"""Deviations that no residual shows: blur moves dots outwards where light falls, alike in all recordings; by
`host_tools probe camera-trial`.
"""
LEAST_OFF = 0.03
"""By so much pixel sizes may differ from the stated ones however well these were known: a lens is refocused."""
MOST_PLAYS = 4.0
"""How far a cap may lie from the middle of all: in three of a thousand sets of four honest ones one lies farther."""
ACTION = "check that the grid is flat and printed true, and record it again"


@dataclass(frozen=True)
class GridPrint:
    """What is known of the printed grid: pitch and its tolerance, and the play of its cap, all in mm."""

    pitch_mm: float = 2.0
    pitch_mm_tolerance: float = 0.001
    play_mm: float = 0.02

    def __post_init__(self) -> None:
        action = "state what was printed and measured"
        require("pitch_mm", self.pitch_mm, Bound(0.5, 5.0, "mm"), action)
        most = Bound(0.0, 0.02 * self.pitch_mm, "mm, a fiftieth of the pitch", low_included=False)
        require("pitch_mm_tolerance", self.pitch_mm_tolerance, most, action)
        require("play_mm", self.play_mm, Bound(0.0, 1.0, "mm", low_included=False), action)


@dataclass(frozen=True, eq=False)
class FittedCamera:
    """A camera's geometry and one standard deviation of each of its numbers; how many dots, and what they leave.

    `caps_mm` [recordings, 2]: where each cap was, from the face's middle; 0 of a single one, which nothing tells.
    """

    geometry: CameraGeometry
    deviation: tuple[float, float, float, float, float]
    dots: int
    left_mm: float
    caps_mm: Array

    def as_probe_camera(self) -> dict[str, float]:
        """Return the keys of a probe's `[camera]` that this measures, each with its tolerance."""
        told: dict[str, float] = {}
        for name, value, deviation, unit in self.rows():
            key, ratio = ("distortion_ratio", 0.01) if unit == "%" else (name, 1.0)
            told |= {key: float(f"{ratio * value:.6g}"), key + SUFFIX: float(f"{ratio * deviation:.2g}")}
        return told

    def rows(self) -> list[tuple[str, float, float, str]]:
        """Return name, value, standard deviation and unit of each number."""
        scale, seen = self.geometry.scale, self.geometry
        numbers = (
            ("mm_per_px_x", scale.mm_per_px_x, "mm"),
            ("mm_per_px_y", scale.mm_per_px_y, "mm"),
            ("axis_x_mm", seen.axis_x_mm, "mm"),
            ("axis_y_mm", seen.axis_y_mm, "mm"),
            ("rim_distortion_percent", seen.rim_distortion_percent, "%"),
        )
        return [(name, value, sd, unit) for (name, value, unit), sd in zip(numbers, self.deviation, strict=True)]


def camera_of(recordings: Mapping[str, Recording], printed: GridPrint, probe: Probe | None = None) -> FittedCamera:
    """Return the camera that took recordings of the grid, by their names.

    A `probe` says whose camera it is, and how well its pixel sizes were known. Raises `InvalidRecord` with everything
    that keeps one from being found, each recording by its name.
    """
    problems, grids = list(_of_one_camera(recordings, probe)), []
    problems += given_again(list(recordings.values()), list(recordings))
    for name, recording in recordings.items():
        try:
            grids.append(seen_grid(recording, printed.pitch_mm))
        except InvalidQuantity as problem:
            problems.append(
                InvalidQuantity(f"{name}: {problem.quantity}", problem.value, problem.bound, problem.action)
            )
    if problems:
        raise InvalidRecord(problems)
    fitted = fit_camera(grids, next(iter(recordings.values())).camera.scale, printed)
    problems = [*_caps_aside(fitted, list(recordings), printed)]
    if problems := [*problems, *_unlike_stated(fitted, next(iter(recordings.values())), probe)]:
        raise InvalidRecord(problems)
    return fitted


def _of_one_camera(recordings: Mapping[str, Recording], probe: Probe | None) -> Iterator[InvalidQuantity]:
    """Yield what says that recordings are not of one camera, or not of the probe."""
    if not recordings:
        yield InvalidQuantity("recordings", 0, "at least one", "record the grid target")
        return
    first = next(iter(recordings.values()))
    serial = probe.serial if probe else first.serial
    for name, recording in recordings.items():
        if recording.serial != serial:
            action = "name the file and the recordings of one probe"
            yield InvalidQuantity(f"{name}: serial", recording.serial, f"{serial} as the others", action)
        if recording.camera != first.camera:
            yield InvalidQuantity(f"{name}: camera", "set otherwise", "as in the first recording", "record it again")
    size, frame = (
        (first.camera.width_px, first.camera.height_px),
        probe and (probe.camera.width_px, probe.camera.height_px),
    )
    if frame and size != frame:
        found, bound = ("{} x {} px".format(*one) for one in (size, frame))
        yield InvalidQuantity("frame of the recordings", found, f"{bound} as in the probe's file", "correct the file")


def _caps_aside(fitted: FittedCamera, names: Sequence[str], printed: GridPrint) -> Iterator[InvalidQuantity]:
    """Yield each cap farther from the middle of all than play explains: it moves the axis by far more than is stated.

    The middle is their median, which one cap that is not home, or one turned or shifted recording, does not move.
    """
    most_mm = MOST_PLAYS * printed.play_mm
    aside_mm = np.hypot(*(fitted.caps_mm - np.median(fitted.caps_mm, axis=0)).T)
    for name, distance_mm in zip(names, aside_mm, strict=True):
        if distance_mm > most_mm:
            found, bound = (
                f"{distance_mm:.2g} mm from the middle of all",
                f"within {most_mm:.2g} mm, {MOST_PLAYS:g} plays",
            )
            action = "put the cap home, record all in one orientation, or state --play-mm"
            yield InvalidQuantity(f"cap of {name}", found, bound, action)


def _unlike_stated(fitted: FittedCamera, recording: Recording, probe: Probe | None) -> Iterator[InvalidQuantity]:
    """Yield pixel sizes too far from what was stated of them: rather the pitch is another."""
    stated, camera = probe.scale if probe else recording.camera.scale, probe.camera if probe else None
    for name, size_mm, _, _ in fitted.rows()[:2]:
        stated_mm = getattr(stated, name)
        known = getattr(camera, name + SUFFIX) / stated_mm if camera else 0.0
        most = max(SIGMAS * known, LEAST_OFF)
        if abs(size_mm / stated_mm - 1) > most:
            bound = f"within {most:.1%} of the stated {stated_mm:g} mm"
            action = "name the pitch that is printed with --pitch-mm, or correct the stated size"
            yield InvalidQuantity(f"camera.{name}", f"{size_mm:.5g} mm", bound, action)


def fit_camera(grids: Sequence[SeenGrid], scale: PixelScale, printed: GridPrint) -> FittedCamera:
    """Return the geometry of the camera that took the grids, whose places are by a stated pixel size.

    Raises `InvalidQuantity` for dots that no such camera sees there, or a geometry out of bounds.
    """
    start = np.concatenate([[1, 1, 0, 0, 0], *([_turn_of(grid), 0, 0] for grid in grids)])
    noise_mm = FIRST_NOISE_MM
    for _ in range(2):
        found = least_squares(_misfit, start, x_scale="jac", args=(grids, printed, noise_mm))
        start = found.x
        left_mm, noise_mm = _left_mm(found, grids, noise_mm)
    require("root mean square distance of dots from the grid", left_mm, Bound(0.0, MOST_LEFT_MM, "mm"), ACTION)
    last = least_squares(_misfit, start, x_scale="jac", args=(grids, printed, noise_mm))
    x, y, axis_x_mm, axis_y_mm, distortion = map(float, last.x[:OF_A_CAMERA])
    true = PixelScale(x * scale.mm_per_px_x, y * scale.mm_per_px_y)
    geometry = CameraGeometry(true, axis_x_mm, axis_y_mm, 100 * distortion)
    caps_mm = last.x[OF_A_CAMERA:].reshape(-1, OF_A_CAP)[:, 1:]
    dots = sum(len(grid.number) for grid in grids)
    return FittedCamera(geometry, _deviation(last, scale, printed), dots, left_mm, caps_mm)


def _misfit(unknowns: Array, grids: Sequence[SeenGrid], printed: GridPrint, noise_mm: float) -> Array:
    """Return all distances of dots from their grid over the noise, and of caps from the middle over their play."""
    x, y, *axis, distortion = unknowns[:OF_A_CAMERA]
    parts, caps = [], unknowns[OF_A_CAMERA:].reshape(-1, OF_A_CAP)
    for grid, (turn, *middle) in zip(grids, caps, strict=True):
        undistorted = grid.image_mm * (x, y)
        on_face = undistorted * (1 + distortion * (undistorted**2).sum(axis=1, keepdims=True) / RIM_MM**2) + axis
        turned = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        printed_at = printed.pitch_mm * grid.number @ turned + middle
        parts += [((on_face - printed_at) / noise_mm).ravel(), np.asarray(middle) / printed.play_mm]
    return np.concatenate(parts)


def _turn_of(grid: SeenGrid) -> float:
    """Return the angle of the grid's first side in the image."""
    whole = grid.number @ np.array([1, 1j])
    seen = (grid.image_mm - grid.image_mm[(grid.number == 0).all(axis=1)]) @ np.array([1, 1j])
    return float(np.angle(np.vdot(whole, seen)))


def _left_mm(found: OptimizeResult, grids: Sequence[SeenGrid], noise_mm: float) -> tuple[float, float]:
    """Return the root mean square of the dots' distances, along x and y, and what of noise these stand for."""
    dots = [2 * len(grid.number) for grid in grids]
    ends = np.cumsum([count + 2 for count in dots])
    squares = sum(
        float((found.fun[end - 2 - count : end - 2] ** 2).sum()) for end, count in zip(ends, dots, strict=True)
    )
    free = sum(dots) - OF_A_CAMERA - OF_A_CAP * len(grids) + 2 * len(grids)
    return noise_mm * float(np.sqrt(squares / sum(dots))), max(
        noise_mm * float(np.sqrt(squares / free)), LEAST_NOISE_MM
    )


def _deviation(
    found: OptimizeResult, scale: PixelScale, printed: GridPrint
) -> tuple[float, float, float, float, float]:
    covariance = np.linalg.inv(found.jac.T @ found.jac)[:OF_A_CAMERA, :OF_A_CAMERA]
    sizes = found.x[:2]
    covariance[:2, :2] += np.outer(sizes, sizes) * (
        LEAST_SIZE_RATIO**2 + (printed.pitch_mm_tolerance / printed.pitch_mm) ** 2
    )
    covariance[-1, -1] += LEAST_DISTORTION**2
    x, y, axis_x_mm, axis_y_mm, distortion = map(float, np.sqrt(np.diag(covariance)))
    return x * scale.mm_per_px_x, y * scale.mm_per_px_y, axis_x_mm, axis_y_mm, 100 * distortion
