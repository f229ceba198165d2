"""Installed model bundles to a verdict: each is read from the disk again and computes its golden vectors.

The network in use was proved at the start; this proves that the next start will find it as it was.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from device.config import Config
from device.errors import ModelError
from device.instrument.self_test.result import Result, broken, judged, not_tested
from device.measurement.held_estimate import HeldModel
from device.measurement.inversion import GOLDEN_TOLERANCE, ModelBundle
from device.measurement.model_card import BundleRefused
from device.measurement.profile_model import ProfileModel
from device.measurement.quantities import Bound, InvalidQuantity

PART = "Model"
GOLDEN = Bound(float("-inf"), GOLDEN_TOLERANCE, "relative")
"""The largest deviation from the golden vectors."""
REINSTALL = "Install the bundle again."


def model_results(config: Config, folder_of: Callable[[Path], Path]) -> list[Result]:
    """Return one result a model; `folder_of` says where an installed one lies."""
    loaders: dict[Path, Callable[[Path], ModelBundle]] = {
        config.model: ModelBundle.load,
        config.quick_model: lambda folder: HeldModel.load(folder).bundle,
        config.profile_model: lambda folder: ProfileModel.load(folder).bundle,
    }
    return [_result(installed.name, folder_of(installed), load) for installed, load in loaders.items()]


def _result(name: str, folder: Path, load: Callable[[Path], ModelBundle]) -> Result:
    check = f"model {name}"
    if not folder.exists():
        return not_tested(PART, check, "It is not installed.")
    try:
        bundle = load(folder)
    except (BundleRefused, InvalidQuantity) as error:
        return broken(check, ModelError(str(error), REINSTALL))
    return judged(PART, check, bundle.golden_error_ratio, GOLDEN, REINSTALL)
