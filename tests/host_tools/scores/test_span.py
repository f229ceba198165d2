"""The shift of an answer, against one that is known: a change along the Jacobian moves the answer along with it."""

from pathlib import Path

import numpy as np
import pytest

from device.files.bundle_file import read_surrogate
from device.measurement.ramp_modes.model import RampAnswers
from device.measurement.ramp_modes.noise import ErrorLevels, PressNoise
from host_tools.scores.span import _shift

MODELS = Path(__file__).parents[3] / "models"


@pytest.fixture(scope="module")
def exact():
    """Noise so small that the prior does not count."""
    surrogate = read_surrogate(MODELS / "standard" / "surrogate.npz")
    none = ErrorLevels(gain_ratio=0.0, zero_n=0.0, flat_field_ratio=0.0, model_ratio=0.0)
    noise = PressNoise(1e-12 * np.eye(len(surrogate.rows(np.zeros((1, 9)))[0])), none)
    return RampAnswers(surrogate, {"standard": noise})


def test_what_another_inclusion_would_change_shifts_the_answer_to_that_inclusion(exact):
    """A hundredth of the range in each unknown: over their own spreads, the shifts stand as these do."""
    normalised = np.zeros(9)
    jacobian = exact.surrogate.rows_and_jacobian(normalised[None])[1][0]
    shifts = [_shift(exact, "standard", normalised, 0.01 * jacobian[:, i]) for i in range(3)]
    assert np.abs(np.diag(shifts)).min() > 5 * np.abs(shifts - np.diag(np.diag(shifts))).max()


def test_nothing_shifts_an_answer_by_nothing(exact):
    assert _shift(exact, "standard", np.zeros(9), np.zeros_like(exact.surrogate.rows(np.zeros((1, 9)))[0])).max() == 0
