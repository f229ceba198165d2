"""`phantoms.toml`: the phantoms that a probe is pressed on, each number with its tolerance and how it was measured.

A phantom without an inclusion is a bare block of tissue. Bare blocks tell as much about the layers and the contact of
a probe as inclusions do, and are exact; two tissues and two surfaces tell more than more sizes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from device.files.phantoms_file import recording_name_problem
from device.measurement.parameters import ABOVE_BASE_MM, ELASTIC_MISMATCHES, RANGES, elastic_mismatch, modulus_ratio
from device.measurement.quantities import Bound, Inclusion, InvalidQuantity
from host_tools.scenes.scene import NEAREST_MM, Tissue
from host_tools.scenes.stated import SIGMAS, SUFFIX, StatedNumbers, Tolerance, read_stated, require_fitting

INCLUSIONS_NEEDED = 6
"""The standard deviation of n residuals is itself uncertain by 1 / sqrt(2 (n - 1)): a third with six, a quarter with
the paper's nine."""
BLOCKS_NEEDED = 3
MEASURED_BY = "_measured_by"
TISSUE = ("tissue_modulus_kpa", "tissue_thickness_mm")
INCLUSION = ("size_mm", "depth_mm", "youngs_modulus_kpa")
"""What a phantom with an inclusion states; a bare block states none of it."""
KPA = Bound(0.0, 1e6, "kPa", low_included=False)
Text = Annotated[str, Field(min_length=1)]


TISSUE_OF = {"tissue_modulus_kpa": "tissue_modulus_kpa", "slab_thickness_mm": "tissue_thickness_mm"}
"""What a phantom calls a parameter of the tissue."""


@dataclass(frozen=True)
class StatedPhantom:
    """One phantom: a block of tissue on a rigid base, with an inclusion unless it is a bare block."""

    name: Annotated[str, Field(min_length=1), "Its name: that of its recordings' files."]
    surface: Annotated[str, Field(min_length=1), "Its surface or skin, and the batch."]
    tissue_modulus_kpa: Annotated[float, KPA, "Young's modulus of its tissue."]
    tissue_modulus_kpa_tolerance: Tolerance
    tissue_modulus_kpa_measured_by: Text
    tissue_thickness_mm: Annotated[float, Bound(0.0, 1e3, "mm", low_included=False), "Thickness of its tissue."]
    tissue_thickness_mm_tolerance: Tolerance
    tissue_thickness_mm_measured_by: Text
    size_mm: Annotated[float | None, Bound(0.0, 100.0, "mm", low_included=False), "Diameter of its inclusion."] = None
    size_mm_tolerance: Tolerance | None = None
    size_mm_measured_by: Text | None = None
    depth_mm: Annotated[float | None, Bound(0.0, 200.0, "mm", low_included=False), "Surface to the top of it."] = None
    depth_mm_tolerance: Tolerance | None = None
    depth_mm_measured_by: Text | None = None
    youngs_modulus_kpa: Annotated[
        float | None, Bound(0.0, 1e9, "kPa", low_included=False), "Young's modulus of it."
    ] = None
    youngs_modulus_kpa_tolerance: Tolerance | None = None
    youngs_modulus_kpa_measured_by: Text | None = None

    @property
    def tissue(self) -> Tissue:
        """Its tissue, as wide as the default one."""
        return Tissue(youngs_modulus_kpa=self.tissue_modulus_kpa, thickness_mm=self.tissue_thickness_mm)

    @property
    def inclusion(self) -> Inclusion | None:
        """Its inclusion; None in a bare block."""
        if self.size_mm is None or self.depth_mm is None or self.youngs_modulus_kpa is None:
            return None
        return Inclusion(self.size_mm, self.depth_mm, self.youngs_modulus_kpa)

    @property
    def parameters(self) -> dict[str, float]:
        """What it states of its tissue, by the names that a press's parameters have."""
        return {name: float(getattr(self, own)) for name, own in TISSUE_OF.items()}

    def outside(self) -> Iterator[InvalidQuantity]:
        """Yield what it states beyond the ranges of the design's model: commissioning refuses that."""
        for name, (low, high, _) in RANGES.items():
            stated = getattr(self, TISSUE_OF.get(name, name), None)
            if stated is not None and not low <= stated <= high:
                action = "cast one inside: commissioning knows no other"
                yield InvalidQuantity(f"{name} of {self.name}", stated, str(Bound(low, high, "")), action)
        if self.inclusion:
            yield from self._not_possible(self.inclusion)

    def _not_possible(self, inclusion: Inclusion) -> Iterator[InvalidQuantity]:
        """Yield what is not possible in its tissue, though each number may be."""
        (least, most), tissue_kpa = ELASTIC_MISMATCHES, self.tissue_modulus_kpa
        mismatch = float(elastic_mismatch(np.array(inclusion.youngs_modulus_kpa), np.array(tissue_kpa)))
        if not least <= mismatch <= most:
            softest, stiffest = (round(tissue_kpa * modulus_ratio(one), 1) for one in (least, most))
            action = f"cast one 1.3 to 61 times as stiff as its tissue of {tissue_kpa:g} kPa"
            found = inclusion.youngs_modulus_kpa
            bound = str(Bound(softest, stiffest, "kPa"))
            yield InvalidQuantity(f"youngs_modulus_kpa of {self.name}", found, bound, action)
        lowest_mm, base_mm = inclusion.size_mm + inclusion.depth_mm, self.tissue_thickness_mm - ABOVE_BASE_MM
        if lowest_mm > base_mm:
            action = f"cast a block of {lowest_mm + ABOVE_BASE_MM:g} mm at least"
            yield InvalidQuantity(f"size_mm + depth_mm of {self.name}", lowest_mm, f"at most {base_mm:g} mm", action)

    def agrees_with(self, truth: Inclusion) -> bool:
        """Return whether a recording's truth is its own, within three standard deviations of each number."""
        if self.inclusion is None:
            return False
        apart = zip(self.inclusion.as_tuple(), truth.as_tuple(), INCLUSION, strict=True)
        return all(abs(own - said) <= SIGMAS * getattr(self, name + SUFFIX) + 1e-9 for own, said, name in apart)


@dataclass(frozen=True)
class PhantomSet:
    """Phantoms of one set; raises `InvalidRecord` with all that contradicts each other or cannot be cast."""

    serial: Annotated[str, Field(min_length=1), "Serial number of the set."]
    phantoms: tuple[StatedPhantom, ...]

    def __post_init__(self) -> None:
        require_fitting(self, misfits)

    @property
    def with_inclusion(self) -> tuple[StatedPhantom, ...]:
        """Those that have an inclusion, in their order."""
        return tuple(phantom for phantom in self.phantoms if phantom.inclusion)

    def advice(self) -> Iterator[str]:
        """Yield what commissioning refuses, and what would tell more about a probe than the set does, in words."""
        for phantom in self.phantoms:
            yield from map(str, phantom.outside())
        tissues = {(phantom.tissue_modulus_kpa, phantom.tissue_thickness_mm) for phantom in self.phantoms}
        if len({phantom.surface for phantom in self.phantoms}) < 2:
            yield "All phantoms have one surface: a second one, oiled or dusted, tells more than more sizes."
        if len(tissues) < 2:
            yield "All phantoms have one tissue: a second one tells more than more sizes."


def read_phantoms(path: Path, *, blocks_needed: int = 0) -> PhantomSet:
    """Return the phantoms of a file; raise `InvalidRecord` with everything that is wrong in it.

    `blocks_needed` is how many bare blocks must be among them.
    """
    return read_stated(PhantomSet, path, partial(misfits, blocks_needed=blocks_needed))


def misfits(stated: StatedNumbers, table: Mapping[str, Any], *, blocks_needed: int = 0) -> Iterator[InvalidQuantity]:
    """Yield what contradicts each other among phantoms, and how many are missing."""
    listed = table.get("phantoms")
    phantoms = [one for one in listed if isinstance(one, Mapping)] if isinstance(listed, list) else []
    yield from _no_names_of_recordings(phantoms)
    yield from _listed_twice(phantoms)
    for place, phantom in enumerate(phantoms):
        name = f"phantoms[{place}]"
        if _has_inclusion(phantom):
            yield from _stated_in_part(name, phantom)
            yield from _inclusion_that_does_not_fit(name, stated)
    inclusions = sum(map(_has_inclusion, phantoms))
    yield from _too_few("phantoms with an inclusion", inclusions, INCLUSIONS_NEEDED)
    yield from _too_few("bare blocks", len(phantoms) - inclusions, blocks_needed)


def _has_inclusion(phantom: Mapping[str, Any]) -> bool:
    return any(phantom.get(name + end) is not None for name in INCLUSION for end in ("", SUFFIX, MEASURED_BY))


def _no_names_of_recordings(phantoms: list[Mapping[str, Any]]) -> Iterator[InvalidQuantity]:
    for place, phantom in enumerate(phantoms):
        name = phantom.get("name")
        if isinstance(name, str) and name and (problem := recording_name_problem(f"phantoms[{place}].name", name)):
            yield problem


def _listed_twice(phantoms: list[Mapping[str, Any]]) -> Iterator[InvalidQuantity]:
    seen: dict[str, Mapping[str, Any]] = {}
    for place, phantom in enumerate(phantoms):
        name = phantom.get("name")
        if not isinstance(name, str):
            continue
        before = seen.setdefault(name, phantom)
        if before is not phantom:
            differing = [one for one in (*INCLUSION, *TISSUE) if before.get(one) != phantom.get(one)]
            found = f"{name!r} again" + (f", with another {' and '.join(differing)}" if differing else "")
            action = "name each phantom once, or find out which of its truths holds"
            yield InvalidQuantity(f"phantoms[{place}].name", found, "one of its own", action)


def _stated_in_part(name: str, phantom: Mapping[str, Any]) -> Iterator[InvalidQuantity]:
    for key in (one + end for one in INCLUSION for end in ("", SUFFIX, MEASURED_BY)):
        if phantom.get(key) is None:
            action = "state it; or leave out all of the inclusion, which is a bare block"
            yield InvalidQuantity(f"{name}.{key}", "missing", "given where there is an inclusion", action)


def _inclusion_that_does_not_fit(name: str, stated: StatedNumbers) -> Iterator[InvalidQuantity]:
    size_mm, depth_mm, modulus_kpa = (stated[f"{name}.{one}"] for one in INCLUSION)
    tissue_kpa, thickness_mm = (stated[f"{name}.{one}"] for one in TISSUE)
    if depth_mm + size_mm >= thickness_mm - NEAREST_MM:
        bound = f"below {name}.tissue_thickness_mm of {thickness_mm:g} mm"
        action = "measure the phantom again: its inclusion stands out below"
        yield InvalidQuantity(f"{name}.depth_mm + size_mm", f"{depth_mm + size_mm:g} mm", bound, action)
    if modulus_kpa <= tissue_kpa:
        bound = f"above {name}.tissue_modulus_kpa of {tissue_kpa:g} kPa"
        action = "measure both again: an inclusion that is no harder than its tissue is not what is looked for"
        yield InvalidQuantity(f"{name}.youngs_modulus_kpa", f"{modulus_kpa:g} kPa", bound, action)


def _too_few(what: str, found: int, needed: int) -> Iterator[InvalidQuantity]:
    if found < needed:
        yield InvalidQuantity(what, found, f"at least {needed}", "cast more of them")
