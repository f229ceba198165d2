"""The certificate a start uses is for this probe, its model and its settings, or all that says otherwise is told."""

from dataclasses import dataclass, replace

import pytest
from small_certificate import small_certificate

from device.assembly.answers import active_calibration
from device.config import CameraSection, CellSection, Config, PressSection
from device.errors import ForeignCalibration, MissingCalibration
from device.records.calibrations import Calibrations

CERTIFICATE = small_certificate()


@dataclass(frozen=True)
class Model:
    """What a certificate asks of a model bundle."""

    sha256: str = "ab" * 32
    card_sha256: str = "ef" * 32


@pytest.fixture
def config(tmp_path):
    """Settings of the probe that the certificate is for; it lies in its folder and is active."""
    (tmp_path / f"{CERTIFICATE.id}.json").write_text(CERTIFICATE.to_json())
    Calibrations(tmp_path).activate(CERTIFICATE.id)
    camera = CameraSection(width_px=64, height_px=64, mm_per_px_x=0.03, mm_per_px_y=0.04)
    return Config(serial="TSIS-0007", calibration=tmp_path, camera=camera)


def test_one_without_lines_holds_for_any_force_and_model_of_mode_paper(config):
    without = small_certificate(lines=None)
    path = config.calibration / "calibration.json"
    path.write_text(without.to_json())
    other = replace(config, calibration=path, press=replace(config.press, target_n=0.7))
    assert active_calibration(other, Model(sha256="cd" * 32)).id == without.id


def test_the_active_certificate_of_this_probe_is_used(config):
    assert active_calibration(config, Model()).id == CERTIFICATE.id


def test_without_an_active_certificate_there_is_none(config):
    (config.calibration / "active").unlink()
    assert active_calibration(config, Model()) is None


def test_an_unknown_certificate_is_refused(config):
    (config.calibration / "active").write_text("none\n")
    with pytest.raises(MissingCalibration, match=r"none\.json"):
        active_calibration(config, Model())


@pytest.mark.parametrize(
    ("section", "changes", "words"),
    [
        ("", {"serial": "TSIS-0008"}, "for probe TSIS-0007, but must be for probe TSIS-0008"),
        ("press", {"target_n": 0.7}, "press.target_n is 0.7, but must be 0.5 N as calibrated"),
        ("camera", {"mm_per_px_x": 0.05}, "mm_per_px_x"),
        ("camera", {"gain": 2.0}, "camera.exposure_us times camera.gain is 8000 us, but must be 4000 us"),
        ("cell", {"sensitivity_counts_per_n": 9e4}, "cell.sensitivity_counts_per_n is 90000"),
    ],
)
def test_a_certificate_of_other_settings_is_refused_with_both(config, section, changes, words):
    changed = {section: replace(getattr(config, section), **changes)} if section else changes
    with pytest.raises(ForeignCalibration, match=words):
        active_calibration(replace(config, **changed), Model())


def test_everything_by_which_a_certificate_is_foreign_is_told_at_once(config):
    other = replace(
        config, serial="TSIS-0008", press=PressSection(target_n=0.7), cell=CellSection(sensitivity_counts_per_n=1.0)
    )
    with pytest.raises(ForeignCalibration) as refusal:
        active_calibration(other, Model(sha256="cd" * 32))
    for words in ("for model", "for probe", "press.target_n", "cell.sensitivity_counts_per_n"):
        assert words in refusal.value.cause
    assert "mm_per_px" not in refusal.value.cause
