"""The daemon's errors: each class one part, each with the fault code the screen and the API show.

DeviceError
├── ConfigError       E001  a setting is missing, unknown or out of its bound
├── CameraError       E101  no frame, or a frame of the wrong shape
├── LightError        E201  the LED chip does not answer or does not hold what was written
├── LoadCellError     E301  no force, or a line that cannot be read
├── ModelError        E401  a bundle or calibration is missing, tampered with, or not for this probe
├── StorageError      E601  a measurement could not be made durable
├── BusyError         E801  a press is already under way
└── UnknownResource   E802  no such press or measurement
"""

from __future__ import annotations


class DeviceError(Exception):
    """Something the operator or maintainer can act on: what happened, and the remedy."""

    code = "E000"
    status = 500

    def __init__(self, cause: str, remedy: str) -> None:
        self.cause, self.remedy = cause, remedy
        super().__init__(f"{cause} {remedy}")


class ConfigError(DeviceError):
    """A setting is missing, unknown or out of its bound."""

    code = "E001"


class CameraError(DeviceError):
    """The camera gives no frame, or one of the wrong shape."""

    code = "E101"
    status = 503


class LightError(DeviceError):
    """The LED chip does not answer, or does not hold what was written."""

    code = "E201"
    status = 503


class LoadCellError(DeviceError):
    """The load cell is silent, or its lines cannot be read."""

    code = "E301"
    status = 503


class ModelError(DeviceError):
    """A model bundle or calibration is missing, tampered with, or not made for this probe."""

    code = "E401"
    status = 503


class StorageError(DeviceError):
    """A measurement could not be made durable."""

    code = "E601"
    status = 507


class BusyError(DeviceError):
    """A press is already under way."""

    code = "E801"
    status = 409


class UnknownResource(DeviceError):  # noqa: N818 - the name is what the caller reads
    """No press or measurement of that id."""

    code = "E802"
    status = 404
