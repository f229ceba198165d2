"""Quantities and their refusals: a number outside its bound becomes one clear sentence.

The three unknowns are the *diameter* of the inclusion, the depth of its *top* below the undeformed surface (not of
its centre), and its Young's modulus (not its stiffness). Source: Lee & Won, IEEE JBHI 17(2), 2013, section II.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from typing import Any

UNKNOWNS = ("size_mm", "depth_mm", "youngs_modulus_kpa")
"""Order of the unknowns in every array of estimates or truths."""


class InvalidQuantity(ValueError):  # noqa: N818 - reads as what it says: this quantity is invalid
    """A value that cannot be used; says which quantity, its value, the bound and what to do."""

    def __init__(self, quantity: str, value: object, bound: str, action: str) -> None:
        self.quantity, self.value, self.bound, self.action = quantity, value, bound, action
        super().__init__(f"{quantity} is {value}, but must be {bound}: {action}.")

    def __reduce__(self) -> tuple[type[InvalidQuantity], tuple[str, object, str, str]]:
        """Carry the error to another process: an exception alone forgets what it was made of."""
        return type(self), (self.quantity, self.value, self.bound, self.action)


@dataclass(frozen=True)
class Bound:
    """Range of one quantity, closed or open at either end, with its unit."""

    low: float
    high: float
    unit: str
    low_included: bool = True
    high_included: bool = True

    def __str__(self) -> str:
        low = "at least" if self.low_included else "above"
        if math.isinf(self.high):
            return f"{low} {self.low:g} {self.unit}".strip()
        high = "at most" if self.high_included else "below"
        if math.isinf(self.low):
            return f"{high} {self.high:g} {self.unit}".strip()
        return f"{low} {self.low:g} and {high} {self.high:g} {self.unit}".strip()

    def holds(self, value: float) -> bool:
        """Return whether a finite value lies inside."""
        above = value >= self.low if self.low_included else value > self.low
        below = value <= self.high if self.high_included else value < self.high
        return above and below and math.isfinite(value)  # last: a whole number may be too large to ask

    def __get_pydantic_core_schema__(self, kind: Any, schema_of: Any) -> Any:
        """Let a record declare a number with its range, as `Annotated[float, Bound(0.0, 5.0, "N")]`, or `float | None`.

        Called by pydantic alone, when it makes the check of such a record.
        """
        from pydantic_core import PydanticCustomError, core_schema

        def held(value: float | None) -> float | None:
            if value is None or self.holds(value):
                return value
            raise PydanticCustomError("bound", "{bound}", {"bound": str(self)})

        return core_schema.no_info_after_validator_function(held, schema_of(kind))


def require(quantity: str, value: object, bound: Bound, action: str) -> float:
    """Return the value as a float, or raise `InvalidQuantity` when it is no finite number inside the bound."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InvalidQuantity(quantity, repr(value), f"a number {bound}", action)
    if isinstance(value, int) and abs(value) > sys.float_info.max:
        value = math.inf if value > 0 else -math.inf  # of hundreds of digits, as JSON may hold
    if not bound.holds(float(value)):
        raise InvalidQuantity(quantity, value, str(bound), action)
    return float(value)


UNIT_ENDINGS = {"_n": "N", "_mm": "mm", "_mm2": "mm2", "_mm3": "mm3", "_kpa": "kPa", "_percent": "%", "_s": "s"}
"""The unit of a quantity, by how its name ends; of any other it is a ratio."""


def unit_of(name: str) -> str:
    """Return the unit that the name of a quantity ends with, "1" of a ratio."""
    return next((unit for ending, unit in UNIT_ENDINGS.items() if name.endswith(ending)), "1")


@dataclass(frozen=True)
class Inclusion:
    """One stiff sphere below the surface: the truth of a phantom, or a simulated scene's inclusion."""

    size_mm: float
    depth_mm: float
    youngs_modulus_kpa: float

    def __post_init__(self) -> None:
        action = "give diameter (mm), depth of the top (mm) and Young's modulus (kPa) of a real sphere"
        require("size_mm", self.size_mm, Bound(0.0, 100.0, "mm"), action)
        require("depth_mm", self.depth_mm, Bound(0.0, 200.0, "mm", low_included=False), action)
        require("youngs_modulus_kpa", self.youngs_modulus_kpa, Bound(0.0, 1e9, "kPa", low_included=False), action)

    def as_tuple(self) -> tuple[float, float, float]:
        """Return (size_mm, depth_mm, youngs_modulus_kpa), the order of `UNKNOWNS`."""
        return self.size_mm, self.depth_mm, self.youngs_modulus_kpa
