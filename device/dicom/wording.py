"""A measurement's numbers in words and ASCII, for what every viewer shows: the rows below the picture."""

from __future__ import annotations

from typing import Any

from device.measurement.quantities import unit_of
from device.measurement.shown_quantity import shown_interval, shown_value

NAMES = {"size_mm": "Size", "depth_mm": "Depth of top", "youngs_modulus_kpa": "Young's modulus"}
NOT_A_DIAGNOSIS = "Documents size, depth and modulus. Not a diagnosis."


def is_determined(quantity: dict[str, Any]) -> bool:
    """Return whether a press determines an unknown, so that its number may be shown."""
    return bool(quantity["identifiable"]) and quantity["value"] is not None


def has_open_end(quantity: dict[str, Any]) -> bool:
    """Return whether an unknown that is determined may lie beyond an end of its interval, where nothing was tried."""
    return is_determined(quantity) and bool(quantity.get("low_is_open") or quantity.get("high_is_open"))


def spoken_quantity(name: str, quantity: dict[str, Any]) -> str:
    """Return one unknown of an estimate: its value, and its 90 % interval, which an open end leaves open."""
    if not is_determined(quantity):
        return f"{NAMES[name]}: not determined"
    return f"{NAMES[name]}: {shown_value(quantity)} {unit_of(name)} (90 %: {shown_interval(name, quantity)})"


def rows(measurement: dict[str, Any], *, simulated: bool, phantom: bool) -> list[str]:
    """Return what stands below the picture; nothing in it tells who the patient is."""
    estimate = measurement["estimate"]
    of_what = "SIMULATED PRESS. " if simulated else "PHANTOM. " if phantom else ""
    return [
        *(spoken_quantity(name, estimate[name]) for name in NAMES),
        f"{of_what}{NOT_A_DIAGNOSIS}",
    ]
