"""The parts of a probe as they open: every one that fails is listed, with its fault, and what had opened is closed."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import TypeVar

from device.errors import DeviceError, ModelError
from device.measurement.bundle import BundleRefused
from device.measurement.quantities import InvalidQuantity

OpenedPart = TypeVar("OpenedPart")


class StartFailed(Exception):  # noqa: N818 - reads as what happened
    """Parts that did not open, each with code, cause and remedy."""

    def __init__(self, faults: list[DeviceError]) -> None:
        """Take every fault."""
        self.faults = faults
        super().__init__("\n".join(f"{fault.code} {fault}" for fault in faults))


class OpenedParts:
    """Opens parts one by one, remembers what failed, and closes the others when anything did."""

    def __init__(self) -> None:
        """Begin with nothing opened; `faults` are those found so far, `opened` closes what they leave open."""
        self.faults: list[DeviceError] = []
        self.opened = ExitStack()
        self._is_complete = True

    def open(
        self, opener: Callable[[], OpenedPart], *, refused_as: type[DeviceError] = ModelError
    ) -> OpenedPart | None:
        """Return the part that an opener returns, or None and remember the fault when it raises one.

        What it refuses is a fault of a model unless told otherwise.
        """
        try:
            part = opener()
        except DeviceError as error:
            self._fail(error)
        except (InvalidQuantity, BundleRefused) as error:
            self._fail(refused_as(str(error), "Then start again."))
        else:
            if hasattr(part, "close"):
                self.opened.callback(part.close)
            return part
        return None

    def _fail(self, fault: DeviceError) -> None:
        self.faults.append(fault)
        self._is_complete = False

    def require_all(self) -> None:
        """Close every part and raise `StartFailed` with all faults when one did not open."""
        if not self._is_complete:
            self.opened.close()
            raise StartFailed(self.faults)
