"""A calibration certificate: three straight lines from image to deformation features, and how far to trust them.

The lines are fitted on phantoms with known inclusions (`host_tools calibrate`). The certificate is for one probe and
one model, quotes its own residuals, and carries the held-out scenes that give every estimate its interval.
Source: Lee & Won 2013, section III: three separate linear regressions O1':O1, O2':O2, O3':O3.
"""

from __future__ import annotations

import json
import re
from dataclasses import asdict, astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.features import FEATURE_NAMES, FeatureSettings
from device.measurement.intervals import HeldOut
from device.measurement.inversion import ModelBundle
from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.tactile_image import PixelScale

SCHEMA = "tsis.calibration/1"
RENEW = "calibrate the probe again"

FORCE_TOLERANCE = 0.06
"""Relative. Features grow with the force: a press a fifth harder leaves the intervals beside the truth."""
SCALE_TOLERANCE = 1e-3


@dataclass(frozen=True)
class Regression:
    """One straight line, deformation = slope * image + intercept, and its quality on the phantoms."""

    slope: float
    intercept: float
    r_squared: float
    leave_one_out_std: float


@dataclass(frozen=True)
class Calibration:
    """What turns this probe's images into the model's features."""

    id: str
    made_at: str
    serial: str
    model_sha256: str
    model_card_sha256: str
    force_n: float
    scale: PixelScale
    settings: FeatureSettings
    regressions: tuple[Regression, ...]
    phantoms: int
    held_out: HeldOut
    software: str
    simulated: bool

    def __post_init__(self) -> None:
        if len(self.regressions) != len(FEATURE_NAMES):
            found = f"{len(self.regressions)} lines"
            raise InvalidQuantity("regressions", found, f"one for each of {', '.join(FEATURE_NAMES)}", RENEW)
        for name in ("id", "serial", "model_sha256", "model_card_sha256"):
            value = getattr(self, name)
            if not isinstance(value, str):
                raise InvalidQuantity(name, repr(value), "text", RENEW)
        require("calibration's force_n", self.force_n, Bound(0.0, 1e3, "N", low_included=False), RENEW)
        numbers = [value for line in self.regressions for value in asdict(line).values()]
        if not np.isfinite(numbers).all():
            raise InvalidQuantity("regressions", "not finite", "finite numbers", RENEW)

    def deformation_features(self, image_features: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map image features [n, 3] to deformation features [n, 3]."""
        slope = np.array([line.slope for line in self.regressions])
        intercept = np.array([line.intercept for line in self.regressions])
        return np.asarray(image_features * slope + intercept)

    def require_for(self, serial: str, bundle: ModelBundle) -> None:
        """Raise `InvalidQuantity` when the certificate is for another probe or another model."""
        pairs = ((self.model_sha256, bundle.sha256), (self.model_card_sha256, bundle.card_sha256))
        for ours, theirs in pairs:
            if ours != theirs:
                found, expected = f"for model {ours[:12]}", f"for model {theirs[:12]}"
                raise InvalidQuantity("calibration", found, expected, "calibrate with this model")
        if self.serial != serial:
            found, expected = f"for probe {self.serial}", f"for probe {serial}"
            raise InvalidQuantity("calibration", found, expected, "use the probe's own certificate")

    def require_scale(self, scale: PixelScale) -> None:
        """Raise `InvalidQuantity` when frames are of another pixel size than the certificate's."""
        ours, theirs = astuple(self.scale), astuple(scale)
        if not np.allclose(ours, theirs, rtol=SCALE_TOLERANCE):
            raise InvalidQuantity("mm_per_px_x, mm_per_px_y", theirs, f"{ours} as calibrated", RENEW)

    def holds_at(self, force_n: float) -> bool:
        """Return whether a press is as hard as those the regressions and the model were made with."""
        return abs(force_n - self.force_n) <= FORCE_TOLERANCE * self.force_n

    def to_json(self) -> str:
        """Return the certificate as JSON text."""
        record = {"schema": SCHEMA, **asdict(self)}
        record["held_out"] = {k: np.round(v, 3).tolist() for k, v in record["held_out"].items()}
        rows_on_one_line = re.compile(r"\[\s+([-\d.e,\s]+?)\s+\]")
        text = json.dumps(record, indent=1)
        return rows_on_one_line.sub(lambda row: f"[{' '.join(row[1].split())}]", text) + "\n"


def read_calibration(path: Path) -> Calibration:
    """Read a certificate; raise `InvalidQuantity` naming the first thing that is wrong with it."""
    try:
        record: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InvalidQuantity("calibration", path, "a readable certificate", f"{RENEW} ({error})") from error
    if not isinstance(record, dict) or record.pop("schema", None) != SCHEMA:
        raise InvalidQuantity("calibration schema", path, SCHEMA, RENEW)
    try:
        record["scale"] = PixelScale(**record["scale"])
        record["settings"] = FeatureSettings(**record["settings"])
        record["regressions"] = tuple(Regression(**line) for line in record["regressions"])
        held_out = {name: np.array(rows, dtype=float) for name, rows in record["held_out"].items()}
        record["held_out"] = HeldOut(**held_out)
        return Calibration(**record)
    except InvalidQuantity:
        raise
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InvalidQuantity("calibration", path, "a complete certificate", f"{RENEW} ({error})") from error
