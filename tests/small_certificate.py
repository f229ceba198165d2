"""A small calibration certificate for tests of what reads one: every number in it is made up."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from device.measurement.calibration import Calibration, Validity, certificate_id
from device.measurement.paper_mode.features import FeatureSettings
from device.measurement.paper_mode.intervals import HeldOut
from device.measurement.paper_mode.lines import PaperLines, Regression
from device.measurement.recording.recording import CameraSettings, RecordedCell
from device.measurement.recording.untouched_face import UntouchedFace


def small_certificate(**changes: Any) -> Calibration:
    """Return a certificate of 2026 with some of its fields changed, under the id of its content."""
    certificate = Calibration(
        id="",
        made_at="2026-01-03T00:00:00Z",
        validity=Validity("2026-01-02T03:04:05Z", "2027-01-02T03:04:05Z"),
        operator="N. N.",
        serial="TSIS-0007",
        phantom_serial="PH-3",
        camera=CameraSettings(64, 48, 8, 0.03, 0.04, 4000.0, 1.0),
        cell=RecordedCell(100_000.0, 8200.0),
        untouched=UntouchedFace(4.0, (30.0, 40.0, 30.0, 40.0), 0.01, 100.0, 0.6),
        phantoms=9,
        software="1.0",
        software_sha256="cd" * 32,
        simulated=False,
        lines=small_lines(),
    )
    changed = replace(certificate, **changes)
    return replace(changed, id=certificate_id(changed))


def small_lines() -> PaperLines:
    """Return lines of mode paper, for presses of 0.5 N."""
    truth = np.random.default_rng(1).uniform((1, 4, 40), (15, 12, 120), (100, 3)).round(3)
    return PaperLines(
        model_sha256="ab" * 32,
        model_card_sha256="ef" * 32,
        force_n=0.5,
        settings=FeatureSettings(smoothing_mm=0.4),
        regressions=(
            Regression(2.0, 0.5, 0.99, 0.01),
            Regression(-1.0, 0.0, 0.98, 0.02),
            Regression(0.1, -3.0, 0.97, 0.03),
        ),
        held_out=HeldOut(truth.round(1), truth, np.array([1.0, 4.0, 40.0]), np.array([15.0, 12.0, 120.0])),
    )
