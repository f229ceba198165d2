"""What is measured and how uncertain the rest is: forces, frames, noise and spreads, from a TOML file.

Spreads are standard deviations of the logarithm, so 0.2 is 20 %; a spread of 0 means exactly known. `systematic_ratio`
is what white noise is not: smooth over the face, so that no number of pixels or frames takes it away.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import Literal, get_args

from device.files.toml_record import read_toml
from device.measurement.quantities import Bound, InvalidQuantity, require
from host_tools.forward.derivatives.sensitive_presses import RampStrain

Observable = Literal["image", "scalars", "pressure", "displacement"]
OBSERVABLES = get_args(Observable)
SPREADS = (
    "tissue_modulus_spread_ratio",
    "thickness_spread_ratio",
    "contact_law_spread_ratio",
    "albedo_spread_ratio",
    "scattering_spread_ratio",
    "gain_spread_ratio",
    "force_scale_spread_ratio",
    "force_error_ratio",
    "systematic_ratio",
)
MOST_FORCES = 12


@dataclass(frozen=True)
class PressProtocol:
    """One way to measure a lesion; tissue and skin vary by default as `device/measurement/parameters.py` has it.

    `forces_n` ascend; `frames`, and `reference_frames` on tissue without the inclusion, are spread evenly over all
    loads. `observable`: the image of the probe, its three scalars (`docs/measurement.md`), or the image of an ideal
    sensor that shows pressure or displacement itself. `mean_level_counts`, of 255: mean of the reference press at the
    largest force. `offsets_mm`: further presses beside the inclusion at the largest force, one for each, solved in
    small strain, each of which lies only to `place_spread_mm` where it should. `contact_law_spread_ratio` is that of
    the skin's contact pressure, `albedo_spread_ratio` and `scattering_spread_ratio` of the light that it gives back and
    how far that spreads; `gain_spread_ratio` is drift of the light between the two presses. `force_scale_spread_ratio`
    is common to all presses, `force_error_ratio` each press's own, `zero_spread_n` drift of the cell's zero between the
    two presses. Systematic errors of `systematic_ratio` come twice: common to all loads, smooth over
    `common_correlation_mm`, and each load's own, smooth over `load_correlation_mm`. Raises `InvalidQuantity` for a
    value that no measurement has.
    """

    forces_n: tuple[float, ...] = (0.12, 0.25, 0.40, 0.55)
    frames: int = 10
    reference_frames: int = 10
    observable: Observable = "image"
    strain: RampStrain = "finite"
    offsets_mm: tuple[float, ...] = ()
    mean_level_counts: float = 100.0
    tissue_modulus_spread_ratio: float = 0.78
    thickness_spread_ratio: float = 0.4
    contact_law_spread_ratio: float = 0.17
    albedo_spread_ratio: float = 0.115
    scattering_spread_ratio: float = 0.13
    gain_spread_ratio: float = 0.01
    force_scale_spread_ratio: float = 0.005
    force_error_ratio: float = 0.001
    zero_spread_n: float = 0.001
    place_spread_mm: float = 1.0
    systematic_ratio: float = 0.0
    common_correlation_mm: float = 2.0
    load_correlation_mm: float = 3.0

    def __post_init__(self) -> None:
        _require_forces(self.forces_n)
        for name in ("frames", "reference_frames"):
            require(name, getattr(self, name), Bound(1, 1_000_000, "frames"), "take at least one frame")
        for name, known in (("observable", OBSERVABLES), ("strain", get_args(RampStrain))):
            if getattr(self, name) not in known:
                raise InvalidQuantity(name, repr(getattr(self, name)), f"one of {', '.join(known)}", "choose one")
        for i, offset_mm in enumerate(self.offsets_mm):
            require(
                f"offsets_mm[{i}]", offset_mm, Bound(0.0, 30.0, "mm", low_included=False), "press beside the inclusion"
            )
        if self.offsets_mm and self.observable == "scalars":
            raise InvalidQuantity("offsets_mm", list(self.offsets_mm), "empty with scalars", "observe the image")
        require("zero_spread_n", self.zero_spread_n, Bound(0.0, 1.0, "N"), "say how far the cell's zero drifts")
        require("place_spread_mm", self.place_spread_mm, Bound(0.0, 30.0, "mm"), "say how well the probe is placed")
        lit = Bound(0.0, 255.0, "counts", low_included=False)
        require("mean_level_counts", self.mean_level_counts, lit, "expose so that the image is not dark")
        for name in SPREADS:
            require(name, getattr(self, name), Bound(0.0, 10.0, ""), "give a standard deviation; 0.1 is 10 %")
        for name in ("common_correlation_mm", "load_correlation_mm"):
            require(name, getattr(self, name), Bound(0.1, 100.0, "mm"), "give the width of a smooth error")


def read_protocol(path: Path) -> PressProtocol:
    """Return the protocol of a TOML file; raise `InvalidQuantity` naming the key that is wrong."""
    return read_toml(PressProtocol, path)


def _require_forces(forces_n: tuple[float, ...]) -> None:
    if not 1 <= len(forces_n) <= MOST_FORCES:
        raise InvalidQuantity("forces_n", f"{len(forces_n)} forces", f"1 to {MOST_FORCES}", "give the loads in N")
    if not all(0 <= lower < higher < inf for lower, higher in pairwise((0.0, *forces_n))):
        raise InvalidQuantity("forces_n", list(forces_n), "ascending, finite and above 0 N", "sort the loads")
