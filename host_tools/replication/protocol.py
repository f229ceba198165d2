"""The paper's protocol to the error tables that it yields, to the letter and with one flattery removed after the other.

What the paper does is a reading of its words: each of the nine phantoms is left out in turn, a hundred networks are
trained on the other 133 of the 134 scenes, and their mean is scored. Only the networks leave the phantom out: the
regressions from image to deformation are fitted on all nine. Neither image nor force has noise.
Source: Lee & Won, IEEE JBHI 17(2), 2013, sections III and IV-A.

`PerfectCamera` gives an inclusion's image features without noise or rounding, the force held exactly. The light is the
virtual probe's own, so that what differs from `phantom_recording` is the camera and the hand alone.
Source: Lee & Won, IEEE JBHI 17(2), 2013: "We assume that there is no noise in the tactile data."
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from math import isclose
from typing import Any

import numpy as np

from device.measurement.arrays import Array
from device.measurement.paper_mode.estimate import image_features
from device.measurement.paper_mode.features import FeatureSettings, extract_features
from device.measurement.paper_mode.trained_press import DEFAULT_SCENE, WAVEGUIDE, is_near, told, trained_with
from device.measurement.quantities import Inclusion, InvalidQuantity, unit_of
from device.measurement.recording.tactile_image import FLOOR_COUNTS, Image, TactileImage
from device.simulation.physics.image_formation import ImageFormation, LinearImage, ScatteredImage
from device.simulation.physics.pressed_face import PressedFace, ProbePlacement
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.calibrate import fit_line
from host_tools.calibration.phantom import CAMERA, LIT, TARGET_N, phantom_recording
from host_tools.paper_network.evaluate import ErrorTable
from host_tools.paper_network.train import TrainingRows
from host_tools.replication.networks import Networks
from host_tools.scenes.scene import Waveguide

CENTRED = ProbePlacement()
FULL_SCALE_COUNTS = 255
INCLUSION_FREE = Inclusion(0.0, 8.0, 80.0)
"""Without size, depth and modulus only have to be in the table."""
SETTINGS = FeatureSettings(window_radius_mm=Waveguide().central_radius_mm)
PRESSES = 5
"""Recordings of each phantom: the error of one press is partly luck."""
FIRST_SEED = 2000


class PerfectCamera:
    """Sees the virtual probe's face as it is; `scenario` says by which light."""

    def __init__(self, scenario: Scenario, tables: ProbeTables) -> None:
        self._tables, self._formation = tables, _formation(scenario, tables)
        self._reference = self._intensity(INCLUSION_FREE)
        sensor = scenario.sensor
        counts_per_intensity = sensor.sensitivity_e_per_us * CAMERA.exposure_us * FULL_SCALE_COUNTS / sensor.full_well_e
        self._valid = self._reference * counts_per_intensity >= FLOOR_COUNTS

    def features(self, inclusion: Inclusion, settings: FeatureSettings) -> Array:
        """Return the image features [3] of a press with `TARGET_N`, against the inclusion-free press of the same force.

        Raises `InvalidQuantity` when the probe's table does not hold the inclusion.
        """
        reference = np.where(self._valid, self._reference, np.float32(1.0))
        contrast = np.where(self._valid, self._intensity(inclusion) / reference - 1, np.float32(0.0))
        return extract_features(TactileImage(contrast, self._valid, CAMERA.scale, TARGET_N), settings).as_row()

    def _intensity(self, inclusion: Inclusion) -> Image:
        ramps, light = self._tables.centred.ramps(inclusion), self._formation
        face = PressedFace(ramps, self._tables.off_axis, inclusion, light.x_mm, light.y_mm)
        return light.intensity(*face.at(TARGET_N, CENTRED), LIT)


def _formation(scenario: Scenario, tables: ProbeTables) -> ImageFormation:
    shape = CAMERA.height_px, CAMERA.width_px
    if scenario.light == "linear":
        return LinearImage(scenario.optics, shape, CAMERA.scale)
    return ScatteredImage(tables.light, scenario.skin, scenario.lens, shape, CAMERA.scale)


def require_press(rows: TrainingRows) -> None:
    """Raise `InvalidQuantity` for scenes of another force than that of the images, `TARGET_N`."""
    force_n = trained_with({"scene_defaults": rows.scene_defaults}, "press", "force_n")
    if not isclose(force_n, TARGET_N, rel_tol=1e-6):
        action = "give a sweep of this force: images and scenes must be of one"
        raise InvalidQuantity("press force of the sweep", f"{force_n:g} N", f"{TARGET_N:g} N, as the images", action)


def require_waveguide(rows: TrainingRows, images: Mapping[str, Any]) -> None:
    """Raise `InvalidQuantity` for scenes of another waveguide than that of the images.

    `images` are the `scene_defaults` of their tables. What sweep or tables do not say is the design's.
    """
    for name in DEFAULT_SCENE[WAVEGUIDE]:
        of_sweep, of_images = (
            trained_with({"scene_defaults": scene}, WAVEGUIDE, name) for scene in (rows.scene_defaults, images)
        )
        if not is_near(of_sweep, of_images, 1e-6):
            unit = unit_of(name).replace("1", "")
            found, bound = (f"{told(one)} {unit}".strip() for one in (of_sweep, of_images))
            action = "give a sweep of this waveguide, or its --table: images and scenes must be of one"
            raise InvalidQuantity(f"{name} of the sweep", found, f"{bound}, as the images", action)


class ProtocolStep(Enum):
    """What the networks are given, each step one assumption poorer than the one before."""

    FEATURES = "exact deformation features, no image"
    LETTER = "noise-free images, regressions on all nine (the paper)"
    REFITTED = "the same, regressions on the other eight"
    NOISE = "the same, through the camera with noise"


@dataclass(frozen=True, eq=False)
class Views:
    """The nine phantoms as features [9, 3]: exact, of the noise-free image, and of frames [presses, 9, frames, 3]."""

    exact: Array
    image: Array
    frames: Array

    def deformation(self, step: ProtocolStep, phantom: int) -> Array:
        """Return the deformation features [presses, rows, 3] that a step gives the networks for one phantom."""
        others = np.arange(len(self.exact)) != phantom
        if step is ProtocolStep.FEATURES:
            return self.exact[None, [phantom]]
        if step is ProtocolStep.LETTER:
            return lines(self.image, self.exact)(self.image[None, [phantom]])
        if step is ProtocolStep.REFITTED:
            return lines(self.image[others], self.exact[others])(self.image[None, [phantom]])
        recorded = self.frames.mean(axis=2)  # [presses, 9, 3]
        return np.array(
            [
                lines(image[others], self.exact[others])(rows[phantom])
                for image, rows in zip(recorded, self.frames, strict=True)
            ]
        )

    def r_squared(self) -> Array:
        """Return R2 of the three regressions on the noise-free images of all nine."""
        return np.array([fit_line(x, y)[0].r_squared for x, y in zip(self.image.T, self.exact.T, strict=True)])


def lines(image: Array, deformation: Array) -> Callable[[Array], Array]:
    """Return the three straight lines from image features [n, 3] to deformation features [n, 3]."""
    fits = [fit_line(x, y)[0] for x, y in zip(image.T, deformation.T, strict=True)]
    slope, intercept = np.array([(fit.slope, fit.intercept) for fit in fits]).T
    return lambda rows: np.asarray(rows * slope + intercept)


def views(truth: Array, exact: Array, light: str, tables: ProbeTables, *, presses: int = PRESSES) -> Views:
    """Return phantoms of truth [9, 3] as a perfect camera and `presses` recordings with noise see them.

    `exact` [9, 3] are their deformation features; `light` is that of `Scenario`.
    """
    scenario = Scenario(light=light)
    camera = PerfectCamera(scenario, tables)
    phantoms = [Inclusion(*map(float, row)) for row in truth]
    frames = [
        [
            image_features(phantom_recording(phantom, tables, seed=seed + i, scenario=scenario), SETTINGS)
            for i, phantom in enumerate(phantoms)
        ]
        for seed in range(FIRST_SEED, FIRST_SEED + presses * len(phantoms), len(phantoms))
    ]
    return Views(exact, np.array([camera.features(phantom, SETTINGS) for phantom in phantoms]), np.array(frames))


def errors(networks: Sequence[Networks], seen: Views, truth: Array, step: ProtocolStep) -> ErrorTable:
    """Return the errors of the mean over trials and frames, a row a press; `networks` are those of each phantom."""
    rows = range(len(truth))
    estimates = np.array(
        [[networks[i].answers(press).mean(axis=(0, 1)) for press in seen.deformation(step, i)] for i in rows]
    )  # [9, presses, 3]
    return ErrorTable(np.repeat(truth, estimates.shape[1], axis=0), estimates.reshape(-1, truth.shape[1]))


def single_trial_percent(networks: Sequence[Networks], seen: Views, truth: Array, step: ProtocolStep) -> Array:
    """Return the mean relative error [3] in percent of one network instead of the mean of all; one row a phantom."""
    answers = np.array([networks[i].answers(seen.deformation(step, i)[0]).mean(axis=1) for i in range(len(truth))])
    return np.asarray(100.0 * np.mean(np.abs(answers - truth[:, None]) / truth[:, None], axis=(0, 1)))
