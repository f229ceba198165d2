"""What mode paper needs of a certificate: three straight lines from image to deformation features, for one model.

They quote their own residuals on the phantoms, and carry the held-out scenes that give every estimate its interval.
Source: Lee & Won 2013, section III: three separate linear regressions O1':O1, O2':O2, O3':O3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.bundle import ModelBundle
from device.measurement.paper_mode.features import FEATURE_NAMES, FeatureSettings
from device.measurement.paper_mode.intervals import HeldOut
from device.measurement.paper_mode.trained_press import CENTRAL_RATIO, FORCE_TOLERANCE, other_press
from device.measurement.quantities import Bound, InvalidQuantity, require

ACTION = "calibrate the probe again"


@dataclass(frozen=True)
class Regression:
    """One straight line, deformation = slope * image + intercept, and its quality on the phantoms."""

    slope: float
    intercept: float
    r_squared: float
    leave_one_out_std: float


@dataclass(frozen=True)
class PaperLines:
    """What turns this probe's images into the features of a model, for presses of one force (N)."""

    model_sha256: str
    model_card_sha256: str
    force_n: float
    settings: FeatureSettings
    regressions: tuple[Regression, ...]
    held_out: HeldOut

    def __post_init__(self) -> None:
        if len(self.regressions) != len(FEATURE_NAMES):
            found = f"{len(self.regressions)} lines"
            raise InvalidQuantity("regressions", found, f"one for each of {', '.join(FEATURE_NAMES)}", ACTION)
        for name in ("model_sha256", "model_card_sha256"):
            value = getattr(self, name)
            if not isinstance(value, str):
                raise InvalidQuantity(name, repr(value), "text", ACTION)
        require("calibration's force_n", self.force_n, Bound(0.0, 1e3, "N", low_included=False), ACTION)
        numbers = [value for line in self.regressions for value in asdict(line).values()]
        if not np.isfinite(numbers).all():
            raise InvalidQuantity("regressions", "not finite", "finite numbers", ACTION)

    def deformation_features(self, image_features: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map image features [n, 3] to deformation features [n, 3]."""
        slope = np.array([line.slope for line in self.regressions])
        intercept = np.array([line.intercept for line in self.regressions])
        return np.asarray(image_features * slope + intercept)

    def foreign(self, bundle: ModelBundle) -> Iterator[InvalidQuantity]:
        """Yield what says that the lines are for another model."""
        pairs = ((self.model_sha256, bundle.sha256), (self.model_card_sha256, bundle.card_sha256))
        for ours, theirs in pairs:
            if ours != theirs:
                found, expected = f"for model {ours[:12]}", f"for model {theirs[:12]}"
                yield InvalidQuantity("calibration", found, expected, "calibrate with this model")
                return

    def other_press(self, bundle: ModelBundle) -> Iterator[InvalidQuantity]:
        """Yield what says that the lines are of another press than their model was trained with.

        Of the waveguide a certificate knows the central window alone.
        """
        radius_mm = self.settings.window_radius_mm / CENTRAL_RATIO
        yield from other_press(bundle.card, self.force_n, {"radius_mm": radius_mm})

    def holds_at(self, force_n: float) -> bool:
        """Return whether a press is as hard as those the regressions and the model were made with."""
        return abs(force_n - self.force_n) <= FORCE_TOLERANCE * self.force_n

    def as_record(self) -> dict[str, Any]:
        """Return the lines as JSON object."""
        record = asdict(self)
        record["held_out"] = {name: np.round(rows, 3).tolist() for name, rows in record["held_out"].items()}
        return record


def lines_of(record: dict[str, Any]) -> PaperLines | None:
    """Take the lines out of a certificate's JSON object and return them, None where it has no part of them.

    Raises `KeyError`, `TypeError` or another of Python's own for a part that is missing or of another kind.
    """
    names = [field.name for field in fields(PaperLines)]
    if not any(name in record for name in names):
        return None
    own = {name: record.pop(name) for name in names}
    own["settings"] = FeatureSettings(**own["settings"])
    own["regressions"] = tuple(Regression(**line) for line in own["regressions"])
    held_out = {name: np.array(rows, dtype=float) for name, rows in own["held_out"].items()}
    return PaperLines(**own | {"held_out": HeldOut(**held_out)})
