"""A certificate's file to the calibration in it, by its hash: device/measurement/calibration.py."""

from __future__ import annotations

from pathlib import Path

from device.measurement.calibration import RENEW, Calibration, calibration_of
from device.measurement.quantities import InvalidQuantity


def read_calibration(path: Path) -> Calibration:
    """Read a certificate; raise `InvalidQuantity` naming the file and the first thing that is wrong with it."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InvalidQuantity("calibration", path, "a readable certificate", f"{RENEW} ({error})") from error
    return calibration_of(content, path)
