"""The certificates of a probe in one folder, ID.json each, and beside them the pointer: the id of the active one.

A certificate is never written again; activating another writes the pointer only, whole or not at all. The setting
`calibration` may also name one file, which is then the only certificate, and active.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.errors import MissingCalibration
from device.files.certificate_file import read_calibration
from device.files.durable import write_durably
from device.measurement.calibration import Calibration
from device.measurement.quantities import InvalidQuantity

POINTER = "active"
SUFFIX = ".json"
CHOOSE = "See `python -m device calibration list`, and activate one of those."


@dataclass(frozen=True)
class Entry:
    """One certificate by its id, or the name of its file and what is wrong with it."""

    name: str
    calibration: Calibration | None
    problem: str = ""

    def as_record(self) -> dict[str, Any]:
        """Return what is known of it as JSON object."""
        return {**(self.calibration.summary() if self.calibration else {}), "problem": self.problem}


class Calibrations:
    """What the setting `calibration` points at."""

    def __init__(self, path: Path) -> None:
        """Take a folder of certificates, or one certificate, NAME.json."""
        self.path, self.is_folder = path, path.suffix != SUFFIX

    def active_name(self) -> str | None:
        """Return the id of the active certificate, None when none was ever activated.

        Raises `MissingCalibration` when the folder or the pointer cannot be read.
        """
        if not self.is_folder:
            return self.all()[0].name
        if not self.path.is_dir():
            cause = f"The folder of calibrations {self.path} is not there."
            raise MissingCalibration(cause, "Correct the setting `calibration`, or make the folder.")
        try:
            return (self.path / POINTER).read_text(encoding="utf-8").strip()
        except FileNotFoundError:
            return None
        except (OSError, UnicodeDecodeError) as error:
            cause = f"The pointer to the active calibration {self.path / POINTER} cannot be read: {error}."
            raise MissingCalibration(cause, CHOOSE) from error

    def active(self) -> Calibration | None:
        """Return the active certificate, None when none was ever activated.

        Raises `MissingCalibration` when the one that is named is not there or was changed.
        """
        if not self.is_folder:
            return _certificate(self.path)
        name = self.active_name()
        return self.read(name) if name is not None else None

    def read(self, name: str) -> Calibration:
        """Return the certificate of an id; raise `MissingCalibration` when it is not there or was changed."""
        file = self._file(name) if self.is_folder else self.path
        calibration = _certificate(file)
        if calibration.id != name:
            raise MissingCalibration(f"The certificate in {file} is {calibration.id}, not {name}.", CHOOSE)
        return calibration

    def all(self) -> list[Entry]:
        """Return every certificate there is, in the order of the files' names, unreadable ones with their problem."""
        files = sorted(self.path.glob(f"*{SUFFIX}")) if self.is_folder else [self.path]
        return [self._entry(file) for file in files]

    def activate(self, name: str) -> None:
        """Make a certificate the one that the next start uses; raise `MissingCalibration` when it cannot be read."""
        if not self.is_folder:
            cause = f"The setting `calibration` names one certificate, {self.path}: there is no other to activate."
            raise MissingCalibration(cause, "Let it name a folder of certificates.")
        self.read(name)
        write_durably(self.path / POINTER, f"{name}\n".encode())

    def _entry(self, file: Path) -> Entry:
        try:
            calibration = self.read(file.stem) if self.is_folder else _certificate(file)
        except MissingCalibration as error:
            return Entry(file.stem, None, error.cause)
        return Entry(calibration.id, calibration)

    def _file(self, name: str) -> Path:
        if not name or Path(name).name != name:
            raise MissingCalibration(f"{name!r} is no certificate's id.", CHOOSE)
        return self.path / f"{name}{SUFFIX}"


def _certificate(file: Path) -> Calibration:
    try:
        return read_calibration(file)
    except InvalidQuantity as error:
        raise MissingCalibration(str(error), CHOOSE) from error
