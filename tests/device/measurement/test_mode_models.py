"""Which model answers in which mode, and for which probe."""

import pytest

from device.files.bundle_file import read_models
from device.measurement.mode import MODES
from device.measurement.mode_models import ModeModels
from device.measurement.quantities import InvalidQuantity
from device.measurement.quick_mode.model import estimate_quick
from device.measurement.ramp_modes.estimate import estimate_ramp


@pytest.fixture(scope="module")
def models(bundle, quick_model, ramp_model):
    return ModeModels(bundle, quick_model, ramp_model)


def test_each_mode_is_answered_by_its_own_model(models, quick_model, ramp_model, calibration, pressed):
    quick, standard = pressed("quick"), pressed("standard")
    assert models.estimate(quick, "quick", calibration) == estimate_quick(quick, quick_model, calibration)
    expected = estimate_ramp(standard, "standard", ramp_model, calibration)
    assert models.estimate(standard, "standard", calibration) == expected
    assert models.estimate(pressed("paper"), "paper", calibration).mode == "paper"


def test_models_of_another_probe_are_left_out_but_for_the_papers(models):
    assert models.for_probe("SIM-0001").modes == MODES
    assert models.for_probe("TSIS-0042").modes == ("paper",)


def test_a_mode_without_a_model_is_refused_and_not_answered_by_another(bundle, calibration, pressed, tmp_path):
    paper_only = read_models(bundle, tmp_path / "quick", tmp_path / "standard")
    with pytest.raises(InvalidQuantity, match="mode is standard, but must be one of paper"):
        paper_only.estimate(pressed("standard"), "standard", calibration)
