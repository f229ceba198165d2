"""Mode quick: one held frame beside the lesion and one on it, by the committed network."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from device.measurement.bundle import BundleRefused
from device.measurement.estimate import NO_NUMBERS
from device.measurement.quantities import InvalidQuantity
from device.measurement.quick_mode.model import QuickModel, estimate_quick
from device.measurement.quick_mode.profile import QUICK_NAMES, quick_press
from device.measurement.ramp_modes.radial_profile import press_profile
from device.measurement.recording.ring_means import RINGS
from device.simulation.physics.neighbour import Neighbour


@pytest.fixture(scope="module")
def held(pressed):
    return pressed("quick")


def test_one_frame_is_answered_and_each_truth_lies_in_its_interval(held, quick_model, calibration):
    estimate = estimate_quick(held, quick_model, calibration)
    assert (estimate.mode, estimate.model) == ("quick", "quick")
    for name, truth in (("size_mm", 12.0), ("depth_mm", 6.0), ("youngs_modulus_kpa", 60.0)):
        quantity = getattr(estimate, name)
        assert quantity.low <= quantity.value <= quantity.high
        assert quantity.low <= truth <= quantity.high
    assert estimate.reason.endswith(" The tissue is taken to have 2 to 30 kPa: one force does not tell it.")
    evidence = "elongation_ratio", "middle_contrast", "middle_less_rim_contrast"
    assert tuple(estimate.features) == (*QUICK_NAMES, *evidence, *(f"critical_{name}" for name in evidence))


def test_the_row_is_the_contrast_that_a_ramp_shows_at_that_force(held, pressed):
    """Between 0.40 and 0.55 N the contrast on each ring lies between what the ramp's profile says there."""
    row, profile = quick_press(held).row, press_profile(pressed("standard"))
    low, high = np.sort(profile.contrast[2:], axis=0)
    assert (row[:RINGS] > low - 0.01).all()
    assert (row[:RINGS] < high + 0.01).all()
    assert row[RINGS] == pytest.approx(0.5, abs=0.03)


def test_nothing_under_the_skin_gets_no_numbers(pressed, quick_model, calibration):
    estimate = estimate_quick(pressed("quick", (0.0, 6.0, 60.0)), quick_model, calibration)
    assert estimate.status == "not_identifiable"
    assert estimate.reason.startswith("No inclusion can be told from the tissue here.")
    for name in ("middle_contrast", "middle_less_rim_contrast"):
        assert estimate.features[name] <= estimate.features[f"critical_{name}"]


def test_a_contrast_beyond_what_was_learnt_gets_no_numbers(held, quick_model, calibration):
    frames = tuple(
        replace(frame, counts=np.minimum(2 * frame.counts.astype(int), 250).astype(np.uint8))
        if frame.role == "press"
        else frame
        for frame in held.frames
    )
    estimate = estimate_quick(replace(held, frames=frames), quick_model, calibration)
    assert estimate.status == "outside_range"
    assert estimate.reason.endswith("The image is unlike any that the probe can measure. " + NO_NUMBERS)
    assert estimate.size_mm.value is None
    assert estimate.features["contrast_0.0_mm"] > estimate.features["trained_high_contrast_0.0_mm"]


def test_a_ramp_is_no_hold(pressed, quick_model, calibration):
    with pytest.raises(InvalidQuantity, match="mean reference force is .* hold 0.5 N beside the lesion and on it"):
        estimate_quick(pressed("standard"), quick_model, calibration)


def test_a_probe_that_the_model_is_not_for_is_refused(held, quick_model, calibration):
    with pytest.raises(InvalidQuantity, match="serial is TSIS-0042"):
        estimate_quick(replace(held, serial="TSIS-0042"), quick_model, calibration)


def test_a_bundle_without_bands_is_refused(quick_model):
    fields = SimpleNamespace(require_known_ranges=lambda: None)
    bundle = SimpleNamespace(card={"modes": {}}, folder=Path("bundle"), fields=fields)
    with pytest.raises(BundleRefused, match=r"modes\.quick is incomplete"):
        QuickModel(bundle)


def test_two_inclusions_are_not_round_at_one_force_either(pressed, quick_model, calibration):
    two = pressed("quick", (8.0, 5.0, 80.0), neighbour=Neighbour(8.0, 5.0, 80.0, x_mm=9.0))
    estimate = estimate_quick(two, quick_model, calibration)
    assert (estimate.status, estimate.size_mm.value) == ("outside_range", None)
    assert estimate.reason.startswith("The inclusion is not round.")
    assert estimate.features["elongation_ratio"] > estimate.features["critical_elongation_ratio"]
