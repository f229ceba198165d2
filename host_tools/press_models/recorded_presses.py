"""Random presses as the probe records them: unknowns and nuisances to frames, and these to what a mode reads of them.

Frames, hand and cell are those of `host_tools phantom`. What drifts between a reference press and the press on the
lesion is added by `drifted`: the LEDs' brightness, the cell's zero, and two smooth errors of the light. All press
frames share one (a flat field that has moved). The other changes with the force (a forward model that is not the
truth); it is the reference's, and in a scan in part each ramp's own. Their sizes are those of `ErrorLevels`, which the
estimates believe in; whether they rightly do is measured on such recordings.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import cv2
import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.mode import FRAMES, RAMP_FROM_N, RAMP_TO_N, Mode
from device.measurement.parameters import PARAMETERS
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N, SeenPresses, press_profiles, seen_presses
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.recording import Recording
from device.measurement.recording.tactile_image import Frame, Image
from device.simulation.physics.neighbour import Neighbour
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.physics.skin import Skin
from device.simulation.physics.surface_table import PressRamps
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.phantom import TARGET_N, PhantomProtocol, phantom_recording
from host_tools.press_models.seeds import press_seed

ReadValue = TypeVar("ReadValue")
SMALLEST_BATCH, BATCHES = 4, 128
HELD_STRAY_N = 0.0125
"""Frames of a hold may lie within 5 % of 0.5 N (`press.band_ratio`): spread over that band, twice this each way."""
EXACT = ErrorLevels(gain_ratio=0.0, zero_n=0.0, force_n=0.0, flat_field_ratio=0.0, model_ratio=0.0)
DRIFTING = "reference", "press"
BELOW_ONE = 0.99
"""Parts of a count are less than one also after single precision has rounded their sum."""
GRID_MM = 0.5
"""Smooth errors are drawn on a grid this fine, far finer than they vary, and interpolated to the pixels."""


@dataclass(frozen=True, eq=False)
class RecordedPresses:
    """Parameters [n, 9] of recorded presses or scans, and what is `seen` of each."""

    parameters: Array
    seen: list[SeenPresses]

    @property
    def rows(self) -> list[Array]:
        """Profile rows [N, P] of each."""
        return [one.rows for one in self.seen]


def record_presses(
    tables: ProbeTables,
    parameters: Array,
    mode: Mode,
    *,
    seed: int,
    levels: ErrorLevels = EXACT,
    further_mm: Sequence[Array] = (),
    jobs: int = -1,
) -> RecordedPresses:
    """Return what is read of presses with parameters [n, 9] in a ramp mode; the same whatever `jobs`.

    `further_mm`: of each press, the offsets of the further ramps of its scan.
    """

    def read(number: int) -> SeenPresses:
        further = further_mm[number] if len(further_mm) else ()
        recording = recorded_press(
            tables, parameters[number], mode, press_seed(seed, number), levels=levels, further_mm=further
        )
        return seen_presses(press_profiles(recording))

    return RecordedPresses(parameters, in_parallel(read, len(parameters), jobs))


def recorded_press(
    tables: ProbeTables,
    parameters: Array,
    mode: Mode,
    seed: int,
    *,
    levels: ErrorLevels = EXACT,
    neighbour: Neighbour | None = None,
    wet_ratio: float = 0.0,
    ramps: PressRamps | None = None,
    further_mm: Sequence[float] | Array = (),
) -> Recording:
    """Return the recording of one press with parameters [9], in the frames that a mode takes.

    `further_mm` are the offsets of the further ramps of a scan, each in a direction of its own.
    `neighbour` is a second inclusion, `wet_ratio` the share of the face under gel; `ramps` say how the face deforms
    where the tables do not.
    """
    rng = np.random.default_rng([seed, 1])
    inclusion = Inclusion(*map(float, parameters[:3]))
    protocol = protocol_of(mode, float(parameters[-1]), _any_direction_rad(rng))
    further = tuple(_place(offset_mm, _any_direction_rad(rng)) for offset_mm in further_mm)
    protocol = replace(protocol, further_places=further)
    scenario = scenario_of(parameters, neighbour, wet_ratio)
    recording = phantom_recording(inclusion, tables, seed=seed, protocol=protocol, scenario=scenario, ramps=ramps)
    return recording if levels == EXACT else drifted(recording, rng, levels)


def direction_of_press_rad(seed: int) -> float:
    """Return the direction in which `recorded_press` of a seed puts its first ramp off the axis."""
    return _any_direction_rad(np.random.default_rng([seed, 1]))


def _any_direction_rad(rng: np.random.Generator) -> float:
    return float(rng.uniform(0, 2 * np.pi))


def protocol_of(mode: Mode, offset_mm: float, angle_rad: float) -> PhantomProtocol:
    """Return the forces and the place of a press in a mode."""
    place = _place(offset_mm, angle_rad)
    count = FRAMES[mode].count
    if FRAMES[mode].is_ramp:
        return PhantomProtocol(tuple(np.linspace(RAMP_FROM_N, RAMP_TO_N, count)), frames=1, place=place)
    return PhantomProtocol((TARGET_N,), frames=count, place=place, stray_n=HELD_STRAY_N)


def _place(offset_mm: float, angle_rad: float) -> ProbePlacement:
    return ProbePlacement(float(offset_mm * np.cos(angle_rad)), float(offset_mm * np.sin(angle_rad)))


def scenario_of(parameters: Array, neighbour: Neighbour | None = None, wet_ratio: float = 0.0) -> Scenario:
    """Return what the probe is pressed on, but for the inclusion, for parameters [9]."""
    at = dict(zip(PARAMETERS, map(float, parameters), strict=True))
    skin = Skin(
        albedo=at["albedo"],
        spread_mm=at["spread_mm"],
        contact_pressure_kpa=at["contact_pressure_kpa"],
        wet_ratio=wet_ratio,
    )
    return Scenario(
        skin=skin,
        tissue_modulus_kpa=at["tissue_modulus_kpa"],
        slab_thickness_mm=at["slab_thickness_mm"],
        neighbour=neighbour,
    )


def in_parallel(
    work: Callable[[int], ReadValue], count: int, jobs: int, *, smallest_batch: int = SMALLEST_BATCH
) -> list[ReadValue]:
    """Return the results of `work` on 0 to `count` - 1, one thread a process.

    What `work` holds, often tables and models, goes along with every batch: so batches grow with the count, and are
    small only of work that takes long.
    """
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    batch = max(smallest_batch, count // BATCHES)
    return list(Parallel(n_jobs=jobs, batch_size=batch)(delayed(work)(number) for number in range(count)))


def drifted(recording: Recording, rng: np.random.Generator, levels: ErrorLevels) -> Recording:
    """Return the recording with errors of the light above dark, and of the force that the cell reports on the lesion.

    Counts are rounded up or down at random, for errors of a part of a count would be lost otherwise. The flat field is
    the face's, one of all ramps: raises `ValueError` for levels of which each ramp has a part of its own.
    """
    if levels.flat_field_shared_ratio != 1.0:
        raise ValueError(f"a flat field of which ramps share {levels.flat_field_shared_ratio:.2f}")
    scale, shape = recording.camera.scale, recording.frames[0].counts.shape
    ramps = max(recording.ramps(), default=0) + 1
    gain, zero_n = (level * rng.standard_normal(ramps) for level in (levels.gain_ratio, levels.zero_n))
    flat = levels.flat_field_ratio * smooth_field(shape, scale, levels.flat_field_mm, rng)
    shared = levels.model_shared_ratio if ramps > 1 else 1.0
    of_reference = _model_errors(np.sqrt(shared), shape, scale, levels, rng)
    of_ramps = [_model_errors(np.sqrt(1 - shared), shape, scale, levels, rng) for _ in range(ramps) if ramps > 1]
    dark = np.mean([frame.counts for frame in recording.with_role("dark")], axis=0, dtype=np.float32)

    top = 255 if recording.camera.bits == 8 else 65535

    def error_of(frame: Frame) -> Image:
        if frame.role != "press":
            return _at_force(of_reference, frame.force_n)
        own = _at_force(of_ramps[frame.ramp], frame.force_n) if of_ramps else 0.0
        return np.asarray(gain[frame.ramp] + flat + own)

    def with_errors(frame: Frame) -> Frame:
        if frame.role not in DRIFTING:
            return frame
        part = np.float32(BELOW_ONE) * rng.random(shape, dtype=np.float32)
        clipped = np.clip(np.floor(frame.counts + (frame.counts - dark) * error_of(frame) + part), 0, top)
        whole = clipped.astype(np.uint8) if top == 255 else clipped.astype(np.uint16)
        drift_n = float(zero_n[frame.ramp]) if frame.role == "press" else 0.0
        return replace(frame, counts=whole, force_n=frame.force_n + drift_n)

    return replace(recording, frames=tuple(map(with_errors, recording.frames)))


def _model_errors(
    part: float, shape: tuple[int, int], scale: PixelScale, levels: ErrorLevels, rng: np.random.Generator
) -> list[Image]:
    """Return a part of the model's error at each of the profile's forces."""
    return [
        np.float32(part * levels.model_ratio) * smooth_field(shape, scale, levels.model_mm, rng)
        for _ in PROFILE_FORCES_N
    ]


def _at_force(errors: Sequence[Image], force_n: float) -> Image:
    weights = _cubic_weights(force_n)
    return np.asarray(sum(np.float32(w) * one for w, one in zip(weights, errors, strict=True)))


def smooth_field(shape: tuple[int, int], scale: PixelScale, length_mm: float, rng: np.random.Generator) -> Image:
    """Return a random field [height, width] of variance 1 and correlation exp(-distance^2 / (2 length^2)).

    White noise smoothed by a Gaussian of standard deviation length / sqrt(2).
    """
    height, width = shape
    face_mm = np.array([width * scale.mm_per_px_x, height * scale.mm_per_px_y])
    nodes = np.round(face_mm / GRID_MM).astype(int) + 2
    sigma_x, sigma_y = length_mm / np.sqrt(2) * nodes / face_mm
    margin = int(np.ceil(4 * max(sigma_x, sigma_y)))
    white = rng.standard_normal((nodes[1] + 2 * margin, nodes[0] + 2 * margin)).astype(np.float32)
    smooth = cv2.GaussianBlur(white, (0, 0), sigma_x, sigmaY=sigma_y)[margin:-margin, margin:-margin]
    normalised = smooth * np.float32(2 * np.sqrt(np.pi * sigma_x * sigma_y))
    return np.asarray(cv2.resize(normalised, (width, height), interpolation=cv2.INTER_CUBIC), dtype=np.float32)


def _cubic_weights(force_n: float) -> NDArray[np.float64]:
    """Return the weights [K] of fields at the profile's forces: the cubic in the force through all of them."""
    powers = np.vander(PROFILE_FORCES_N, increasing=True)
    at = np.clip(force_n, PROFILE_FORCES_N[0], PROFILE_FORCES_N[-1]) ** np.arange(len(PROFILE_FORCES_N))
    return np.asarray(np.linalg.solve(powers.T, at))
