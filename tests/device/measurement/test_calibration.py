"""A calibration certificate: its lines, its way through JSON, and everything that makes it unusable."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

from device.measurement.calibration import Calibration, Regression, read_calibration
from device.measurement.features import FeatureSettings
from device.measurement.intervals import HeldOut
from device.measurement.quantities import InvalidQuantity
from device.measurement.tactile_image import PixelScale


@dataclass(frozen=True)
class Model:
    """What a certificate asks of a model bundle."""

    sha256: str = "ab" * 32
    card_sha256: str = "ef" * 32


@pytest.fixture
def certificate():
    rng = np.random.default_rng(1)
    truth = rng.uniform((1, 4, 40), (15, 12, 120), (100, 3)).round(3)
    lines = (Regression(2.0, 0.5, 0.99, 0.01), Regression(-1.0, 0.0, 0.98, 0.02), Regression(0.1, -3.0, 0.97, 0.03))
    return Calibration(
        id="c-1",
        made_at="2026-01-02T03:04:05Z",
        serial="TSIS-0007",
        model_sha256="ab" * 32,
        model_card_sha256="ef" * 32,
        force_n=0.5,
        scale=PixelScale(0.03, 0.04),
        settings=FeatureSettings(smoothing_mm=0.4),
        regressions=lines,
        phantoms=9,
        held_out=HeldOut(truth.round(1), truth, np.array([1.0, 4.0, 40.0]), np.array([15.0, 12.0, 120.0])),
        software="1.0",
        simulated=False,
    )


@pytest.fixture
def path(certificate, tmp_path):
    path = tmp_path / "calibration.json"
    path.write_text(certificate.to_json())
    return path


BOX = {"box_low": [1.0, 4.0, 40.0], "box_high": [15.0, 12.0, 120.0]}


def edited(path, change):
    record = json.loads(path.read_text())
    change(record)
    path.write_text(json.dumps(record))
    return path


def test_each_feature_goes_through_its_own_line(certificate):
    """2 x + 0.5, -x, and x / 10 - 3."""
    found = certificate.deformation_features(np.array([[1.0, 2.0, 50.0], [0.0, 0.0, 0.0]]))
    np.testing.assert_allclose(found, [[2.5, -2.0, 2.0], [0.5, 0.0, -3.0]])


def test_a_certificate_comes_back_from_json_as_it_was(certificate, path):
    found = read_calibration(path)
    for name in ("estimate", "truth", "box_low", "box_high"):
        np.testing.assert_array_equal(getattr(found.held_out, name), getattr(certificate.held_out, name))
    assert replace(found, held_out=certificate.held_out) == certificate


def test_the_committed_certificate_holds_for_the_committed_model_and_the_simulated_probe(calibration, bundle):
    calibration.require_for("SIM-0001", bundle)
    assert calibration.simulated


def test_a_certificate_for_another_model_is_refused_with_both(certificate):
    with pytest.raises(InvalidQuantity, match="for model abababababab, but must be for model cdcdcdcdcdcd"):
        certificate.require_for("TSIS-0007", Model(sha256="cd" * 32))


def test_a_certificate_for_another_card_of_the_same_network_is_refused_with_both(certificate):
    with pytest.raises(InvalidQuantity, match="for model efefefefefef, but must be for model cdcdcdcdcdcd"):
        certificate.require_for("TSIS-0007", Model(card_sha256="cd" * 32))


def test_a_certificate_for_another_probe_is_refused_with_both(certificate):
    with pytest.raises(InvalidQuantity, match="for probe TSIS-0007, but must be for probe TSIS-0008"):
        certificate.require_for("TSIS-0008", Model())


def test_a_certificate_for_this_probe_and_model_is_taken(certificate):
    assert certificate.require_for("TSIS-0007", Model()) is None


def test_frames_of_the_calibrated_pixel_size_are_taken(certificate):
    assert certificate.require_scale(PixelScale(0.03, 0.04)) is None


@pytest.mark.parametrize("scale", [(0.0301, 0.04), (0.03, 0.0399), (0.04, 0.03)])
def test_frames_of_another_pixel_size_are_refused_with_both(certificate, scale):
    with pytest.raises(InvalidQuantity, match=r"\(0\.03, 0\.04\) as calibrated") as refusal:
        certificate.require_scale(PixelScale(*scale))
    assert refusal.value.value == scale


@pytest.mark.parametrize(
    ("force_n", "holds"), [(0.5, True), (0.529, True), (0.531, False), (0.471, True), (0.469, False)]
)
def test_a_certificate_holds_within_six_percent_of_its_force(certificate, force_n, holds):
    assert certificate.holds_at(force_n) is holds


@pytest.mark.parametrize("text", ["", "{", "[]", "7", "{}", '{"schema": "tsis.calibration/2"}'])
def test_what_is_no_certificate_is_refused_by_its_path(path, text):
    path.write_text(text)
    with pytest.raises(InvalidQuantity, match=r"^calibration.*calibration\.json"):
        read_calibration(path)


def test_a_missing_certificate_is_refused_by_its_path(tmp_path):
    with pytest.raises(InvalidQuantity, match=r"none\.json.*calibrate the probe again"):
        read_calibration(tmp_path / "none.json")


@pytest.mark.parametrize(
    ("name", "value", "quantity"),
    [
        ("serial", ..., "calibration"),
        ("serial", 7, "serial"),
        ("model_sha256", None, "model_sha256"),
        ("model_card_sha256", 7, "model_card_sha256"),
        ("id", 7, "id"),
        ("force_n", ..., "calibration"),
        ("force_n", 0.0, "calibration's force_n"),
        ("force_n", "0.5", "calibration's force_n"),
        ("scale", ..., "calibration"),
        ("scale", [0.03, 0.04], "calibration"),
        ("scale", {"mm_per_px_x": 0.03, "mm_per_px_y": 0.0}, "mm_per_px_y"),
        ("extra", 1, "calibration"),
        ("settings", ..., "calibration"),
        ("settings", 3, "calibration"),
        ("settings", {"smoothing_cm": 0.05}, "calibration"),
        ("settings", {"smoothing_mm": "0.5"}, "smoothing_mm"),
        ("settings", {"smoothing_mm": 50.0}, "smoothing_mm"),
        ("regressions", ..., "calibration"),
        ("regressions", [], "regressions"),
        ("regressions", [1, 2, 3], "calibration"),
        ("regressions", [{"slope": 1.0}] * 3, "calibration"),
        ("regressions", [dict.fromkeys(Regression.__annotations__, float("nan"))] * 3, "regressions"),
        ("regressions", [dict.fromkeys(Regression.__annotations__, "x")] * 3, "calibration"),
        ("regressions", [dict.fromkeys(Regression.__annotations__, 1.0)] * 2, "regressions"),
        ("held_out", ..., "calibration"),
        ("held_out", [], "calibration"),
        ("held_out", {}, "calibration"),
        ("held_out", BOX | {"estimate": [], "truth": []}, "held-out scenes"),
        ("held_out", BOX | {"estimate": [[1.0, 2.0]] * 100, "truth": [[1.0, 2.0]] * 100}, "held-out shapes"),
        ("held_out", BOX | {"estimate": [[1.0, 2.0], [3.0]], "truth": []}, "calibration"),
        ("held_out", BOX | {"estimate": [1.0] * 100, "truth": [1.0] * 100}, "held-out shapes"),
        ("held_out", BOX | {"estimate": [["x"] * 3] * 100, "truth": [[1.0] * 3] * 100}, "calibration"),
        ("held_out", BOX | {"estimate": [[float("nan")] * 3] * 100, "truth": [[1.0] * 3] * 100}, "held-out scenes"),
    ],
)
def test_a_corrupted_certificate_is_refused_never_repaired(path, name, value, quantity):
    def change(record):
        if value is ...:
            del record[name]
        else:
            record[name] = value

    with pytest.raises(InvalidQuantity) as refusal:
        read_calibration(edited(path, change))
    assert refusal.value.quantity == quantity
    assert refusal.value.action
