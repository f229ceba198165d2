"""A second inclusion beside the first, and how a face shows both: what each adds on its own, together.

Neither knows of the other, so this holds for inclusions a few millimetres apart. A probe that looks for one inclusion
must notice that there are two.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

from device.measurement.quantities import Bound, Inclusion, require
from device.measurement.recording.tactile_image import Image
from device.simulation.physics.pressed_face import ProbePlacement

FAR_AWAY = ProbePlacement(x_mm=80.0)
"""Beside any inclusion: the face is that of the tissue alone."""


@dataclass(frozen=True)
class Neighbour:
    """A second inclusion whose middle lies at (x, y) from the first one's."""

    size_mm: float = 8.0
    depth_mm: float = 6.0
    youngs_modulus_kpa: float = 80.0
    x_mm: float = 10.0
    y_mm: float = 0.0

    def __post_init__(self) -> None:
        _ = self.inclusion  # refuses what no sphere can be
        for name in ("x_mm", "y_mm"):
            require(
                f"neighbour.{name}", getattr(self, name), Bound(-40.0, 40.0, "mm"), "put it beside the first inclusion"
            )

    @property
    def inclusion(self) -> Inclusion:
        """The inclusion alone."""
        return Inclusion(self.size_mm, self.depth_mm, self.youngs_modulus_kpa)


class NeighbourFace(Protocol):
    """Fields of a pressed face at the pixels of an image."""

    def at(self, force_n: float, place: ProbePlacement) -> tuple[Image, Image]:
        """Return w_mm and p_kpa [ny, nx]."""


class NeighbouredFace:
    """The sum of two faces, less the tissue's own that both hold."""

    def __init__(self, first: NeighbourFace, second: NeighbourFace, neighbour: Neighbour) -> None:
        self._first, self._second, self._from_first = first, second, neighbour

    def at(self, force_n: float, place: ProbePlacement) -> tuple[Image, Image]:
        """Return w_mm and p_kpa [ny, nx] of both inclusions; `place` is relative to the first."""
        away = self._from_first
        second = replace(place, x_mm=place.x_mm - away.x_mm, y_mm=place.y_mm - away.y_mm)
        baseline = replace(place, x_mm=FAR_AWAY.x_mm, y_mm=FAR_AWAY.y_mm)
        fields = self._first.at(force_n, place), self._second.at(force_n, second), self._first.at(force_n, baseline)
        w_mm, p_kpa = (one + two - none for one, two, none in zip(*fields, strict=True))
        return w_mm, p_kpa
