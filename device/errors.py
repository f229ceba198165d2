"""The daemon's errors: each class one fault, each with the code that the screen and the API show.

The hundreds are the part: 0 settings, 1 camera, 2 light, 3 load cell, 4 model, 5 press, 6 storage, 7 clock, 8 request
(E803 and E804, a malformed one and an unknown path, are device/web/problems.py's own).
docs/simulated_probe.md lists how each fault is provoked and seen.

DeviceError
├── ConfigError              E001  a setting is missing, unknown or out of its bound
│   └── LastGoodConfigError  E002  the settings files are bad, the last good ones are used (a warning)
├── CameraError              E101  no frame, or a frame of the wrong shape
│   ├── LateFrameError       E102  the camera leaves out most of its frames
│   ├── TornFrameError       E103  frames are put together from two exposures
│   ├── CameraProcessError   E104  the camera's process hung or died; it is restarted, but not for ever
│   └── StaleFrameError      E105  a frame shows the light from before it was changed
├── LightError               E201  the LED chip does not answer or does not hold what was written
│   ├── LightBusError        E202  the I2C bus is stuck
│   ├── DarkSideError        E203  a side gives no light although its register is set
│   ├── StuckLightError      E204  a side cannot be switched off
│   ├── AmbientLightError    E205  foreign light reaches the camera
│   ├── DimLightError        E206  a side is dimmer than it was (a warning)
│   ├── OpenLedError         E207  no current flows through the LED of a side
│   ├── HotLedDriverError    E208  the LED chip is too hot, or no side is connected
│   └── LightBudgetError     E209  the light was on for too long in one press
├── LoadCellError            E301  no force
│   ├── UnreadableCellError  E302  lines come, but none that can be read
│   ├── SaturatedCellError   E303  the amplifier is at the end of its range
│   ├── UnpluggedCellError   E304  the serial line is gone
│   ├── OverloadedCellError  E305  more load than the cell bears, from its zero at commissioning
│   ├── ZeroShiftError       E306  the zero is far from that of commissioning
│   └── DetachedCellError    E307  the amplifier answers, but no bridge is behind it
├── ModelError               E401  a bundle or calibration is missing, tampered with, or not for this probe
├── NoContrastError          E501  pressing does not change the image: gel, or a wet face
├── StorageError             E601  a measurement could not be made durable
│   └── DiskFullError        E602  there is no space left
├── ClockJumpError           E701  the wall clock was set (a warning)
├── BusyError                E801  a press is already under way
├── UnknownResource          E802  no such press or measurement
└── ModeUnavailable          E805  this probe cannot answer in that mode
"""

from __future__ import annotations

from typing import Literal


class DeviceError(Exception):
    """Something the operator or maintainer can act on: what happened, and the remedy."""

    code = "E000"
    status = 500
    severity: Literal["fault", "warning"] = "fault"
    is_lasting = False
    """Whether a warning is true as long as the daemon runs, not of one press only."""

    def __init__(self, cause: str, remedy: str) -> None:
        self.cause, self.remedy = cause, remedy
        super().__init__(f"{cause} {remedy}")

    def __reduce__(self) -> tuple[type[DeviceError], tuple[str, str]]:
        """Carry the error to another process: an exception alone forgets what it was made of."""
        return type(self), (self.cause, self.remedy)

    def as_record(self) -> dict[str, str]:
        """Return the error as the JSON object of the status and of a press."""
        return {"code": self.code, "severity": self.severity, "cause": self.cause, "remedy": self.remedy}


class ConfigError(DeviceError):
    """A setting is missing, unknown or out of its bound."""

    code = "E001"


class LastGoodConfigError(ConfigError):
    """The settings files are bad; the probe runs on those with which it last started well."""

    code = "E002"
    severity = "warning"
    is_lasting = True


class CameraError(DeviceError):
    """The camera gives no frame, or one of the wrong shape."""

    code = "E101"
    status = 503


class LateFrameError(CameraError):
    """The camera leaves out most of its frames."""

    code = "E102"


class TornFrameError(CameraError):
    """Frames are put together from two exposures, again and again."""

    code = "E103"


class CameraProcessError(CameraError):
    """The camera's process hung or died; it is started again a few times."""

    code = "E104"


class StaleFrameError(CameraError):
    """A frame shows the light from before it was changed, although it is said to have begun after that."""

    code = "E105"


class LightError(DeviceError):
    """The LED chip does not answer, or does not hold what was written."""

    code = "E201"
    status = 503


class LightBusError(LightError):
    """The I2C bus is stuck: a line is held low."""

    code = "E202"


class DarkSideError(LightError):
    """A side gives no light although its register is set."""

    code = "E203"


class StuckLightError(LightError):
    """A side shines although its register is off."""

    code = "E204"


class AmbientLightError(LightError):
    """Foreign light reaches the camera."""

    code = "E205"


class DimLightError(LightError):
    """A side is dimmer than it was; the measurement stands, since its reference is dimmer by the same ratio."""

    code = "E206"
    severity = "warning"


class OpenLedError(LightError):
    """No current flows through the LED of a side although its output is on."""

    code = "E207"


class HotLedDriverError(LightError):
    """The LED chip has switched off because it is too hot, or none of the sides is connected."""

    code = "E208"


class LightBudgetError(LightError):
    """The light was on for too long in one press; it goes off, and the next press may begin."""

    code = "E209"


class LoadCellError(DeviceError):
    """The load cell is silent."""

    code = "E301"
    status = 503


class UnreadableCellError(LoadCellError):
    """The load cell's lines cannot be read."""

    code = "E302"


class SaturatedCellError(LoadCellError):
    """The load cell's amplifier is at the end of its range: too much force, or a wire is off."""

    code = "E303"


class UnpluggedCellError(LoadCellError):
    """The load cell's serial line is gone, or was never there."""

    code = "E304"


class OverloadedCellError(LoadCellError):
    """The load cell carries more than it bears, from its zero at commissioning."""

    code = "E305"


class ZeroShiftError(LoadCellError):
    """The load cell's zero is far from that of commissioning: under load at the start, or bent."""

    code = "E306"


class DetachedCellError(LoadCellError):
    """The load cell's amplifier answers, but no bridge is behind it: a plug is off or a gauge is broken."""

    code = "E307"


class ModelError(DeviceError):
    """A model bundle or calibration is missing, tampered with, or not made for this probe."""

    code = "E401"
    status = 503


class NoContrastError(DeviceError):
    """Pressing does not change the image; it ends this press, not the probe's readiness."""

    code = "E501"
    status = 422


class StorageError(DeviceError):
    """A measurement could not be made durable."""

    code = "E601"
    status = 507


class DiskFullError(StorageError):
    """There is no space left for a measurement."""

    code = "E602"


class ClockJumpError(DeviceError):
    """The wall clock was set; what is measured runs on the monotonic clock, but `taken_at` may be wrong."""

    code = "E701"
    severity = "warning"


class BusyError(DeviceError):
    """A press is already under way."""

    code = "E801"
    status = 409


class UnknownResource(DeviceError):  # noqa: N818 - the name is what the caller reads
    """No press or measurement of that id."""

    code = "E802"
    status = 404


class ModeUnavailable(DeviceError):  # noqa: N818 - the name is what the caller reads
    """A press was asked for in a mode for which this probe has no model."""

    code = "E805"
    status = 422
