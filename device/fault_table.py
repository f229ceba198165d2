"""The classes of device/errors.py to one table: every fault with its code, title, part, meaning, severity and status.

The code is the contract: a client may rely on it, a title or meaning may be worded anew.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

from device.errors import DeviceError


@dataclass(frozen=True)
class FaultEntry:
    """One row: what the screen calls the fault, what it means, and the HTTP status it is answered with."""

    code: str
    title: str
    part: str
    meaning: str
    severity: str
    is_lasting: bool
    status: int

    def as_record(self) -> dict[str, Any]:
        """Return the row as JSON object."""
        return asdict(self)


def _row(kind: type[DeviceError]) -> FaultEntry:
    return FaultEntry(kind.code, kind.title, kind.part(), kind.meaning(), kind.severity, kind.is_lasting, kind.status)


FAULTS = tuple(_row(kind) for _, kind in sorted(DeviceError.by_code.items()))
"""Every fault, by growing code."""

FaultCode = StrEnum("FaultCode", [(fault.code, fault.code) for fault in FAULTS])  # type: ignore[misc]
"""Every code, as the API's schema lists them. (The type check cannot see members that a table makes.)"""
