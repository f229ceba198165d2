"""From a recording to an answer, or to the reason why there is none."""

import json
from dataclasses import replace

import numpy as np
import pytest

from device.measurement.paper_mode.estimate import CONTACT_N, estimate_paper, image_features
from device.measurement.quantities import UNKNOWNS, InvalidQuantity


def with_press(recording, change):
    """Return the recording with every press frame changed."""
    frames = tuple(change(frame) if frame.role == "press" else frame for frame in recording.frames)
    return replace(recording, frames=frames)


@pytest.fixture
def estimated(bundle, calibration):
    return lambda recording: estimate_paper(recording, bundle, calibration)


def assert_no_number(estimate):
    for name in UNKNOWNS:
        quantity = getattr(estimate, name)
        assert (quantity.value, quantity.low, quantity.high, quantity.identifiable) == (None, None, None, False)


def test_an_ordinary_press_is_answered_near_the_truth(estimated, recording):
    """12 mm, 6 mm deep; the modulus of a sphere that deep is not determined."""
    estimate = estimated(recording)
    assert estimate.size_mm.value == pytest.approx(12.0, rel=0.1)
    assert estimate.depth_mm.value == pytest.approx(6.0, rel=0.1)
    assert (estimate.size_mm.identifiable, estimate.youngs_modulus_kpa.identifiable) == (True, False)
    assert estimate.status == "partly_identifiable"
    told = "This press does not determine Young's modulus."
    assert estimate.reason == f"{told} The tissue is taken to have 5 kPa and 30 mm: this mode tells no other."


def test_every_value_lies_in_its_own_interval(estimated, recording):
    for name in UNKNOWNS:
        quantity = getattr(estimated(recording), name)
        assert quantity.low <= quantity.value <= quantity.high


def test_the_json_has_the_contracts_fields_and_no_other(estimated, recording, bundle, calibration):
    record = json.loads(json.dumps(estimated(recording).as_record(), allow_nan=False))
    assert set(record) == {
        *UNKNOWNS, "status", "reason", "mode", "model", "model_sha256", "model_card_sha256", "calibration_id",
        "simulated", "interval_level_percent",
    }  # fmt: skip
    assert set(record["size_mm"]) == {
        "value", "low", "high", "std", "identifiable", "low_is_open", "high_is_open"
    }  # fmt: skip
    assert record["model"] == bundle.name
    assert (record["model_sha256"], record["model_card_sha256"]) == (bundle.sha256, bundle.card_sha256)
    assert record["calibration_id"] == calibration.id
    assert record["simulated"] is True
    assert record["mode"] == "paper"
    assert record["interval_level_percent"] == 90.0


def test_frames_are_estimated_one_by_one_then_averaged_and_their_scatter_is_given(
    estimated, recording, bundle, calibration
):
    rows = calibration.lines.deformation_features(image_features(recording, calibration.lines.settings))
    each = bundle.estimate(rows).estimate
    assert len(each) == 3
    estimate = estimated(recording)
    assert estimate.size_mm.value == pytest.approx(each[:, 0].mean())
    assert estimate.size_mm.std == pytest.approx(each[:, 0].std(ddof=1))
    assert estimate.size_mm.std > 0


def test_what_the_press_does_not_determine_has_no_scatter(estimated, recording):
    estimate = estimated(recording)
    determined = [getattr(estimate, name).identifiable for name in UNKNOWNS]
    assert determined == [getattr(estimate, name).std is not None for name in UNKNOWNS]
    assert not estimate.youngs_modulus_kpa.identifiable
    assert estimate.youngs_modulus_kpa.value is not None


def test_a_single_frame_has_no_scatter(estimated, recording):
    frames = [*recording.with_role("dark"), *recording.with_role("reference"), recording.with_role("press")[0]]
    assert estimated(replace(recording, frames=tuple(frames))).size_mm.std == 0.0


def test_the_features_are_named_and_the_peak_is_that_of_the_inclusion(estimated, recording, bundle, table):
    """The table's inclusion field in the middle, at 0.5 N; light is no straight line of it, and R2 is 0.98."""
    features = estimated(recording).features
    assert list(features) == ["centroid_intensity", "total_intensity", "bright_area_mm2", *bundle.feature_names]
    assert features["max_deformation_mm"] == pytest.approx(
        table.inclusion_field(recording.truth).at(0.5).w_mm[0], rel=0.1
    )


@pytest.mark.parametrize("ratio", [0.0, 0.99])
def test_a_probe_that_touches_nothing_gets_no_number(estimated, recording, ratio):
    estimate = estimated(with_press(recording, lambda frame: replace(frame, force_n=ratio * CONTACT_N)))
    assert estimate.status == "no_contact"
    assert "below 0.05 N" in estimate.reason
    assert_no_number(estimate)


def test_a_saturated_image_gets_no_number(estimated, recording):
    def glare(frame):
        counts = frame.counts.copy()
        counts[:1] = 255  # one row of 492: 0.2 %, above the 0.1 % allowed
        return replace(frame, counts=counts)

    estimate = estimated(with_press(recording, glare))
    assert estimate.status == "saturated"
    assert "0.2% of its pixels are saturated, above 0.1%" in estimate.reason
    assert_no_number(estimate)


def test_a_few_saturated_pixels_do_not_spoil_a_press(estimated, recording):
    def glint(frame):
        counts = frame.counts.copy()
        counts[0, :100] = 255  # 100 of 377 856: 0.03 %, and outside the window
        return replace(frame, counts=counts)

    assert estimated(with_press(recording, glint)).size_mm == estimated(recording).size_mm


def test_an_image_like_the_reference_shows_no_inclusion(estimated, recording):
    reference = recording.with_role("reference")[-1]
    estimate = estimated(with_press(recording, lambda frame: replace(reference, role="press")))
    assert estimate.status == "not_identifiable"
    assert estimate.reason.startswith("No inclusion can be told from the tissue here.")
    assert estimate.features["centroid_intensity"] < estimate.features["critical_centroid_intensity"] == 0.002
    assert_no_number(estimate)


def test_features_beyond_the_training_range_are_said_to_be_and_get_no_number(estimated, recording):
    """Half again as much light everywhere: a contrast that no sphere of the training box makes."""

    def brighter(frame):
        return replace(frame, counts=np.minimum(frame.counts * 1.5, 254).astype(np.uint8))

    estimate = estimated(with_press(recording, brighter))
    assert estimate.status == "outside_range"
    assert estimate.reason.startswith("The image is unlike any that the probe can measure. No numbers are given.")
    found, low, high = (estimate.features[f"{end}max_deformation_mm"] for end in ("", "trained_low_", "trained_high_"))
    assert not low <= found <= high
    assert_no_number(estimate)


@pytest.mark.parametrize("force_n", [0.4, 0.6])
def test_a_press_of_another_force_than_the_calibrations_is_rejected_with_both(estimated, recording, force_n):
    estimate = estimated(with_press(recording, lambda frame: replace(frame, force_n=force_n)))
    assert estimate.status == "rejected"
    assert f"{force_n:.3f} N, not the 0.5 N of the calibration" in estimate.reason
    assert_no_number(estimate)


def with_held_out(calibration, held_out):
    return replace(calibration, lines=replace(calibration.lines, held_out=held_out))


def test_a_value_never_leaves_its_interval_even_where_the_network_extrapolates(bundle, calibration, recording):
    """A box of at most 6 mm: whatever the network says, the answer is at most 6 mm."""
    held_out = calibration.lines.held_out
    shrunk = with_held_out(calibration, replace(held_out, box_high=np.array([6.0, 12.0, 120.0])))
    size = estimate_paper(recording, bundle, shrunk).size_mm
    assert size.low <= size.value <= size.high <= 6.0


def test_an_interval_that_ends_with_the_box_is_open_there(bundle, calibration, recording):
    """12 mm in a box of at most 6 mm: no held-out scene says how large it is, only that it is not small."""
    held_out = calibration.lines.held_out
    shrunk = with_held_out(calibration, replace(held_out, box_high=np.array([6.0, 12.0, 120.0])))
    size = estimate_paper(recording, bundle, shrunk).size_mm
    assert size.high_is_open
    assert size.low_is_open == (size.low <= held_out.box_low[0])


def test_where_all_is_determined_the_status_is_ok(bundle, calibration, recording):
    """Held-out scenes whose estimates were right within 0.01."""
    held_out = calibration.lines.held_out
    jittered = held_out.truth + np.random.default_rng(1).normal(0.0, 0.01, held_out.truth.shape)
    exact = with_held_out(calibration, replace(held_out, estimate=jittered))
    estimate = estimate_paper(recording, bundle, exact)
    assert (estimate.status, estimate.reason) == (
        "ok", "The tissue is taken to have 5 kPa and 30 mm: this mode tells no other."
    )  # fmt: skip


def test_a_recording_without_press_frames_is_refused(estimated, recording):
    frames = tuple(frame for frame in recording.frames if frame.role != "press")
    with pytest.raises(InvalidQuantity, match="^press frames is 0"):
        estimated(replace(recording, frames=frames))


@pytest.mark.parametrize("role", ["dark", "reference"])
def test_a_recording_without_dark_or_reference_is_refused(estimated, recording, role):
    frames = tuple(frame for frame in recording.frames if frame.role != role)
    with pytest.raises(InvalidQuantity, match=f"^{role} frames is 0"):
        estimated(replace(recording, frames=frames))


def test_a_recording_of_another_probe_is_refused(estimated, recording):
    with pytest.raises(InvalidQuantity, match="for probe SIM-0001, but must be for probe TSIS-0007"):
        estimated(replace(recording, serial="TSIS-0007"))


def test_a_recording_of_another_pixel_size_is_refused(estimated, recording):
    camera = replace(recording.camera, mm_per_px_x=0.03)
    with pytest.raises(InvalidQuantity, match="as calibrated"):
        estimated(replace(recording, camera=camera))
