"""The daemon's errors: each class one fault, and the only place where its code, title, meaning and status are written.

The first sentence of a class's docstring is the fault's meaning. docs/faults.md, the screen's headings and the codes in
the API's schema are made from these classes (device/fault_table.py); docs/simulated_probe.md says how a fault is
provoked.
"""

from __future__ import annotations

from typing import Any, ClassVar, Literal

PARTS = {
    "0": "Settings and daemon",
    "1": "Camera",
    "2": "Light",
    "3": "Load cell",
    "4": "Model",
    "5": "Press",
    "6": "Storage",
    "7": "Clock",
    "8": "Request",
    "9": "Watchdog",
}
"""The part that a fault names: its code's hundred."""


class DeviceError(Exception):
    """The daemon itself failed: its port is in use, or something that nobody foresaw."""

    code = "E000"
    title = "The daemon failed"
    status = 500
    severity: Literal["fault", "warning"] = "fault"
    is_lasting = False
    """Whether a warning is true as long as the daemon runs, not of one press only."""
    wait_s: int | None = None
    """In how many seconds it is over by itself, where that is known."""

    by_code: ClassVar[dict[str, type[DeviceError]]] = {}
    """Every fault there is."""

    def __init_subclass__(cls, **keywords: Any) -> None:
        """Take a fault into the table; raise `TypeError` for one without a code and a title of its own."""
        super().__init_subclass__(**keywords)
        cls._require_entry()
        cls.by_code[cls.code] = cls

    def __init__(self, cause: str, remedy: str) -> None:
        """Take what happened, and what the operator or maintainer can do about it, each a sentence."""
        self.cause, self.remedy = cause, remedy
        super().__init__(f"{cause} {remedy}")

    def __reduce__(self) -> tuple[type[DeviceError], tuple[str, str]]:
        """Carry the error to another process: an exception alone forgets what it was made of."""
        return type(self), (self.cause, self.remedy)

    def as_record(self) -> dict[str, str]:
        """Return the error as the JSON object of the status and of a press."""
        told = {"cause": self.cause, "remedy": self.remedy}
        return {"code": self.code, "title": self.title, "severity": self.severity, **told}

    @classmethod
    def part(cls) -> str:
        """Return the part that the fault names."""
        return PARTS[cls.code[1]]

    @classmethod
    def meaning(cls) -> str:
        """Return the fault in one sentence."""
        return (cls.__doc__ or "").split("\n\n")[0].replace("\n    ", " ")

    @classmethod
    def _require_entry(cls) -> None:
        for name in ("code", "title", "__doc__"):
            if not vars(cls).get(name):
                raise TypeError(f"{cls.__name__} has no {name} of its own: every fault has code, title and docstring.")
        if other := cls.by_code.get(cls.code):
            raise TypeError(f"{cls.__name__} has the code {cls.code} of {other.__name__}: choose one that is free.")
        if not (len(cls.code) == 4 and cls.code[0] == "E" and cls.code[1:].isdigit() and cls.code[1] in PARTS):
            raise TypeError(f"{cls.__name__} has the code {cls.code!r}: E and three digits, the first one of PARTS.")


DeviceError.by_code[DeviceError.code] = DeviceError


class ConfigError(DeviceError):
    """A setting is missing, unknown or out of its bound."""

    code = "E001"
    title = "Settings refused"


class LastGoodConfigError(ConfigError):
    """The settings files are bad; the probe runs on those with which it last started well."""

    code = "E002"
    title = "Old settings in use"
    severity = "warning"
    is_lasting = True


class UntrustedRelease(DeviceError):  # noqa: N818 - the name is what the operator reads
    """A release file is damaged, was cut off while it was copied, or is not signed by a key that this probe trusts."""

    code = "E010"
    title = "Release damaged or not signed"
    status = 422


class UnfitRelease(DeviceError):  # noqa: N818 - the name is what the operator reads
    """A release is not for this probe: another product, machine or data, older than what ran here, or known as bad."""

    code = "E011"
    title = "Release does not fit"
    status = 422


class UpdateFailed(DeviceError):  # noqa: N818 - the name is what the operator reads
    """A step of an update failed; the release that ran before still does."""

    code = "E012"
    title = "Update failed"


class RolledBack(DeviceError):  # noqa: N818 - the name is what the operator reads
    """A release did not work on this probe and the one before is back; shown until another one is installed."""

    code = "E013"
    title = "Update taken back"
    severity = "warning"
    is_lasting = True


class SupplyLowError(DeviceError):
    """The computer's supply voltage is too low, or was for a moment; LEDs and camera may not do what they are told."""

    code = "E015"
    title = "Supply voltage too low"
    status = 503
    severity = "warning"


class ComputerHotError(DeviceError):
    """The probe's computer is so hot that it slows itself down."""

    code = "E016"
    title = "Computer too hot"
    status = 503
    severity = "warning"


class AuditChanged(DeviceError):  # noqa: N818 - the name is what the operator reads
    """An entry of the audit was changed or removed by another program than the probe's; the probe still measures."""

    code = "E020"
    title = "Audit was changed"
    severity = "warning"
    is_lasting = True


class CertificateRefused(DeviceError):  # noqa: N818 - the name is what the operator reads
    """A certificate or key for other machines cannot be read, made or used: only the probe's own screen is served."""

    code = "E021"
    title = "Server certificate refused"
    severity = "warning"
    is_lasting = True


class CertificateEnds(DeviceError):  # noqa: N818 - the name is what the operator reads
    """A certificate of the settings ends within a month, has ended or is not valid yet: it is then refused."""

    code = "E022"
    title = "Certificate ends or is not valid"
    severity = "warning"


class ArchiveUnreachable(DeviceError):  # noqa: N818 - the name is what the operator reads
    """The hospital's archive or worklist does not answer; results wait on the probe and are sent when it does."""

    code = "E030"
    title = "Archive not reached"
    status = 502
    severity = "warning"


class ArchiveRefuses(DeviceError):  # noqa: N818 - the name is what the operator reads
    """The hospital's archive has refused results; they are kept on the probe until somebody sends them again."""

    code = "E031"
    title = "Archive refuses results"
    status = 502
    severity = "warning"


class WebhookFailed(DeviceError):  # noqa: N818 - the name is what the operator reads
    """The hospital's address for notices does not take them; they wait on the probe and are sent when it does."""

    code = "E032"
    title = "Notices not taken"
    status = 502
    severity = "warning"


class CameraError(DeviceError):
    """The camera gives no image, or one of the wrong shape."""

    code = "E101"
    title = "No camera image"
    status = 503


class LateFrameError(CameraError):
    """The camera leaves out most of its images."""

    code = "E102"
    title = "Camera leaves out images"


class TornFrameError(CameraError):
    """Images are put together from two exposures again and again, or one was overwritten before it was read."""

    code = "E103"
    title = "Torn images"


class CameraProcessError(CameraError):
    """The camera's process hung or died; it is started again a few times."""

    code = "E104"
    title = "Camera process ended"


class StaleFrameError(CameraError):
    """The camera gives an image from before the light was changed as if it had been taken after that."""

    code = "E105"
    title = "Old image"


class LightError(DeviceError):
    """The LED chip does not answer, or does not hold what was written."""

    code = "E201"
    title = "LED chip does not answer"
    status = 503


class LightBusError(LightError):
    """The I2C bus is stuck: a line is held low."""

    code = "E202"
    title = "I2C bus stuck"


class DarkSideError(LightError):
    """A side gives no light although its register is set."""

    code = "E203"
    title = "A side is dark"


class StuckLightError(LightError):
    """A side shines although its register is off."""

    code = "E204"
    title = "A side does not go off"


class AmbientLightError(LightError):
    """Foreign light reaches the camera."""

    code = "E205"
    title = "Foreign light"


class DimLightError(LightError):
    """A side is dimmer than it was; the measurement stands, since its reference is dimmer by the same ratio."""

    code = "E206"
    title = "Light is dimmer"
    severity = "warning"


class OpenLedError(LightError):
    """No current flows through the LED of a side although its output is on."""

    code = "E207"
    title = "LED without current"


class HotLedDriverError(LightError):
    """The LED chip has switched off because it is too hot, or none of the sides is connected."""

    code = "E208"
    title = "LED chip hot or unplugged"


class LightBudgetError(LightError):
    """The light was on for too long over the last presses; it goes off, and the press ends."""

    code = "E209"
    title = "Light on for too long"


class LightLimitError(LightError):
    """A side is as bright or dim as it can be and yet does not give its share of light; the measurement stands."""

    code = "E210"
    title = "Light at its limit"
    severity = "warning"


class LightRestError(LightError):
    """The light was on for so long over the last presses that none may begin; it passes by itself."""

    code = "E211"
    title = "Light must rest"


class LightCutError(LightError):
    """The enable line took the light away in a press: loop, bus or camera came to a stop, or the line's keeper did."""

    code = "E212"
    title = "Light was cut"


class LightLineError(LightError):
    """The line that enables the LEDs cannot be driven, or the LED chip does not obey it."""

    code = "E213"
    title = "Enable line does not work"


class LoadCellError(DeviceError):
    """The load cell is silent."""

    code = "E301"
    title = "Load cell silent"
    status = 503


class UnreadableCellError(LoadCellError):
    """The load cell's lines cannot be read."""

    code = "E302"
    title = "Load cell unreadable"


class SaturatedCellError(LoadCellError):
    """The load cell's amplifier is at the end of its range: too much force, or a wire is off."""

    code = "E303"
    title = "Load cell saturated"


class UnpluggedCellError(LoadCellError):
    """The load cell's serial line is gone, or was never there."""

    code = "E304"
    title = "Load cell unplugged"


class OverloadedCellError(LoadCellError):
    """The load cell carries more than it bears, from its zero at commissioning."""

    code = "E305"
    title = "Load cell overloaded"


class ZeroShiftError(LoadCellError):
    """The load cell's zero is far from that of commissioning, as of a bent cell, or was taken under a load."""

    code = "E306"
    title = "Load cell's zero has moved"


class DetachedCellError(LoadCellError):
    """The load cell's amplifier answers, but no bridge is behind it: a plug is off or a gauge is broken."""

    code = "E307"
    title = "Load cell detached"


class UnsteadyTareError(LoadCellError):
    """The load cell's readings vary while its zero is taken: the probe is held, or something touches it."""

    code = "E308"
    title = "Zero not taken"


class ZeroOffWarning(LoadCellError):  # noqa: N818 - the name is what the operator reads
    """The load cell does not read zero unloaded, by less than a touch; the probe still measures."""

    code = "E309"
    title = "Zero is off"
    severity = "warning"
    is_lasting = True


class SlowCellError(LoadCellError):
    """The load cell's amplifier gives too few readings a second to say what the force was at a frame."""

    code = "E310"
    title = "Load cell too slow"


class ModelError(DeviceError):
    """A model bundle is missing, tampered with, not made for this probe, or not together with its other models."""

    code = "E401"
    title = "Model refused"
    status = 503


class MissingCalibration(ModelError):  # noqa: N818 - the name is what the operator reads
    """No calibration certificate is active, or the one that is named is not there or was changed."""

    code = "E402"
    title = "Not calibrated"


class ForeignCalibration(ModelError):  # noqa: N818 - the name is what the operator reads
    """The calibration is for another probe, model, pixel size, exposure, force or load cell."""

    code = "E403"
    title = "Calibration of another probe"


class ExpiredCalibration(ModelError):  # noqa: N818 - the name is what the operator reads
    """The calibration has expired; nothing is measured until another is activated."""

    code = "E404"
    title = "Calibration has expired"


class SlightDriftError(ModelError):
    """The untouched face looks slightly different from the calibration's; the probe still measures."""

    code = "E405"
    title = "Face has changed slightly"
    severity = "warning"
    is_lasting = True


class LargeDriftError(ModelError):
    """The untouched face looks so different from the calibration's that the probe does not measure."""

    code = "E406"
    title = "Face has changed too much"


class CalibrationEndsSoon(ModelError):  # noqa: N818 - the name is what the operator reads
    """The calibration expires within a month."""

    code = "E407"
    title = "Calibration expires soon"
    severity = "warning"
    is_lasting = True


class ClockBehindError(ModelError):
    """The clock shows a day before the calibration was made: nobody can tell whether that has expired."""

    code = "E408"
    title = "Clock before calibration"


class UncheckedCalibration(ModelError):  # noqa: N818 - the name is what the operator reads
    """The untouched face was not compared with the calibration's since the start; the probe still measures."""

    code = "E409"
    title = "Calibration not checked"
    severity = "warning"
    is_lasting = True


class NoContrastError(DeviceError):
    """Pressing does not change the image; it ends this press, not the probe's readiness."""

    code = "E501"
    title = "Image does not follow the press"
    status = 422


class StorageError(DeviceError):
    """A measurement could not be made durable."""

    code = "E601"
    title = "Not stored"
    status = 507


class DiskFullError(StorageError):
    """There is no space left for a measurement."""

    code = "E602"
    title = "Disk full"


class DamagedStoreError(StorageError):
    """The database of measurements is damaged; what can still be read is shown, and nothing is measured or changed."""

    code = "E603"
    title = "Measurements damaged"
    status = 500


class DamagedRecordingError(StorageError):
    """A recording is missing or is not as it was kept; it is not handed out, and the probe still measures."""

    code = "E604"
    title = "Recording damaged"
    status = 500
    severity = "warning"
    is_lasting = True


class OrphanedRecordings(StorageError):  # noqa: N818 - the name is what the operator reads
    """Recordings were found that belong to no measurement, as a kill in the middle of keeping one leaves them."""

    code = "E605"
    title = "Recordings set aside"
    severity = "warning"
    is_lasting = True


class StorageLowError(StorageError):
    """Little space is left; the probe measures on until there is none, and then refuses."""

    code = "E606"
    title = "Storage low"
    severity = "warning"
    is_lasting = True


class BackupOverdue(StorageError):  # noqa: N818 - the name is what the operator reads
    """Measurements have been in no backup for longer than `store.warn_unsaved_days`; a card that fails loses them."""

    code = "E607"
    title = "Backup overdue"
    severity = "warning"
    is_lasting = True


class NewerDataError(StorageError):
    """The data folder was written by a newer release than this one, which cannot read it."""

    code = "E014"
    title = "Data of a newer release"


class ClockJumpError(DeviceError):
    """The wall clock was set; what is measured runs on the monotonic clock, but `taken_at` may be wrong."""

    code = "E701"
    title = "Clock was set"
    severity = "warning"


class ClockNotSetError(DeviceError):
    """Nothing has set the wall clock since the computer was switched on; `taken_at` may be days or months old."""

    code = "E702"
    title = "Date not checked"
    severity = "warning"
    is_lasting = True


class BusyError(DeviceError):
    """A press, a self-test or an update is already under way."""

    code = "E801"
    title = "Busy"
    status = 409
    holder: dict[str, str | None] | None = None
    """Who has the probe, where that is known: `kind` press or self_test, its `id`, `mode` and `since`."""


class UnknownResource(DeviceError):  # noqa: N818 - the name is what the caller reads
    """No press or measurement of that id, or no self-test yet."""

    code = "E802"
    title = "Not found"
    status = 404


class InvalidRequest(DeviceError):  # noqa: N818 - the name is what the caller reads
    """The request is malformed: a field is unknown, missing or out of its bound."""

    code = "E803"
    title = "Request refused"
    status = 422


class UnknownPath(DeviceError):  # noqa: N818 - the name is what the caller reads
    """The API has no such path, or not with that method (405)."""

    code = "E804"
    title = "No such path"
    status = 404


class ModeUnavailable(DeviceError):  # noqa: N818 - the name is what the caller reads
    """A press was asked for in a mode for which this probe has no model."""

    code = "E805"
    title = "Mode not available"
    status = 422


class UnknownHost(DeviceError):  # noqa: N818 - the name is what the caller reads
    """The request was addressed to a name that is none of this probe's."""

    code = "E806"
    title = "Unknown host"
    status = 421


class ForeignRequest(DeviceError):  # noqa: N818 - the name is what the caller reads
    """A page of another origin asked, or another machine for what is done at the probe's own screen only."""

    code = "E807"
    title = "Asked from elsewhere"
    status = 403


class WrongContentType(DeviceError):  # noqa: N818 - the name is what the caller reads
    """A request that changes something must say that its body is JSON, or what else its path takes."""

    code = "E808"
    title = "Wrong content type"
    status = 415


class BodyTooLarge(DeviceError):  # noqa: N818 - the name is what the caller reads
    """The body of the request is larger than its path takes; it was not read."""

    code = "E809"
    title = "Body too large"
    status = 413


class ReusedKey(DeviceError):  # noqa: N818 - the name is what the caller reads
    """An Idempotency-Key came before with another request; that one was obeyed, and this one is not."""

    code = "E810"
    title = "Key used before"
    status = 409


class StaleVersion(DeviceError):  # noqa: N818 - the name is what the caller reads
    """An exam or a measurement was changed by somebody else since the client read it; it is left as it is."""

    code = "E811"
    title = "Changed meanwhile"
    status = 412


class NotSetUp(DeviceError):  # noqa: N818 - the name is what the caller reads
    """The request is right, but this probe is not set up for it: no archive, no worklist, no release to go back to."""

    code = "E812"
    title = "Not set up"
    status = 409


class DeletedRecording(DeviceError):  # noqa: N818 - the name is what the caller reads
    """A rule has deleted the recording, and with it the picture, the force curve and what is written as DICOM."""

    code = "E813"
    title = "Recording deleted"
    status = 410


class WorklistBusy(DeviceError):  # noqa: N818 - the name is what the caller reads
    """The hospital's worklist is asked twice at once, and no more; one that is silent is waited for up to a minute."""

    code = "E814"
    title = "Worklist is being asked"
    status = 503
    wait_s = 10
    """A worklist that answers has done so by then; of a silent one nobody knows."""


class ExamTooOld(DeviceError):  # noqa: N818 - the name is what the caller reads
    """The exam was begun more than 7 days ago: it takes no press any more, so that it gets none of another patient."""

    code = "E815"
    title = "Exam too old"
    status = 409


class ArchiveUntrusted(ArchiveUnreachable):
    """TLS with the hospital's archive or worklist fails, as for a certificate; results wait on the probe until then."""

    code = "E818"
    title = "No secure connection"


class TokenNeeded(DeviceError):  # noqa: N818 - the name is what the caller reads
    """Whoever asks from another machine needs a token, and sent none that holds."""

    code = "E820"
    title = "No valid token"
    status = 401


class ScopeNeeded(DeviceError):  # noqa: N818 - the name is what the caller reads
    """The token may not do this."""

    code = "E821"
    title = "Not allowed with this token"
    status = 403


class WrongCode(DeviceError):  # noqa: N818 - the name is what the caller reads
    """The pairing code is not the one on the probe's screen, or it has ended."""

    code = "E822"
    title = "Wrong pairing code"
    status = 403


class TooManyTries(DeviceError):  # noqa: N818 - the name is what the caller reads
    """A machine sent wrong codes or tokens too often, and has to wait; others need not."""

    code = "E823"
    title = "Too many wrong tries"
    status = 429
    wait_s = 60
    """After so long it may be tried again."""


class UnencryptedRequest(DeviceError):  # noqa: N818 - the name is what the caller reads
    """A request from another machine came without TLS; a token that it sent may have been read on its way."""

    code = "E824"
    title = "Not encrypted"
    status = 403


class StalledError(DeviceError):
    """A part makes no progress any more; under systemd its watchdog restarts the daemon."""

    code = "E901"
    title = "A part has stopped"
    status = 503


class RestartedError(DeviceError):
    """The watchdog has restarted the daemon; shown until a press has told of it."""

    code = "E902"
    title = "Restarted by itself"
    severity = "warning"


class UncleanEndError(DeviceError):
    """The daemon before did not end by a stop: a power cut, a freeze or a kill; shown until a press has told of it."""

    code = "E903"
    title = "Ended without a stop"
    severity = "warning"


class InterruptedPress(DeviceError):  # noqa: N818 - the name is what the operator reads
    """The daemon ended in the middle of a press: it was not measured; shown until a press has told of it."""

    code = "E904"
    title = "Press broken off"
    severity = "warning"
