"""The certificate a start uses: the active one, once it is for this probe, its model and its settings."""

from __future__ import annotations

from collections.abc import Iterator

from device.config import Config
from device.errors import ForeignCalibration
from device.measurement.calibration import Calibration
from device.measurement.inversion import ModelBundle
from device.measurement.quantities import InvalidQuantity
from device.records.calibrations import Calibrations


def active_calibration(config: Config, bundle: ModelBundle) -> Calibration | None:
    """Return the active certificate, None for a probe that was never calibrated; its dates are not looked at.

    Raises `MissingCalibration` when the one that is named cannot be used, `ForeignCalibration` when it is not for this
    probe, with all that tells.
    """
    calibration = Calibrations(config.calibration).active()
    if calibration:
        require_own(calibration, config, bundle)
    return calibration


def require_own(calibration: Calibration, config: Config, bundle: ModelBundle) -> None:
    """Raise `ForeignCalibration` with everything by which a certificate is not for this probe and its settings."""
    problems = [str(problem) for problem in _foreign(calibration, config, bundle)]
    if problems:
        raise ForeignCalibration(" ".join(problems), "Then start the daemon again.")


def _foreign(calibration: Calibration, config: Config, bundle: ModelBundle) -> Iterator[InvalidQuantity]:
    yield from calibration.foreign(config.serial, bundle)
    if not calibration.holds_at(config.press.target_n):
        bound = f"{calibration.force_n:g} N as calibrated"
        action = "set that force, or calibrate with this one"
        yield InvalidQuantity("press.target_n", config.press.target_n, bound, action)
    camera = config.camera
    yield from calibration.other_settings(
        camera.scale,
        exposure_us=camera.exposure_us,
        gain=camera.gain,
        cell_counts_per_n=config.cell.sensitivity_counts_per_n,
    )
