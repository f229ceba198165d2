"""What is believed of a press before phantoms are fitted: smooth errors on skin that differs from place to place."""

import numpy as np
import pytest

from device.measurement.ramp_modes.noise import ErrorLevels, smooth_ring_errors
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.ring_means import RING_MM, RINGS, ring_weights
from device.simulation.physics.skin import SkinTexture
from host_tools.commissioning.joint_fit import FLAT_FIELD_RATIO, USUAL_MODEL_RATIO, levels_on_skin

SKINS = 400
MM = 0.25
X_MM = np.arange(-RINGS * RING_MM, RINGS * RING_MM + MM / 2, MM, dtype=np.float32)
LESION_MM, BESIDE_MM = (0.0, 4.0, 6.0), 40.0
"""Where presses of a scan stand, and their reference."""


@pytest.fixture(scope="module")
def errors():
    """Ring means [SKINS, 3, J] of light over the reference's, less 1, in three presses of each of many skins."""
    weights = ring_weights((len(X_MM), len(X_MM)), PixelScale(MM, MM))
    seen = np.ones((len(X_MM), len(X_MM)), bool)

    def ratio(skin, at_mm):
        return skin.light_ratio(X_MM[None] + at_mm, X_MM[:, None]) / skin.light_ratio(
            X_MM[None] + BESIDE_MM, X_MM[:, None]
        )

    skins = [SkinTexture(0.3, ErrorLevels().flat_field_mm, seed) for seed in range(SKINS)]
    return np.array([[weights.means(ratio(skin, at) - 1, seen).mean for at in LESION_MM] for skin in skins])


def test_a_flat_field_on_skin_is_the_faces_and_the_textures_of_both_patches(errors):
    of_face = ErrorLevels().flat_field_ratio
    levels = levels_on_skin(ErrorLevels(), FLAT_FIELD_RATIO, USUAL_MODEL_RATIO)
    believed = np.diag(smooth_ring_errors(levels, harmonic=0)[0])
    face = np.diag(smooth_ring_errors(ErrorLevels(flat_field_ratio=of_face), harmonic=0)[0])
    found = np.mean(errors**2, axis=(0, 1))
    assert (believed - face).sum() == pytest.approx(found.sum(), rel=0.1)


def test_presses_of_a_scan_share_the_patch_beside_but_not_those_over_the_lesion(errors):
    """Of the texture half, and more where they are closer; with the face's flat field it is what is believed."""
    levels = levels_on_skin(ErrorLevels(), FLAT_FIELD_RATIO, USUAL_MODEL_RATIO)
    of_face = (ErrorLevels().flat_field_ratio / FLAT_FIELD_RATIO) ** 2
    own = np.sum(errors**2) / 3
    near, far = (np.sum(errors[:, 0] * errors[:, place]) for place in (1, 2))
    assert levels.flat_field_shared_ratio == pytest.approx(of_face + (1 - of_face) * far / own, abs=0.07)
    assert (near / own, far / own) == pytest.approx((0.66, 0.53), abs=0.07)


def test_without_texture_all_of_the_flat_field_is_the_faces():
    same = levels_on_skin(ErrorLevels(), ErrorLevels().flat_field_ratio, ErrorLevels().model_ratio)
    assert same == ErrorLevels()
