"""The paper's protocol to the error tables that it yields, to the letter and with one flattery removed after the other.

What the paper does is a reading of its words: each of the nine phantoms is left out in turn, a hundred networks are
trained on the other 133 of the 134 scenes, and their mean is scored. Only the networks leave the phantom out: the
regressions from image to deformation are fitted on all nine. Neither image nor force has noise.
Source: Lee & Won, IEEE JBHI 17(2), 2013, sections III and IV-A.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from device.measurement.estimate import image_features
from device.measurement.features import FeatureSettings
from device.measurement.quantities import Inclusion
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibrate import fit_line
from host_tools.inverse.evaluate import ErrorTable
from host_tools.inverse.network import Array
from host_tools.phantom import phantom_recording
from host_tools.scene import Waveguide
from host_tools.study.noise_free_image import PerfectCamera
from host_tools.study.paper_networks import Networks

SETTINGS = FeatureSettings(window_radius_mm=Waveguide().central_radius_mm)
PRESSES = 5
"""Recordings of each phantom: the error of one press is partly luck."""
FIRST_SEED = 2000


class Step(Enum):
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

    def deformation(self, step: Step, phantom: int) -> Array:
        """Return the deformation features [presses, rows, 3] that a step gives the networks for one phantom."""
        others = np.arange(len(self.exact)) != phantom
        if step is Step.FEATURES:
            return self.exact[None, [phantom]]
        if step is Step.LETTER:
            return lines(self.image, self.exact)(self.image[None, [phantom]])
        if step is Step.REFITTED:
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


def errors(networks: Sequence[Networks], seen: Views, truth: Array, step: Step) -> ErrorTable:
    """Return the errors of the mean over trials and frames, a row a press; `networks` are those of each phantom."""
    rows = range(len(truth))
    estimates = np.array(
        [[networks[i].answers(press).mean(axis=(0, 1)) for press in seen.deformation(step, i)] for i in rows]
    )  # [9, presses, 3]
    return ErrorTable(np.repeat(truth, estimates.shape[1], axis=0), estimates.reshape(-1, truth.shape[1]))


def single_trial_percent(networks: Sequence[Networks], seen: Views, truth: Array, step: Step) -> Array:
    """Return the mean relative error [3] in percent of one network instead of the mean of all; one row a phantom."""
    answers = np.array([networks[i].answers(seen.deformation(step, i)[0]).mean(axis=1) for i in range(len(truth))])
    return np.asarray(100.0 * np.mean(np.abs(answers - truth[:, None]) / truth[:, None], axis=(0, 1)))
