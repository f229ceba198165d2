"""A calibration certificate: its lines, its way through JSON, and everything that makes it unusable."""

import hashlib
import json
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from small_certificate import small_certificate

from device.files.certificate_file import read_calibration
from device.measurement.calibration import certificate_id
from device.measurement.paper_mode.lines import Regression
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.pixel_scale import PixelScale


@dataclass(frozen=True)
class Model:
    """What a certificate asks of a model bundle."""

    sha256: str = "ab" * 32
    card_sha256: str = "ef" * 32
    card: dict = field(default_factory=dict)


@pytest.fixture
def certificate():
    return small_certificate()


@pytest.fixture
def path(certificate, tmp_path):
    path = tmp_path / "calibration.json"
    path.write_text(certificate.to_json())
    return path


CAMERA = {
    "width_px": 64,
    "height_px": 48,
    "bits": 8,
    "mm_per_px_x": 0.03,
    "mm_per_px_y": 0.04,
    "exposure_us": 4000.0,
    "gain": 1.0,
}
UNTOUCHED = {
    "dark_counts": 4.0,
    "side_counts": [1.0] * 4,
    "spread_counts": 0.0,
    "pressed_counts": 60.0,
    "led_ratio": 0.6,
}
BOX = {"box_low": [1.0, 4.0, 40.0], "box_high": [15.0, 12.0, 120.0]}


def edited(path, change):
    """Change the record and hash it again: what is refused then is its content."""
    record = json.loads(path.read_text())
    change(record)
    content = {name: value for name, value in record.items() if name not in ("schema", "sha256")}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    path.write_text(json.dumps({**record, "sha256": hashlib.sha256(text.encode()).hexdigest()}))
    return path


def test_each_feature_goes_through_its_own_line(certificate):
    """2 x + 0.5, -x, and x / 10 - 3."""
    found = certificate.lines.deformation_features(np.array([[1.0, 2.0, 50.0], [0.0, 0.0, 0.0]]))
    np.testing.assert_allclose(found, [[2.5, -2.0, 2.0], [0.5, 0.0, -3.0]])


@pytest.mark.parametrize("led_ratio", [0.6, (0.5, 0.6, 0.7, 0.6)])
def test_a_certificate_comes_back_from_json_as_it_was(certificate, path, led_ratio):
    certificate = small_certificate(untouched=replace(certificate.untouched, led_ratio=led_ratio))
    path.write_text(certificate.to_json())
    found = read_calibration(path)
    for name in ("estimate", "truth", "box_low", "box_high"):
        np.testing.assert_array_equal(getattr(found.lines.held_out, name), getattr(certificate.lines.held_out, name))
    assert replace(found.lines, held_out=certificate.lines.held_out) == certificate.lines
    assert replace(found, lines=certificate.lines) == certificate


def test_a_certificate_without_lines_is_for_its_probe_whatever_the_model_of_mode_paper(path):
    certificate = small_certificate(lines=None)
    path.write_text(certificate.to_json())
    assert not set(json.loads(path.read_text())) & {"regressions", "held_out", "settings", "model_sha256", "force_n"}
    found = read_calibration(path)
    assert found == certificate
    assert found.require_for("TSIS-0007", Model(sha256="cd" * 32)) is None
    with pytest.raises(InvalidQuantity, match="for probe TSIS-0007"):
        found.require_for("TSIS-0008", Model())
    with pytest.raises(InvalidQuantity, match="without the lines of mode paper.*host_tools calibrate"):
        _ = found.paper_lines


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
    assert certificate.lines.holds_at(force_n) is holds


def settings_of(certificate, **changes):
    camera = certificate.camera
    same = {"exposure_us": camera.exposure_us, "gain": camera.gain, "cell_counts_per_n": certificate.cell.counts_per_n}
    geometry = replace(camera.geometry, **{name: changes.pop(name) for name in GEOMETRY if name in changes})
    return [problem.quantity for problem in certificate.other_settings(geometry, **(same | changes))]


GEOMETRY = ("scale", "axis_x_mm", "axis_y_mm", "rim_distortion_percent")


@pytest.mark.parametrize(
    ("changes", "problems"),
    [
        ({}, []),
        ({"exposure_us": 3932}, []),
        ({"exposure_us": 2000, "gain": 2.0}, []),
        ({"exposure_us": 4100}, ["camera.exposure_us times camera.gain"]),
        ({"gain": 2.0}, ["camera.exposure_us times camera.gain"]),
        ({"cell_counts_per_n": 100_200.0}, ["cell.sensitivity_counts_per_n"]),
        (
            {"scale": PixelScale(0.05, 0.04), "cell_counts_per_n": -1.0},
            ["mm_per_px_x, mm_per_px_y", "cell.sensitivity_counts_per_n"],
        ),
    ],
)
def test_settings_that_are_not_those_of_the_calibration_are_all_named(certificate, changes, problems):
    assert settings_of(certificate, **changes) == problems


def test_axis_and_distortion_are_those_of_the_commissioning_where_its_modes_undo_them(certificate):
    moved = {"axis_x_mm": 0.06, "axis_y_mm": 0.04, "rim_distortion_percent": -0.4}
    assert settings_of(certificate, **moved) == []
    assert settings_of(small_certificate(lines=None), **moved) == ["camera.axis_x_mm", "camera.rim_distortion_percent"]


def test_a_certificate_of_another_probe_and_model_says_both(certificate):
    found = [problem.value for problem in certificate.foreign("TSIS-0008", Model(sha256="cd" * 32))]
    assert found == ["for model abababababab", "for probe TSIS-0007"]


def test_the_id_is_that_of_the_content_but_for_when_it_was_written(certificate):
    assert certificate_id(replace(certificate, id="", made_at="2026-05-05T00:00:00Z")) == certificate.id
    assert certificate_id(replace(certificate, operator="Another")) != certificate.id


def test_a_file_in_which_one_digit_was_changed_is_refused(path):
    path.write_text(path.read_text().replace('"slope": 2.0', '"slope": 2.1'))
    with pytest.raises(InvalidQuantity, match="calibration sha256 is .* as stated: restore the file"):
        read_calibration(path)


def test_a_file_that_was_only_written_otherwise_is_taken(certificate, path):
    path.write_text(json.dumps(json.loads(path.read_text())))
    assert read_calibration(path).id == certificate.id


def test_the_schema_before_is_refused_with_both(path):
    path.write_text(path.read_text().replace("tsis.calibration/2", "tsis.calibration/1"))
    with pytest.raises(InvalidQuantity, match="schema is tsis.calibration/1 in .*, but must be tsis.calibration/2"):
        read_calibration(path)


def test_the_summary_leaves_only_the_held_out_scenes_out(certificate, path):
    record = json.loads(path.read_text())
    left_out = set(record) - set(certificate.summary())
    assert left_out == {"held_out", "sha256"}


@pytest.mark.parametrize("text", ["", "{", "[]", "7", "{}", '{"schema": "tsis.calibration/2"}'])
def test_what_is_no_certificate_is_refused_by_its_path(path, text):
    path.write_text(text)
    with pytest.raises(InvalidQuantity, match=r"^calibration.*calibration\.json"):
        read_calibration(path)


def test_a_missing_certificate_is_refused_by_its_path(tmp_path):
    with pytest.raises(InvalidQuantity, match=r"none\.json.*calibrate or commission the probe again"):
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
        ("operator", 7, "operator"),
        ("validity", ..., "calibration"),
        ("validity", {"measured_at": "2026-01-01T00:00:00Z"}, "calibration"),
        ("validity", {"measured_at": "2026-01-01T00:00:00Z", "expires_at": "soon"}, "expires_at"),
        ("validity", {"measured_at": "2026-01-01T00:00:00Z", "expires_at": "2025-01-01T00:00:00Z"}, "expires_at"),
        ("camera", ..., "calibration"),
        ("camera", [0.03, 0.04], "calibration"),
        ("camera", CAMERA | {"mm_per_px_y": 0.0}, "mm_per_px_y"),
        ("camera", CAMERA | {"gain": 0.0}, "camera.gain"),
        ("cell", None, "calibration"),
        ("cell", {"counts_per_n": 0.0}, "cell.counts_per_n"),
        ("untouched", {}, "calibration"),
        ("untouched", UNTOUCHED | {"side_counts": [1.0, 2.0]}, "untouched.side_counts"),
        ("untouched", UNTOUCHED | {"side_counts": [1.0, 2.0, "3", 4.0]}, "untouched counts"),
        ("untouched", UNTOUCHED | {"pressed_counts": 0.0}, "untouched.pressed_counts"),
        ("untouched", UNTOUCHED | {"spread_counts": -1.0}, "untouched.spread_counts"),
        ("untouched", UNTOUCHED | {"led_ratio": 0.0}, "untouched.led_ratio"),
        ("untouched", UNTOUCHED | {"led_ratio": [0.6, 0.6]}, "untouched.led_ratio"),
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
