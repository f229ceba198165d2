"""Estimates of recorded force ramps by the committed model: numbers for one round inclusion, and for nothing else."""

import re
from dataclasses import replace

import numpy as np
import pytest

from device.measurement.estimate import NO_NUMBERS, NOTHING_STANDS_OUT
from device.measurement.mode import FRAMES
from device.measurement.quantities import UNKNOWNS, Inclusion, InvalidQuantity
from device.measurement.ramp_modes import answers as answers_module
from device.measurement.ramp_modes.answers import RampAnswer
from device.measurement.ramp_modes.ellipticity import elongation_deviations
from device.measurement.ramp_modes.estimate import (
    AWAY_FROM_BONE,
    CAUSES,
    PLACES_MM,
    REASONS,
    WORTH_A_RAMP,
    advise_scan,
    estimate_ramp,
    rejections,
    stands_out,
)
from device.measurement.ramp_modes.misfit_blocks import BLOCKS
from device.measurement.ramp_modes.model import RAMP_MODES, CriticalValues
from device.measurement.ramp_modes.noise import ErrorLevels, PressNoise
from device.measurement.ramp_modes.radial_profile import COLUMNS, press_profile, press_profiles
from device.measurement.recording.ring_means import RINGS
from device.measurement.scan_advice import half_widths
from device.simulation.physics.neighbour import Neighbour
from host_tools.forward.plan import Level
from host_tools.probe_tables.force_ramps import press_ramps
from host_tools.scenes.scene import Scene, Tissue

FIGURES = r"\d|odds|misfit|usual|harmonic|contrast|response"
"""What no sentence for an operator has."""
CRITICAL = CriticalValues(1.2, elongation_deviations=3.0, outside_log_odds=0.5, tissue_from_middle_ratio=0.85)


@pytest.fixture(scope="module")
def ramp(pressed):
    return pressed("standard")


@pytest.fixture(scope="module")
def scan(pressed):
    return pressed("precise", further_mm=(4.0,))


@pytest.mark.parametrize("mode", RAMP_MODES)
def test_the_truth_lies_in_each_interval_and_size_and_depth_near_it(ramp, scan, ramp_model, calibration, mode):
    recording = {"standard": ramp, "precise": scan}[mode]
    estimate = estimate_ramp(recording, mode, ramp_model, calibration)
    assert (estimate.mode, estimate.model) == (mode, "standard")
    for name, truth, share in (("size_mm", 12.0, 0.1), ("depth_mm", 6.0, 0.1), ("youngs_modulus_kpa", 60.0, None)):
        quantity = getattr(estimate, name)
        assert quantity.low <= quantity.value <= quantity.high
        assert quantity.low <= truth <= quantity.high
        if share:
            assert quantity.identifiable
            assert quantity.value == pytest.approx(truth, rel=share)


@pytest.mark.parametrize("tissue_kpa", [2.6, 4.3, 5.7, 17.0])
def test_the_press_beside_the_lesion_tells_the_patients_tissue(pressed, ramp_model, calibration, tissue_kpa):
    recording = pressed("standard", tissue_modulus_kpa=tissue_kpa)
    features = estimate_ramp(recording, "standard", ramp_model, calibration).features
    assert features["tissue_modulus_std_kpa"] < 0.15 * tissue_kpa
    assert features["tissue_modulus_kpa"] == pytest.approx(tissue_kpa, abs=3 * features["tissue_modulus_std_kpa"])


def test_the_same_recording_gives_the_same_estimate_again(scan, ramp_model, calibration):
    first, again = (estimate_ramp(scan, "precise", ramp_model, calibration) for _ in range(2))
    assert first == again


def test_an_unknown_that_is_not_determined_gets_the_whole_range(pressed, ramp_model, calibration):
    """A deep small inclusion says nothing of its modulus: 10-160 kPa are left."""
    estimate = estimate_ramp(pressed("standard", (9.0, 9.0, 100.0)), "standard", ramp_model, calibration)
    modulus = estimate.youngs_modulus_kpa
    assert (modulus.low, modulus.high) == (10.0, 160.0)  # exactly: the truth may be one of them
    assert not modulus.identifiable
    assert modulus.low_is_open
    assert modulus.high_is_open
    assert estimate.status == "partly_identifiable"
    assert "Young's modulus" in estimate.reason


def test_an_interval_is_open_only_where_the_trained_range_ends(ramp, ramp_model, calibration):
    """12 mm of at most 15, 6 mm deep of 4-12: both are told from the ends."""
    estimate = estimate_ramp(ramp, "standard", ramp_model, calibration)
    for quantity, (lowest, highest) in ((estimate.size_mm, (2.0, 15.0)), (estimate.depth_mm, (4.0, 12.0))):
        assert quantity.low_is_open == (quantity.low <= lowest)
        assert quantity.high_is_open == (quantity.high >= highest)
    assert not estimate.size_mm.low_is_open


def flat_row(middle, rim):
    """Return a row whose light grows with the force nowhere, of these contrasts on the four inner and other rings."""
    row = np.zeros(COLUMNS)
    row[: 4 * RINGS] = np.tile(np.repeat([middle, rim], [4, RINGS - 4]), 4)
    return row


WHITE = PressNoise(1e-12 * np.eye(COLUMNS), ErrorLevels(gain_ratio=0.01, zero_n=0.0, model_ratio=1e-6))
"""Light drifts by 1 % between the presses, the flat field by 0.2 %; all else hardly anything."""


@pytest.mark.parametrize(
    ("middle", "rim", "is_seen"),
    [
        (0.06, 0.06, True),  # six times the drift: seen in the middle by itself, and flat: not against the rim
        (0.03, 0.03, False),  # what a drift of three standard deviations looks like
        (0.03, -0.02, True),  # a middle that is no brighter, but 5 % brighter than the rim: no drift does that
        (0.0, -0.05, True),  # the light has drifted down as a whole, the middle is as it was beside the lesion
        (-0.05, 0.0, False),  # darker than the rim is no inclusion
    ],
)
def test_an_inclusion_stands_out_by_itself_or_against_the_rim(middle, rim, is_seen):
    """Drift of 1 % is common to all rings: 4 standard deviations are 4 % for the middle, and next to none against the
    rim, where the flat field's 0.2 % a 2 mm are left."""
    assert stands_out(flat_row(middle, rim), WHITE) == is_seen


def test_nothing_under_the_skin_gets_no_numbers(pressed, ramp_model, calibration):
    estimate = estimate_ramp(pressed("standard", (0.0, 6.0, 60.0)), "standard", ramp_model, calibration)
    assert estimate.status == "not_identifiable"
    assert estimate.reason == NOTHING_STANDS_OUT
    assert estimate.features["contrast_deviations"] <= estimate.features["critical_contrast_deviations"] == 4.0
    assert estimate.size_mm.value is None


def test_two_inclusions_get_no_numbers_and_a_reason(pressed, ramp_model, calibration):
    two = pressed("standard", (8.0, 5.0, 80.0), neighbour=Neighbour(8.0, 5.0, 80.0, x_mm=9.0))
    estimate = estimate_ramp(two, "standard", ramp_model, calibration)
    assert estimate.status == "outside_range"
    assert "not round" in estimate.reason or "one single inclusion" in estimate.reason
    assert estimate.reason.endswith(NO_NUMBERS)
    assert estimate.size_mm.value is None


def test_gel_on_the_face_gets_no_numbers(pressed, ramp_model, calibration):
    wet = pressed("standard", wet_ratio=0.4)
    assert estimate_ramp(wet, "standard", ramp_model, calibration).size_mm.value is None


@pytest.mark.parametrize("tissue_kpa", [pytest.param(1.75, marks=pytest.mark.long), 50.0])
def test_tissue_softer_or_stiffer_than_trained_gets_no_numbers(pressed, ramp_model, calibration, tissue_kpa):
    """By finite elements: the tables hold no such tissue. Refused for it alone, another place is asked for.

    Elements of second order will do: so far outside, what the tissue reads changes by half a per cent.
    """
    scene = Scene(Inclusion(10.0, 5.0, 60.0), tissue=Tissue(youngs_modulus_kpa=tissue_kpa))
    ramps = press_ramps(scene, 0.6, levels=[Level("blunt", 2)], baseline_levels=[Level("blunt_fine", 2)])
    press = pressed("standard", (10.0, 5.0, 60.0), ramps=ramps)
    estimate = estimate_ramp(press, "standard", ramp_model, calibration)
    assert estimate.status == "outside_range"
    assert REASONS["tissue_from_middle_ratio"] in estimate.reason
    assert estimate.features["tissue_from_middle_ratio"] > estimate.features["critical_tissue_from_middle_ratio"]
    is_alone = estimate.features["misfit_ratio"] <= estimate.features["critical_misfit_ratio"]
    assert estimate.reason.endswith(AWAY_FROM_BONE) is is_alone


def test_what_is_at_its_critical_value_is_not_rejected():
    assert rejections(CRITICAL, CRITICAL) == []


@pytest.mark.parametrize(
    ("found", "name"),
    [
        (CriticalValues(1.31, 3.0, 0.5, 0.85), "misfit_ratio"),
        (CriticalValues(1.2, 4.26, 0.5, 0.85), "elongation_deviations"),
        (CriticalValues(1.2, 3.0, 0.6, 0.85), "outside_log_odds"),
        (CriticalValues(1.2, 3.0, 0.5, 0.86), "tissue_from_middle_ratio"),
    ],
)
def test_every_rejection_is_said_in_its_own_sentence_without_figures(found, name):
    assert rejections(found, CRITICAL) == [REASONS[name]]
    assert not re.search(FIGURES, REASONS[name])


@pytest.mark.parametrize("block", BLOCKS)
def test_a_misfit_of_one_block_is_said_in_a_sentence_of_its_own_without_figures(block):
    outside = CriticalValues(1.31, 3.0, 0.6, 0.85)
    assert rejections(outside, CRITICAL, block) == [CAUSES[block].sentence, REASONS["outside_log_odds"]]
    assert rejections(CriticalValues(1.2, 3.0, 0.6, 0.85), CRITICAL, block) == [REASONS["outside_log_odds"]]
    assert not re.search(FIGURES, " ".join(CAUSES[block]))
    assert CAUSES[block].action.startswith("No numbers are given. ")


def test_all_rejections_are_said_and_what_is_no_number_is_rejected_too():
    for everything in (CriticalValues(2.0, 9.0, 1.0, 0.99), CriticalValues(*[float("nan")] * 4)):
        assert rejections(everything, CRITICAL) == list(REASONS.values())


@pytest.mark.parametrize("mode", RAMP_MODES)
def test_a_press_that_is_refused_keeps_the_figures_and_their_critical_values(pressed, ramp_model, calibration, mode):
    """Gel on the face is told by the light beside the lesion: which figures are above their critical values is said."""
    refused = estimate_ramp(pressed(mode, wet_ratio=0.4), mode, ramp_model, calibration)
    assert refused.status == "outside_range"
    critical = ramp_model.critical[mode]
    for name in REASONS:
        assert refused.features[f"critical_{name}"] == getattr(critical, name)
    above = [name for name in REASONS if refused.features[name] > refused.features[f"critical_{name}"]]
    assert above[0] == "misfit_ratio"
    cause = CAUSES["reference_response"]
    assert refused.reason == " ".join([cause.sentence, *(REASONS[name] for name in above[1:]), cause.action])
    ratios = {block: refused.features[f"{block}_misfit_ratio"] for block in BLOCKS}
    assert max(ratios, key=ratios.get) == "reference_response"
    assert ratios["reference_response"] > 100 * refused.features["critical_reference_response_misfit_ratio"]
    assert "tilt_deviations" not in refused.features  # of a commissioned probe alone


def test_a_press_with_numbers_has_no_figures_of_blocks(ramp, ramp_model, calibration):
    features = estimate_ramp(ramp, "standard", ramp_model, calibration).features
    assert {name for name in features if name.endswith("misfit_ratio")} == {"misfit_ratio", "critical_misfit_ratio"}


def test_where_several_blocks_depart_none_is_named(pressed, ramp_model, calibration):
    """A second inclusion shows in the contrast and in both harmonics."""
    two = pressed("standard", (8.0, 5.0, 80.0), neighbour=Neighbour(8.0, 5.0, 80.0, x_mm=9.0))
    estimate = estimate_ramp(two, "standard", ramp_model, calibration)
    above = {
        b for b in BLOCKS if estimate.features[f"{b}_misfit_ratio"] > estimate.features[f"critical_{b}_misfit_ratio"]
    }
    assert above == {"contrast", "first_harmonic", "second_harmonic"}
    assert estimate.reason.startswith(REASONS["misfit_ratio"])
    assert estimate.reason.endswith(NO_NUMBERS)


def stretched_spot(recording, contrast):
    """Return the recording with the second harmonic of a Gaussian spot of 3 mm that is stretched along the x-axis.

    `contrast` is the largest of that harmonic, where r^2 = 2 s^2. Counts are whole numbers again by chance, so that
    their means are what they would be without.
    """
    rng = np.random.default_rng(1)
    x, y = recording.camera.scale.coordinates_mm(recording.frames[0].counts.shape)
    r2 = (x**2 + y**2) / (2 * 3.0**2)
    share = 1 + contrast * r2 * np.exp(1 - r2) * np.cos(2 * np.arctan2(y, x))
    return replace(
        recording,
        frames=tuple(
            replace(f, counts=np.floor(f.counts * share + rng.random(share.shape)).astype(np.uint8))
            if f.role == "press"
            else f
            for f in recording.frames
        ),
    )


@pytest.mark.parametrize("mode", RAMP_MODES)
def test_an_oblong_spot_gets_no_numbers_and_a_reason(pressed, ramp_model, calibration, mode):
    """2 % of the light, ten times what flat field and model leave open; the rings' means stay as they were."""
    oblong = stretched_spot(pressed(mode), 0.02)
    rings, as_before = (press_profile(recording).contrast for recording in (oblong, pressed(mode)))
    np.testing.assert_allclose(rings, as_before, atol=2e-3)
    estimate = estimate_ramp(oblong, mode, ramp_model, calibration)
    assert estimate.status == "outside_range"
    assert "The inclusion is not round." in estimate.reason
    assert estimate.features["elongation_deviations"] > estimate.features["critical_elongation_deviations"]
    assert estimate.size_mm.value is None


def test_a_round_inclusions_elongation_is_told_beside_the_other_features(ramp, ramp_model, calibration):
    features = estimate_ramp(ramp, "standard", ramp_model, calibration).features
    assert 0 < features["elongation_deviations"] < ramp_model.critical["standard"].elongation_deviations
    assert "elongation_ratio" not in features


def test_an_inclusion_beside_the_axis_is_not_called_oblong(pressed, ramp_model):
    """2 mm aside the second harmonic of a sphere is far above noise; its best fit's is as large."""
    aside = press_profile(pressed("standard", (12.0, 4.5, 60.0), offset_mm=2.0))
    direction_rad = np.array([aside.direction_rad])
    best = ramp_model.answer(aside.as_row()[None], direction_rad).best
    answers, limit = ramp_model.answers, ramp_model.critical["standard"].elongation_deviations
    assert np.abs(aside.second_harmonic).max() > 0.005

    def deviations(at):
        (row,) = answers.surrogate.rows(at[None], direction_rad)
        return elongation_deviations(aside.second_harmonic, row, answers.noise)

    assert deviations(best) < limit
    on_axis = best.copy()
    on_axis[-1] = -1.0
    assert deviations(on_axis) > limit


@pytest.mark.parametrize("mode", RAMP_MODES)
def test_ramps_are_answered_in_the_directions_that_their_frames_show(scan, ramp_model, calibration, mode, monkeypatch):
    """And whether they are round is looked for in the same ones."""
    asked, answer, found = [], ramp_model.answer_to, ramp_model.found

    def answered(seen):
        asked.append(seen.direction_rad)
        return answer(seen)

    def judged(answer, seen):
        asked.append(seen.direction_rad)
        return found(answer, seen)

    monkeypatch.setattr(ramp_model, "answer_to", answered)
    monkeypatch.setattr(ramp_model, "found", judged)
    estimate_ramp(scan, mode, ramp_model, calibration)
    shown = [profile.direction_rad for profile in press_profiles(scan)]
    expected = shown if mode == "precise" else shown[:1]
    assert [one.tolist() for one in asked] == [expected] * 2


def test_a_further_ramp_is_weighed_beside_those_so_far_in_their_directions(scan, ramp_model, calibration, monkeypatch):
    asked, worth = [], answers_module.worth_of_places

    def weighed(*told):
        asked.append(told[-1].tolist())
        return worth(*told)

    monkeypatch.setattr(answers_module, "worth_of_places", weighed)
    advise_scan(scan, ramp_model, calibration)
    assert asked == [[profile.direction_rad for profile in press_profiles(scan)]]


def test_a_scan_tells_more_than_its_first_ramp(scan, ramp, ramp_model, calibration):
    """One of two ramps and the same one alone: intervals of what both determine are narrower."""
    both, one = (half_widths(estimate_ramp(r, "precise", ramp_model, calibration)) for r in (scan, ramp))
    assert set(both) == set(one) == set(UNKNOWNS)
    assert both["size_mm"] < one["size_mm"]
    assert both["depth_mm"] < one["depth_mm"]


def test_half_widths_are_those_of_the_intervals_and_nothing_without_numbers(ramp, ramp_model, calibration, pressed):
    estimate = estimate_ramp(ramp, "standard", ramp_model, calibration)
    size = estimate.size_mm
    assert half_widths(estimate)["size_mm"] == pytest.approx((size.high - size.low) / 2)
    nothing = estimate_ramp(pressed("standard", (0.0, 6.0, 60.0)), "standard", ramp_model, calibration)
    assert half_widths(nothing) == {}


def test_after_one_ramp_a_further_one_is_advised_at_a_place_that_narrows_something(ramp, ramp_model, calibration):
    advice = advise_scan(ramp, ramp_model, calibration)
    assert advice.estimate == estimate_ramp(ramp, "precise", ramp_model, calibration)
    assert advice.half_width == half_widths(advice.estimate)
    assert advice.next_offset_mm in PLACES_MM
    parts = [advice.expected_half_width[name] / advice.half_width[name] for name in UNKNOWNS]
    assert min(parts) <= 1 - WORTH_A_RAMP
    assert max(parts) <= 1 + 1e-9


def test_the_more_ramps_there_are_the_less_a_further_one_is_expected_to_tell(ramp, scan, ramp_model, calibration):
    first, second = (advise_scan(recording, ramp_model, calibration) for recording in (ramp, scan))

    def part(advice):
        return min(advice.expected_half_width[name] / advice.half_width[name] for name in UNKNOWNS)

    assert part(second) > part(first)


def test_where_there_are_no_numbers_nothing_is_advised(pressed, ramp_model, calibration):
    for recording in (pressed("standard", (0.0, 6.0, 60.0)), pressed("standard", wet_ratio=0.4)):
        advice = advise_scan(recording, ramp_model, calibration)
        assert advice.estimate.size_mm.value is None
        assert (advice.next_offset_mm, dict(advice.half_width), dict(advice.expected_half_width)) == (None, {}, {})


def test_what_hand_and_skin_may_explain_has_no_numbers_and_is_looked_at_again(
    ramp, ramp_model, calibration, monkeypatch
):
    """As on a commissioned probe; the next ramp of a scan may say that they do not."""
    monkeypatch.setattr(RampAnswer, "needs_inclusion", property(lambda answer: False))
    estimate = estimate_ramp(ramp, "standard", ramp_model, calibration)
    assert (estimate.status, estimate.reason) == ("not_identifiable", NOTHING_STANDS_OUT)
    assert estimate.features["misfit_ratio"] < estimate.features["critical_misfit_ratio"]
    advice = advise_scan(ramp, ramp_model, calibration)
    assert advice.next_offset_mm in PLACES_MM
    assert (dict(advice.half_width), dict(advice.expected_half_width)) == ({}, {})


def test_after_the_last_ramp_of_a_scan_none_is_asked_for(ramp, ramp_model, calibration, monkeypatch):
    """Nor is it weighed what one would tell: that takes as long as the answer."""
    monkeypatch.setattr(answers_module, "worth_of_places", None)
    numbers = range(FRAMES["precise"].most_ramps)
    press = [replace(f, ramp=number) for number in numbers for f in ramp.with_role("press")]
    full = replace(ramp, frames=(*(f for f in ramp.frames if f.role != "press"), *press))
    advice = advise_scan(full, ramp_model, calibration)
    assert advice.next_offset_mm is None
    assert advice.expected_half_width == advice.half_width != {}


def test_a_further_ramp_that_narrows_nothing_is_not_asked_for(ramp, ramp_model, calibration, monkeypatch):
    none = np.full((len(PLACES_MM), len(UNKNOWNS)), 1 - 0.9 * WORTH_A_RAMP)
    monkeypatch.setattr(answers_module, "worth_of_places", lambda *asked: none)
    advice = advise_scan(ramp, ramp_model, calibration)
    assert advice.next_offset_mm is None
    assert advice.expected_half_width == advice.half_width


def test_of_places_the_one_that_narrows_most_all_told_is_advised(ramp, ramp_model, calibration, monkeypatch):
    parts = np.full((len(PLACES_MM), len(UNKNOWNS)), 0.9)
    parts[3] = 0.9, 0.6, 0.8
    monkeypatch.setattr(answers_module, "worth_of_places", lambda *asked: parts)
    advice = advise_scan(ramp, ramp_model, calibration)
    assert advice.next_offset_mm == PLACES_MM[3]
    assert advice.expected_half_width["depth_mm"] == pytest.approx(0.6 * advice.half_width["depth_mm"])


def test_full_scale_pixels_are_refused(ramp, ramp_model, calibration):
    frames = tuple(
        replace(frame, counts=np.full_like(frame.counts, 255)) if frame.role == "press" else frame
        for frame in ramp.frames
    )
    estimate = estimate_ramp(replace(ramp, frames=frames), "standard", ramp_model, calibration)
    assert estimate.status == "saturated"
    assert estimate.reason.startswith("The image is too bright: 100.0% of its pixels are saturated, above 0.1%.")


@pytest.mark.parametrize(
    ("change", "mode", "words"),
    [
        ({"serial": "TSIS-0042"}, "standard", "serial is TSIS-0042, but must be one of SIM-0001"),
        ({}, "paper", "mode is paper, but must be one of standard, precise"),
    ],
)
def test_what_the_model_is_not_for_is_refused(ramp, ramp_model, calibration, change, mode, words):
    with pytest.raises(InvalidQuantity, match=words):
        estimate_ramp(replace(ramp, **change), mode, ramp_model, calibration)


def test_frames_of_another_pixel_size_are_refused(ramp, ramp_model, calibration):
    camera = replace(ramp.camera, mm_per_px_x=0.04)
    with pytest.raises(InvalidQuantity, match="mm_per_px"):
        estimate_ramp(replace(ramp, camera=camera), "standard", ramp_model, calibration)


def test_a_hold_is_no_ramp(pressed, ramp_model, calibration):
    with pytest.raises(InvalidQuantity, match="press slowly harder"):
        estimate_ramp(pressed("paper"), "standard", ramp_model, calibration)
