"""Simulated force ramps to what each feature of the image knows: of the inclusion, of light and skin, and of noise.

A change is measured between two presses of the same noise and hand, so that a few pairs show it; scatter comes from
presses that differ in both. Simulated: it ranks features and promises no figure of a real probe.
Source: central differences; docs/features.md is written from here (`host_tools features`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from device.measurement.arrays import Array
from device.measurement.paper_mode.features import FEATURE_NAMES, FeatureSettings, extract_features
from device.measurement.quantities import UNKNOWNS, Inclusion
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N, RAMP_DEGREE, ROW_NAMES, press_profile
from device.measurement.recording.recording import Recording
from device.measurement.recording.tactile_image import Frame
from device.measurement.shape_features import shape_features
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.physics.skin import Skin
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.scenes.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW

Row = Mapping[str, float]
"""Every feature of one press by its name."""

SCENES = (Inclusion(12.0, 6.0, 60.0), Inclusion(8.0, 4.0, 80.0), Inclusion(10.0, 8.0, 60.0))
RAMP = PhantomProtocol(forces_n=tuple(np.linspace(0.08, 0.6, 10)), frames=1)
SEEDS, PAIRS = 20, 3
"""Presses that show the scatter, and pairs of presses that show a change."""
SKIN, OTHER_ALBEDO, OTHER_CONTACT_KPA = Skin(), 0.6, 2.4
DRIFT_RATIO, ZERO_N, OFFSET_MM = 0.01, 1e-3, 1.0
TOLD_APART = 3.0
"""A value within this many times its scatter is not told from 0."""
PRESSES = len(SCENES) * (SEEDS + PAIRS * (3 + 2 * len(UNKNOWNS)))
"""Presses that the study records: light and cell are disturbed on those that are there."""
STEP = 0.05
"""Relative step of the unknowns to either side."""


def press_features(recording: Recording) -> dict[str, float]:
    """Return the paper's three over the ramp, the ring profile and the shape of one recording, by name."""
    profile = press_profile(recording)
    rings = dict(zip(ROW_NAMES, profile.as_row().tolist(), strict=True))
    return _paper_features(recording) | rings | shape_features(profile).as_dict()


def _paper_features(recording: Recording) -> dict[str, float]:
    """Return the paper's three at the profile's forces: a polynomial of the force through those of the frames."""
    images = list(recording.press_images())
    rows = np.array([extract_features(image, FeatureSettings()).as_row() for image in images])
    lines = np.polynomial.polynomial.polyfit([image.force_n for image in images], rows, RAMP_DEGREE)
    values = np.polynomial.polynomial.polyval(PROFILE_FORCES_N, lines)
    return {
        f"{name}_{force:.2f}_n": float(value)
        for name, row in zip(FEATURE_NAMES, values, strict=True)
        for force, value in zip(PROFILE_FORCES_N, row, strict=True)
    }


@dataclass(frozen=True)
class Phantoms:
    """Records presses on one scene; `on_press` is called after each that is made."""

    scene: Inclusion
    tables: ProbeTables
    on_press: Callable[[], None] = field(default=lambda: None)

    def record(
        self, seed: int, *, scene: Inclusion | None = None, skin: Skin = SKIN, place: ProbePlacement | None = None
    ) -> Recording:
        """Return the ramp of a seed: the same seed is the same noise and hand."""
        protocol = replace(RAMP, place=place or ProbePlacement())
        recording = phantom_recording(
            scene or self.scene, self.tables, seed=seed, protocol=protocol, scenario=Scenario(skin=skin)
        )
        self.on_press()
        return recording

    def beside(self, unknown: str, ratio: float) -> Inclusion:
        """Return the scene with an unknown times a ratio, or at the edge of the paper's box."""
        low, high = (box[UNKNOWNS.index(unknown)] for box in (PAPER_BOX_LOW, PAPER_BOX_HIGH))
        return replace(self.scene, **{unknown: min(max(ratio * getattr(self.scene, unknown), low), high)})


def drifted(recording: Recording) -> Recording:
    """Return the recording with the press lit by `DRIFT_RATIO` more; in 16 bits, to keep what 8 would round away."""
    dark = np.mean([frame.counts for frame in recording.with_role("dark")])

    def lit(frame: Frame) -> Frame:
        ratio = 1 + DRIFT_RATIO if frame.role == "press" else 1.0
        counts = np.rint(256 * (dark + (frame.counts - dark) * ratio))
        return replace(frame, counts=np.clip(counts, 0, 2**16 - 1).astype(np.uint16))

    camera = replace(recording.camera, bits=16)
    return replace(recording, camera=camera, frames=tuple(map(lit, recording.frames)))


def zeroed(recording: Recording, roles: Sequence[str]) -> Recording:
    """Return the recording with forces of some roles reported `ZERO_N` too large."""
    frames = [replace(f, force_n=f.force_n + ZERO_N) if f.role in roles else f for f in recording.frames]
    return replace(recording, frames=tuple(frames))


Disturbance = Callable[[Phantoms, Recording, int], Recording]
"""Phantoms, the undisturbed recording and its seed to the disturbed recording."""
DISTURBANCES: Mapping[str, Disturbance] = {
    f"LEDs {100 * DRIFT_RATIO:+g} % after the reference": lambda at, before, seed: drifted(before),
    f"albedo {SKIN.albedo:g} to {OTHER_ALBEDO:g}": lambda at, before, seed: at.record(
        seed, skin=replace(SKIN, albedo=OTHER_ALBEDO)
    ),
    f"contact pressure {SKIN.contact_pressure_kpa:g} to {OTHER_CONTACT_KPA:g} kPa": lambda at, before, seed: at.record(
        seed, skin=replace(SKIN, contact_pressure_kpa=OTHER_CONTACT_KPA)
    ),
    f"{OFFSET_MM:g} mm off the axis": lambda at, before, seed: at.record(seed, place=ProbePlacement(x_mm=OFFSET_MM)),
    f"cell {1e3 * ZERO_N:+g} mN": lambda at, before, seed: zeroed(before, ("reference", "press")),
    f"cell {1e3 * ZERO_N:+g} mN after the reference": lambda at, before, seed: zeroed(before, ("press",)),
}
DRIFT, ALBEDO, CONTACT, OFFSET, ZERO, ZERO_AFTER = DISTURBANCES


@dataclass(frozen=True)
class Sensitivity:
    """What one scene's features do, by name and in each feature's unit.

    `scatter` is the standard deviation over presses, `changes` what each disturbance adds, `slopes` the derivative to
    the logarithm of each unknown.
    """

    scene: Inclusion
    value: Row
    scatter: Row
    changes: Mapping[str, Row]
    slopes: Mapping[str, Row]

    def is_zero(self, name: str) -> bool:
        """Whether a feature is not told from 0 by one press: then only absolute changes mean something."""
        return not abs(self.value[name]) > TOLD_APART * self.scatter[name]

    def moved(self, unknown: str, name: str) -> float:
        """Return how far a tenth of an unknown moves a feature, in units of its scatter."""
        return abs(0.1 * self.slopes[unknown][name]) / self.scatter[name]

    def disturbed(self, disturbance: str, name: str) -> float:
        """Return how far a disturbance moves a feature, in units of its scatter."""
        return abs(self.changes[disturbance][name]) / self.scatter[name]


def sensitivity(at: Phantoms) -> Sensitivity:
    """Return what the features of a scene know."""
    undisturbed = [at.record(seed) for seed in range(PAIRS)]
    rows = [press_features(recording) for recording in undisturbed]
    rows += [press_features(at.record(seed)) for seed in range(PAIRS, SEEDS)]
    names, table = list(rows[0]), np.array([list(row.values()) for row in rows])

    def by_name(values: Array) -> dict[str, float]:
        return dict(zip(names, values.tolist(), strict=True))

    def paired(disturbance: Disturbance) -> Array:
        disturbed = [disturbance(at, before, seed) for seed, before in enumerate(undisturbed)]
        return np.asarray(np.mean([list(press_features(one).values()) for one in disturbed], axis=0))

    def slope(unknown: str) -> Array:
        low, high = (at.beside(unknown, ratio) for ratio in (1 - STEP, 1 + STEP))
        rise = paired(lambda at, _, seed: at.record(seed, scene=high))
        rise -= paired(lambda at, _, seed: at.record(seed, scene=low))
        return np.asarray(rise / math.log(getattr(high, unknown) / getattr(low, unknown)))

    base = table[:PAIRS].mean(axis=0)
    return Sensitivity(
        at.scene,
        value=by_name(table.mean(axis=0)),
        scatter=by_name(table.std(axis=0, ddof=1)),
        changes={name: by_name(paired(disturbance) - base) for name, disturbance in DISTURBANCES.items()},
        slopes={unknown: by_name(slope(unknown)) for unknown in UNKNOWNS},
    )
