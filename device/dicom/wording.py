"""A measurement in words: rows in ASCII below the picture, which every viewer shows, and remarks for both objects."""

from __future__ import annotations

from textwrap import wrap
from typing import Any

from device.measurement.quantities import unit_of
from device.measurement.shown_quantity import shown_interval, shown_value

NAMES = {"size_mm": "Size", "depth_mm": "Depth of top", "youngs_modulus_kpa": "Young's modulus"}
NOT_A_DIAGNOSIS = "Documents size, depth and modulus. Not a diagnosis."
SIMULATED = "Simulated press: no tissue was touched."
ROW_LENGTH = 60
"""Characters of a row below the picture: about as wide as the picture itself."""


def is_determined(quantity: dict[str, Any]) -> bool:
    """Return whether a press determines an unknown, so that its number may be shown."""
    return bool(quantity["identifiable"]) and all(quantity[one] is not None for one in ("value", "low", "high"))


def spoken_quantity(name: str, quantity: dict[str, Any]) -> str:
    """Return one unknown of an estimate: its value, and its 90 % interval, which an open end leaves open."""
    if not is_determined(quantity):
        return f"{NAMES[name]}: not determined"
    return f"{NAMES[name]}: {shown_value(quantity)} {unit_of(name)} (90 %: {shown_interval(name, quantity)})"


def remarks(measurement: dict[str, Any], *, simulated: bool) -> list[str]:
    """Return what the numbers alone do not say: simulation, the reason, and what was noticed."""
    said = [SIMULATED if simulated else "", measurement["estimate"]["reason"]]
    return [one for one in said if one] + [f"{one['title']}: {one['cause']}" for one in _told(measurement)]


def _told(measurement: dict[str, Any]) -> list[dict[str, str]]:
    """Return the warnings of a measurement that say what they are."""
    return [one for one in measurement["warnings"] if {"title", "cause"} <= one.keys()]


def rows(measurement: dict[str, Any], *, simulated: bool, phantom: bool) -> list[str]:
    """Return what stands below the picture; nothing in it tells who the patient is."""
    estimate = measurement["estimate"]
    of_what = "SIMULATED PRESS." if simulated else "PHANTOM." if phantom else ""
    said = [
        *(spoken_quantity(name, estimate[name]) for name in NAMES),
        estimate["reason"],
        *(f"{one['title']}." for one in _told(measurement)),
        of_what,
        NOT_A_DIAGNOSIS,
    ]
    return [row for one in said for row in wrap(in_ascii(one), ROW_LENGTH)]


def in_ascii(text: str) -> str:
    """Return text as it can be drawn below the picture: the drawn letters are those of ASCII."""
    return text.encode("ascii", "replace").decode("ascii")
