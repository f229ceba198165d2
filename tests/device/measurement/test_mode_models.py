"""Which model answers in which mode, and for which probe."""

from dataclasses import replace

import pytest

from device.files.bundle_file import read_models
from device.measurement.bundle import BundleRefused
from device.measurement.mode import MODES
from device.measurement.mode_models import ModeModels, analysed, mode_of_recording
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from device.measurement.quick_mode.model import estimate_quick
from device.measurement.ramp_modes.estimate import advise_scan, estimate_ramp


@pytest.fixture(scope="module")
def models(bundle, quick_model, ramp_model):
    return ModeModels(bundle, quick_model, ramp_model)


def test_each_mode_is_answered_by_its_own_model(models, quick_model, ramp_model, calibration, pressed):
    quick, standard = pressed("quick"), pressed("standard")
    assert models.estimate(quick, "quick", calibration) == estimate_quick(quick, quick_model, calibration)
    expected = estimate_ramp(standard, "standard", ramp_model, calibration)
    assert models.estimate(standard, "standard", calibration) == expected
    assert models.estimate(pressed("paper"), "paper", calibration).mode == "paper"


def test_what_cannot_be_surpassed_is_known_where_the_card_says_so(models, ramp_model, monkeypatch):
    entry = ramp_model.bundle.card["modes"]["precise"]
    monkeypatch.delitem(entry, "reachable_half_width", raising=False)
    assert models.worth("precise").reachable_half_width is None
    monkeypatch.setitem(entry, "reachable_half_width", {"size_mm": 0.8})
    assert models.worth("precise").reachable_half_width == {"size_mm": 0.8}
    monkeypatch.setitem(entry, "reachable_half_width", {"size_mm": "small"})
    with pytest.raises(BundleRefused, match=r"modes\.precise\.reachable_half_width\.size_mm is 'small'"):
        models.worth("precise")


def test_how_sure_scans_become_press_by_press_is_known_where_the_card_says_so(models, ramp_model, monkeypatch):
    entry, rows = ramp_model.bundle.card["modes"]["precise"], {key: [0.5, 1] for key in UNKNOWNS}
    monkeypatch.delitem(entry, "half_width_by_ramps", raising=False)
    assert models.worth("precise").half_width_by_ramps == {}
    monkeypatch.setitem(entry, "half_width_by_ramps", {"2": rows})
    assert models.worth("precise").half_width_by_ramps == {2: dict.fromkeys(UNKNOWNS, (0.5, 1.0))}
    for wrong, said in (
        ({"two": rows}, "'two'"),
        ({"2": {}}, "size_mm is missing"),
        ({"2": rows | {"depth_mm": ["a"]}}, "depth_mm is no"),
    ):
        monkeypatch.setitem(entry, "half_width_by_ramps", wrong)
        with pytest.raises(BundleRefused, match=rf"half_width_by_ramps.*{said}"):
            models.worth("precise")


def test_a_scan_is_advised_by_the_ramps_model_and_by_no_other(models, bundle, ramp_model, calibration, pressed):
    standard = pressed("standard")
    assert models.advise(standard, calibration) == advise_scan(standard, ramp_model, calibration)
    with pytest.raises(InvalidQuantity, match="mode is precise, but must be one of paper"):
        ModeModels(bundle).advise(standard, calibration)


@pytest.mark.parametrize(("further_mm", "mode"), [((), "standard"), ((4.0,), "precise")])
def test_a_recording_is_read_by_default_as_what_it_is(models, calibration, pressed, further_mm, mode):
    recording = pressed("precise", further_mm=further_mm)
    assert mode_of_recording(recording) == mode
    assert analysed(recording, models, calibration).mode == mode
    assert analysed(recording, models, calibration, "standard").mode == "standard"


def test_a_scan_that_was_finished_after_its_first_ramp_is_read_as_a_scan_again(models, calibration, pressed):
    """By its frames alone it is a press of mode standard, whose critical values are others."""
    finished = replace(pressed("standard"), mode="precise")
    assert mode_of_recording(finished) == "precise"
    assert analysed(finished, models, calibration) == models.estimate(finished, "precise", calibration)
    assert mode_of_recording(replace(finished, mode="quick")) == "standard", "of so many frames it cannot be"


def test_models_of_another_probe_are_left_out_but_for_the_papers(models):
    assert models.for_probe("SIM-0001").modes == MODES
    assert models.for_probe("TSIS-0042").modes == ("paper",)


def test_a_quick_bundle_of_another_commissioning_is_refused_with_both_names(models, quick_model, monkeypatch):
    """Serial and dates of both hold: after a repair it would answer for the face of before."""
    card, ramps = quick_model.bundle.card, models.ramp.bundle
    models.require_made_together(None)
    monkeypatch.setitem(card, "surrogate_sha256", "0" * 64)
    with pytest.raises(BundleRefused, match="surrogate_sha256 is 0{64}.*take it out of the settings") as refusal:
        models.require_made_together(None)
    for told in (quick_model.bundle.folder, ramps.folder, ramps.card["surrogate_sha256"]):
        assert str(told) in str(refusal.value)
    models._replace(ramp=None).require_made_together(None)
    monkeypatch.delitem(card, "surrogate_sha256")  # as of an earlier version
    models.require_made_together(None)
    monkeypatch.setitem(card, "expires_at", "2027-01-02T00:00:00Z")
    models.require_made_together(None)
    monkeypatch.setitem(ramps.card, "expires_at", "2027-03-02T00:00:00Z")
    with pytest.raises(BundleRefused, match="expires_at is 2027-01-02T00:00:00Z, but must be 2027-03-02T00:00:00Z of"):
        models.require_made_together(None)


def test_a_certificate_of_another_commissioning_is_refused(models, calibration, monkeypatch):
    commissioned = replace(calibration, lines=None)
    models.require_made_together(commissioned)  # the bundle is none of a commissioning
    monkeypatch.setitem(models.ramp.bundle.card, "expires_at", "2027-03-02T00:00:00Z")
    with pytest.raises(BundleRefused, match="expires_at is 2027-03-02T00:00:00Z.*Set calibration, standard_model and"):
        models.require_made_together(commissioned)
    models.require_made_together(calibration)  # of `calibrate`: made at another time, and renewed by itself
    monkeypatch.setitem(models.ramp.bundle.card, "expires_at", calibration.validity.expires_at)
    models.require_made_together(commissioned)


def test_a_mode_without_a_model_is_refused_and_not_answered_by_another(bundle, calibration, pressed, tmp_path):
    paper_only = read_models(bundle, tmp_path / "quick", tmp_path / "standard")
    with pytest.raises(InvalidQuantity, match="mode is standard, but must be one of paper"):
        paper_only.estimate(pressed("standard"), "standard", calibration)
    with pytest.raises(InvalidQuantity, match="mode is precise, but must be one of paper"):
        paper_only.advise(pressed("standard"), calibration)
