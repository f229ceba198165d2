"""A calibration certificate: for which probe and until when it holds, and what the untouched probe showed.

`host_tools calibrate` makes one of phantoms with known inclusions, with the three lines that mode paper reads, for one
of its models. `host_tools commission` makes one without lines beside the bundle of a probe's own: its modes read none.

How long it holds counts from the phantoms' recordings, not from when it was computed: computing it again from old
recordings makes no probe younger. Simulated recordings are of 1970 by convention.
"""

from __future__ import annotations

import hashlib
import json
import re
import uuid
from collections.abc import Iterator, Mapping
from dataclasses import asdict, astuple, dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from device.measurement.bundle import ModelBundle
from device.measurement.paper_mode.lines import PaperLines, lines_of
from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.recording.camera_geometry import CameraGeometry
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.recording import CameraSettings, RecordedCell
from device.measurement.recording.untouched_face import UntouchedFace

VALID_DAYS = Bound(1, 36_500, "days")
"""A hundred years are for simulated probes, which do not age."""
SCHEMA = "tsis.calibration/2"
RENEW = "calibrate or commission the probe again"
"""Commissioning writes a certificate, too."""
SCALE_TOLERANCE = 1e-3
GEOMETRY_TOLERANCES = {"axis_x_mm": 0.05, "axis_y_mm": 0.05, "rim_distortion_percent": 0.3}
"""Some three times as far as a grid target is found apart from another (docs/own_probe.md, the twenty worlds)."""
EXPOSURE_TOLERANCE = 0.02
"""Relative, of exposure times gain: dividing by the reference takes it out of the image, not out of the drift."""
TEXTS = ("id", "made_at", "operator", "serial", "phantom_serial", "software", "software_sha256")


@dataclass(frozen=True)
class Validity:
    """When the first phantom was recorded, and the moment after which the calibration does not hold."""

    measured_at: str
    expires_at: str

    def __post_init__(self) -> None:
        measured, expires = (moment(getattr(self, name), name) for name in ("measured_at", "expires_at"))
        if not expires > measured:
            raise InvalidQuantity("expires_at", self.expires_at, f"after {self.measured_at}", RENEW)

    @classmethod
    def of(cls, measured_at: str, valid_days: float) -> Validity:
        """Return the validity of so many days from a moment; raises `InvalidQuantity` outside `VALID_DAYS`."""
        require("valid_days", valid_days, VALID_DAYS, "state for how long the probe may be trusted")
        begin = moment(measured_at, "measured_at")
        return cls(written(begin), written(begin + timedelta(days=valid_days)))

    def days_left(self, at: str) -> float:
        """Return the days from a moment (RFC 3339) until the calibration expires, negative after that."""
        return days_between(at, self.expires_at)

    def is_before(self, at: str) -> bool:
        """Return whether a moment lies before the phantoms were recorded: then its clock is wrong."""
        return moment(at, "time") < moment(self.measured_at, "measured_at")


def moment(text: str, name: str) -> datetime:
    """Return a time of RFC 3339 with its zone; raise `InvalidQuantity` for anything else."""
    try:
        parsed = datetime.fromisoformat(text)
    except (TypeError, ValueError) as error:
        raise InvalidQuantity(name, repr(text), "a time of RFC 3339", RENEW) from error
    if parsed.tzinfo is None:
        raise InvalidQuantity(name, repr(text), "a time with its zone, as 2027-01-31T12:00:00Z", RENEW)
    return parsed


def days_between(at: str, end: str) -> float:
    """Return the days from one moment (RFC 3339) to another."""
    return (moment(end, "expires_at") - moment(at, "time")) / timedelta(days=1)


def written(at: datetime) -> str:
    """Return a moment as RFC 3339 in UTC, to a second."""
    return at.astimezone(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")


@dataclass(frozen=True)
class Calibration:
    """What holds for one probe: validity, camera, load cell, untouched face, and the `lines` of mode paper, or None.

    `flat_field_ratio`: by how much the light of two presses on one bare block differs smoothly; None where nobody
    pressed any. `id` follows from all else but `made_at`; `software_sha256` is over the sources that computed it.
    """

    id: str
    made_at: str
    validity: Validity
    operator: str
    serial: str
    phantom_serial: str
    camera: CameraSettings
    cell: RecordedCell
    untouched: UntouchedFace
    phantoms: int
    software: str
    software_sha256: str
    simulated: bool
    lines: PaperLines | None = None
    flat_field_ratio: float | None = None

    def __post_init__(self) -> None:
        for name in TEXTS:
            value = getattr(self, name)
            if not isinstance(value, str):
                raise InvalidQuantity(name, repr(value), "text", RENEW)
        if self.flat_field_ratio is not None:
            require("flat_field_ratio", self.flat_field_ratio, Bound(0.0, 1.0, ""), RENEW)

    @property
    def paper_lines(self) -> PaperLines:
        """The lines of mode paper; raises `InvalidQuantity` for a certificate without them."""
        if self.lines is None:
            action = "press in mode standard, or make them with `host_tools calibrate`"
            raise InvalidQuantity("calibration", "without the lines of mode paper", "one with them", action)
        return self.lines

    @property
    def scale(self) -> PixelScale:
        """Size of a pixel on the face."""
        return self.camera.scale

    def require_for(self, serial: str, bundle: ModelBundle) -> None:
        """Raise `InvalidQuantity` when the certificate is for another probe or another model."""
        for problem in self.foreign(serial, bundle):
            raise problem

    def foreign(self, serial: str, bundle: ModelBundle) -> Iterator[InvalidQuantity]:
        """Yield what says that the certificate is for another probe, or its lines for another model of mode paper."""
        if self.lines:
            yield from self.lines.foreign(bundle)
        if self.serial != serial:
            found, expected = f"for probe {self.serial}", f"for probe {serial}"
            yield InvalidQuantity("calibration", found, expected, "use the probe's own certificate")

    def require_scale(self, scale: PixelScale) -> None:
        """Raise `InvalidQuantity` when frames are of another pixel size than the certificate's."""
        for problem in self._other_scale(scale):
            raise problem

    def other_settings(
        self, geometry: CameraGeometry, *, exposure_us: float, gain: float, cell_counts_per_n: float
    ) -> Iterator[InvalidQuantity]:
        """Yield the settings of a probe that are not those of its calibration, each with the value it had there.

        Axis and distortion count where there are no lines: the modes that are commissioned undo them in the image.
        """
        yield from self._other_scale(geometry.scale)
        for name, tolerance in {} if self.lines else GEOMETRY_TOLERANCES.items():
            found, ours = getattr(geometry, name), getattr(self.camera, name)
            if abs(found - ours) > tolerance:
                bound = f"{ours:g} as commissioned, within {tolerance:g}"
                yield InvalidQuantity(f"camera.{name}", f"{found:g}", bound, "set it, or commission the probe again")
        gathered, ours = exposure_us * gain, self.camera.exposure_us * self.camera.gain
        if abs(gathered - ours) > EXPOSURE_TOLERANCE * ours:
            bound = f"{ours:g} us as calibrated, within {EXPOSURE_TOLERANCE:.0%}"
            yield InvalidQuantity(
                "camera.exposure_us times camera.gain", f"{gathered:g} us", bound, f"set it, or {RENEW}"
            )
        if abs(cell_counts_per_n - self.cell.counts_per_n) > SCALE_TOLERANCE * self.cell.counts_per_n:
            found, bound = f"{cell_counts_per_n:g}", f"{self.cell.counts_per_n:g} counts/N as calibrated"
            yield InvalidQuantity("cell.sensitivity_counts_per_n", found, bound, f"set it, or {RENEW}")

    def _other_scale(self, scale: PixelScale) -> Iterator[InvalidQuantity]:
        ours, theirs = astuple(self.scale), astuple(scale)
        if not np.allclose(ours, theirs, rtol=SCALE_TOLERANCE):
            yield InvalidQuantity("mm_per_px_x, mm_per_px_y", theirs, f"{ours} as calibrated", RENEW)

    def summary(self) -> dict[str, Any]:
        """Return the certificate as JSON object without the held-out scenes."""
        record = {name: value for name, value in _content(self).items() if name != "held_out"}
        return {"schema": SCHEMA, **record, "is_drift_resolved": self.untouched.is_resolved}

    def to_json(self) -> str:
        """Return the certificate as JSON text, with a hash of its content."""
        record = _content(self)
        rows_on_one_line = re.compile(r"\[\s+([-\d.e,\s]+?)\s+\]")
        text = json.dumps({"schema": SCHEMA, "sha256": _sha256(record), **record}, indent=1)
        return rows_on_one_line.sub(lambda row: f"[{' '.join(row[1].split())}]", text) + "\n"


def certificate_id(calibration: Calibration) -> str:
    """Return the id of a certificate's content: the same for the same recordings, operator, validity and software."""
    content = {name: value for name, value in _content(calibration).items() if name not in ("id", "made_at")}
    return str(uuid.uuid5(uuid.NAMESPACE_OID, _sha256(content)))


def _content(calibration: Calibration) -> dict[str, Any]:
    """Return all that a certificate says as JSON object; its lines stand beside the rest."""
    record = asdict(calibration) | {"camera": calibration.camera.as_record()}
    del record["lines"]
    if calibration.flat_field_ratio is None:
        del record["flat_field_ratio"]
    return record | (calibration.lines.as_record() if calibration.lines else {})


def _sha256(record: Mapping[str, Any]) -> str:
    """Return the hash of what a JSON object says, however it is written."""
    return hashlib.sha256(json.dumps(record, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def calibration_of(content: bytes, path: Path) -> Calibration:
    """Return the certificate of a file's content; raise `InvalidQuantity` naming the first thing that is wrong with it.

    `path` is named in refusals. The hash tells a file that was damaged or edited; it is no signature.
    """
    record = _record(content, path)
    try:
        for name, kind in (("validity", Validity), ("camera", CameraSettings), ("cell", RecordedCell)):
            record[name] = kind(**record[name])
        face: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in record["untouched"].items()}
        record["untouched"] = UntouchedFace(**face)
        lines = lines_of(record)
        return Calibration(**record, lines=lines)
    except InvalidQuantity:
        raise
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InvalidQuantity("calibration", path, "a complete certificate", f"{RENEW} ({error})") from error


def _record(content: bytes, path: Path) -> dict[str, Any]:
    """Return what the file says, without schema and hash, once both hold."""
    try:
        record: Any = json.loads(content)
    except ValueError as error:
        raise InvalidQuantity("calibration", path, "a readable certificate", f"{RENEW} ({error})") from error
    schema = record.pop("schema", None) if isinstance(record, dict) else None
    if schema != SCHEMA:
        raise InvalidQuantity("calibration schema", f"{schema} in {path}", SCHEMA, RENEW)
    stated = record.pop("sha256", None)
    if stated != (found := _sha256(record)):
        action = f"restore the file as it was written, or {RENEW}"
        raise InvalidQuantity("calibration sha256", f"{found[:12]} in {path}", f"{str(stated)[:12]} as stated", action)
    return dict(record)
