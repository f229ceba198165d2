"""A recording of a force ramp to its press profile: the contrast on rings of the face at four forces.

Also in it: how the untouched tissue's light grows with the force, ring by ring (it knows of tissue and skin), and how
far the inclusion lies off the axis. Every frame counts with its own force; a polynomial in the force brings them to the
profile's forces. Frames are binned before anything is divided: noise in a denominator would raise every contrast.
Source: docs/measurement.md; that the ramp and the whole profile are what the unknowns need: docs/accuracy.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.recording.frame_light import FrameLight, RampLights, frame_light, touched
from device.measurement.recording.recording import Recording
from device.measurement.recording.reference_light import BEYOND_RATIO, HeldLight, Image, RampLight, reference_light
from device.measurement.recording.ring_means import RING_RADII_MM, RINGS, RingMeans, ring_weights
from device.measurement.recording.tactile_image import Frame

Rows = TypeVar("Rows", Array, NDArray[np.float32])
PROFILE_FORCES_N: Array = np.array([0.12, 0.25, 0.40, 0.55])
"""From some 0.6 to 2.7 mm of indentation."""
FLOOR_COUNTS = 3.0
"""A binned reference dimmer than this above dark (of 8 bits) is no flat field."""
RAMP_DEGREE = 3
RAMP_LOW_N, RAMP_HIGH_N = 0.16, 0.5
"""A ramp reaches from at most the first to at least the second of these forces."""
MIN_RAMP_FRAMES = 6
LARGEST_STEP_N = 0.17
"""Between forces further apart than this a ramp's polynomials are not held: four forces hold them, three do not."""
AGAIN = "press slowly harder from the first touch to 0.6 N, beside the lesion and on it"


@dataclass(frozen=True, eq=False)
class RadialProfile:
    """What a press says about inclusion, tissue and skin; K forces `force_n`, J rings `RING_RADII_MM`.

    contrast [K, J]: ring means of the tactile image. reference_response [K - 1, J]: ln of the inclusion-free light at
    each force over that at the largest. first_harmonic [K, J - 1]: of the contrast towards its bright side, without the
    ring in the middle; first_across [K, J - 1]: across it. second_harmonic [2, K, J - 2]: along and across that
    direction, also without the outermost ring. direction_rad: of the bright side in the image, 0 along its rows.
    residual: root mean square, over rings and frames, of what the polynomial in the force leaves.
    """

    force_n: Array
    contrast: Array
    reference_response: Array
    first_harmonic: Array
    first_across: Array
    second_harmonic: Array
    direction_rad: float
    residual: float

    def as_row(self) -> Array:
        """Return contrast, reference response, and first and second harmonic along the bright side as one row [P]."""
        return np.concatenate(
            [
                self.contrast.ravel(),
                self.reference_response.ravel(),
                self.first_harmonic.ravel(),
                self.second_harmonic[0].ravel(),
            ]
        )


class SeenPresses(NamedTuple):
    """What is read of presses with one reference: rows [N, P], second harmonics [N, 2, K, J - 2], directions [N].

    first_across [N, K, J - 1]: what a probe of one's own is told by, beside these.
    """

    rows: Array
    second_harmonics: Array
    direction_rad: Array
    first_across: Array | None = None

    @property
    def across(self) -> Array | None:
        """First and second harmonics across the bright side as one row [A] of each press, where they were read."""
        if self.first_across is None:
            return None
        count = len(self.first_across)
        return np.hstack([self.first_across.reshape(count, -1), self.second_harmonics[:, 1].reshape(count, -1)])


def seen_presses(profiles: Sequence[RadialProfile]) -> SeenPresses:
    """Return what is read of the profiles of presses."""
    return SeenPresses(
        np.array([profile.as_row() for profile in profiles]),
        np.array([profile.second_harmonic for profile in profiles]),
        np.array([profile.direction_rad for profile in profiles]),
        np.array([profile.first_across for profile in profiles]),
    )


FORCES, FIRST_RINGS, SECOND_RINGS = len(PROFILE_FORCES_N), RINGS - 1, RINGS - 2
COLUMN_COUNTS = FORCES * RINGS, (FORCES - 1) * RINGS, FORCES * FIRST_RINGS, FORCES * SECOND_RINGS
CONTRAST, RESPONSE, FIRST, SECOND = (
    slice(sum(COLUMN_COUNTS[:number]), sum(COLUMN_COUNTS[: number + 1])) for number in range(len(COLUMN_COUNTS))
)
"""Columns of a row: contrast, reference response, first and second harmonic, each force by force and ring by ring."""
COLUMNS = SECOND.stop
FIRST_ACROSS = slice(COLUMNS, COLUMNS + COLUMN_COUNTS[2])
SECOND_ACROSS = slice(FIRST_ACROSS.stop, FIRST_ACROSS.stop + COLUMN_COUNTS[3])
SEEN_COLUMNS = SECOND_ACROSS.stop
"""Columns of what is seen of a press: its profile row, then first and second harmonics across the bright side."""


def network_rows(rows: Rows) -> Rows:
    """Return what networks read of rows [..., P], in the order of `NETWORK_NAMES`.

    Contrast, reference response, and the first harmonic's mean over the forces.
    """
    first = rows[..., FIRST].reshape(*rows.shape[:-1], FORCES, FIRST_RINGS).mean(axis=-2)
    return np.concatenate([rows[..., : RESPONSE.stop], first], axis=-1)


def _network_names() -> tuple[str, ...]:
    rings, forces = [f"{r:.1f}_mm" for r in RING_RADII_MM], [f"{f:.2f}_n" for f in PROFILE_FORCES_N]
    contrast = [f"contrast_{f}_{r}" for f in forces for r in rings]
    reference_response = [f"growth_{f}_{r}" for f in forces[:-1] for r in rings]
    return (*contrast, *reference_response, *(f"offset_{r}" for r in rings[1:]))


NETWORK_NAMES = _network_names()


def press_profile(recording: Recording) -> RadialProfile:
    """Return the profile of a recording whose reference and one press are force ramps; raises as `press_profiles`."""
    return press_profiles(recording)[0]


def press_profiles(recording: Recording) -> list[RadialProfile]:
    """Return the profile of each ramp on the lesion, in order; all have one reference ramp.

    Press frames far below or above the reference's forces count nothing. Raises `InvalidQuantity` when a role is
    missing, or a ramp is too short, has too few frames or a gap.
    """
    beside = read_beside(recording)
    return [beside.profile_of(frames) for frames in frames_of_ramps(recording)]


def frames_of_ramps(recording: Recording) -> list[list[Frame]]:
    """Return the press frames of each ramp on the lesion, in order; one without frames when there is none."""
    return list(recording.ramps().values()) or [[]]


RampReader = Callable[[Recording], list[RadialProfile]]
"""`press_profiles`, or what gives the same."""


@dataclass(frozen=True, eq=False)
class ReadBeside:
    """What the press beside the lesion says: its light at any force, and the reference response [K - 1, J].

    `force_n` are the forces of its touched frames, `camera` brings frames to light.
    """

    camera: FrameLight
    force_n: Array
    light: HeldLight | RampLight
    response: Array

    def profile_of(self, frames: Sequence[Frame]) -> RadialProfile:
        """Return the profile of a ramp's press frames; raises as `press_profiles`."""
        press = _within(self.camera.lights(frames), self.force_n)
        _require_ramp("press", press.force_n)
        rings, residual = _at_profile_forces(press.force_n, rings_of(press, self.light))
        return RadialProfile(
            force_n=PROFILE_FORCES_N,
            contrast=rings.mean,
            reference_response=self.response,
            first_harmonic=first_harmonic(rings),
            first_across=first_across(rings),
            second_harmonic=second_harmonic(rings),
            direction_rad=bright_side_rad(rings),
            residual=residual,
        )


def read_beside(recording: Recording) -> ReadBeside:
    """Return what the dark and the reference frames of a recording say; its press frames are not looked at.

    Raises as `press_profiles`.
    """
    frames = touched(recording, "reference")
    camera = frame_light(recording, frames)
    reference = camera.lights(frames)
    _require_ramp("reference", reference.force_n)
    light = reference_light(list(reference.force_n), list(reference.images), FLOOR_COUNTS)
    lit = np.array([light.at(force) for force in PROFILE_FORCES_N])
    everywhere = np.ones(lit.shape, dtype=bool)
    weights = ring_weights(lit.shape[1:], reference.scale)
    mean = weights.means(lit, everywhere if reference.seen is None else everywhere & reference.seen).mean
    return ReadBeside(camera, reference.force_n, light, np.log(mean[:-1] / mean[-1]))


def rings_of(press: RampLights, light: HeldLight | RampLight) -> RingMeans:
    """Return the ring means of press frames' contrast: means [n, J] and harmonics [n, 2, J]."""
    frames = zip(press.images, press.force_n, strict=True)
    contrast, valid = zip(*(contrast_and_valid(image, light, force) for image, force in frames), strict=True)
    seen = np.array(valid) if press.seen is None else np.array(valid) & press.seen
    return ring_weights(press.images[0].shape, press.scale).means(np.array(contrast), seen)


def contrast_and_valid(image: Image, light: HeldLight | RampLight, force_n: float) -> tuple[Image, NDArray[np.bool_]]:
    """Return the contrast of binned light against the reference at its force, and where that is bright enough."""
    base = light.at(force_n)
    valid = base >= FLOOR_COUNTS
    return np.divide(image, base, out=np.ones_like(base), where=valid) - np.float32(1), valid


def harmonic(rings: RingMeans, order: int) -> Array:
    """Return the harmonic of an order [J - 1], mean over the forces, along its direction in the whole window.

    `rings` holds means [K, J] and harmonics [K, 2, J].
    """
    cosine, sine = (part.mean(axis=0) for part in _waves(rings, order))
    return _along(cosine, sine, _direction(cosine, sine))


def first_harmonic(rings: RingMeans) -> Array:
    """Return the first harmonic [K, J - 1] at each force, along its direction in the window, mean over the forces.

    The frame cuts the outermost ring at top and bottom, which would turn the direction: that ring has no say in it.
    """
    cosine, sine = _waves(rings, 1)
    return _along(cosine, sine, bright_side_rad(rings))


def first_across(rings: RingMeans) -> Array:
    """Return the first harmonic [K, J - 1] at each force, across the direction of `first_harmonic`."""
    cosine, sine = _waves(rings, 1)
    return _along(cosine, sine, bright_side_rad(rings) + np.pi / 2)


def second_harmonic(rings: RingMeans) -> Array:
    """Return the second harmonic [2, K, J - 2] at each force, along and across the direction of the bright side.

    That direction is the first harmonic's, as in `first_harmonic`. A round inclusion has none across.
    The frame cuts the outermost ring at top and bottom: what is left there has a second harmonic of its own.
    """
    cosine, sine = (part[:, :-1] for part in _waves(rings, 2))
    turned = 2 * bright_side_rad(rings)
    across = sine * np.cos(turned) - cosine * np.sin(turned)
    return np.stack([_along(cosine, sine, turned), across])


def bright_side_rad(rings: RingMeans) -> float:
    """Return the angle of the first harmonic, mean over the forces, of all rings that the frame holds whole."""
    cosine, sine = (part.mean(axis=0)[:-1] for part in _waves(rings, 1))
    r_mm = RING_RADII_MM[1:-1]
    return float(np.arctan2(sine @ r_mm, cosine @ r_mm))


def _waves(rings: RingMeans, order: int) -> tuple[Array, Array]:
    """Return cosine and sine [K, J - 1] of an order, without the ring in the middle, which has none."""
    return rings.cosine[:, order - 1, 1:], rings.sine[:, order - 1, 1:]


def _direction(cosine: Array, sine: Array) -> float:
    return float(np.arctan2(sine @ RING_RADII_MM[1:], cosine @ RING_RADII_MM[1:]))


def _along(cosine: Array, sine: Array, direction: float) -> Array:
    return np.asarray(cosine * np.cos(direction) + sine * np.sin(direction))


def _within(press: RampLights, reference_n: Array) -> RampLights:
    """Return the press frames whose force the reference's light follows; others have no flat field of their force."""
    if not len(press.force_n):
        return press
    low, high = BEYOND_RATIO
    kept = (press.force_n >= low * reference_n.min()) & (press.force_n <= high * reference_n.max())
    images = [image for image, keep in zip(press.images, kept, strict=True) if keep]
    return replace(press, force_n=press.force_n[kept], images=images)


def _require_ramp(name: str, force_n: Array) -> None:
    if not len(force_n):
        raise InvalidQuantity(f"{name} frames", 0, f"at least {MIN_RAMP_FRAMES}", AGAIN)
    require(f"{name} frames", len(force_n), Bound(MIN_RAMP_FRAMES, 1e6, "frames"), AGAIN)
    require(f"smallest {name} force", float(min(force_n)), Bound(0.0, RAMP_LOW_N, "N"), AGAIN)
    require(f"largest {name} force", float(max(force_n)), Bound(RAMP_HIGH_N, 1.0, "N"), AGAIN)
    step_n = float(np.diff(np.sort(force_n)).max())
    require(f"largest step of the {name} force", step_n, Bound(0.0, LARGEST_STEP_N, "N"), AGAIN)


def _at_profile_forces(force_n: Array, frames: RingMeans) -> tuple[RingMeans, float]:
    """Return polynomials' values at the profile's forces, and the root mean square of what they leave of the means."""
    top = float(PROFILE_FORCES_N[-1])
    powers = np.vander(force_n / top, RAMP_DEGREE + 1, increasing=True)
    at = np.vander(PROFILE_FORCES_N / top, RAMP_DEGREE + 1, increasing=True)
    onto = np.linalg.pinv(powers)
    fitted = RingMeans(*(np.tensordot(at @ onto, part, 1) for part in frames))
    left = frames.mean - powers @ (onto @ frames.mean)
    return fitted, float(np.sqrt(np.mean(left**2)))
