"""How a press profile changes, to first order, with what no parameter says: of the probe, of the lesion, of a press.

A probe that somebody built differs in its layers, its contact law and its load cell; the lesion's skin and tissue are
not those beside it; the hand leans. Each is a direction in which a row moves, known by derivatives of the forward
model. A tilt is a vector: its part along the inclusion's direction moves the row, its part across only turns the bright
side. Source: docs/own_probe.md; linear nuisance terms of a Gaussian model, Kennedy & O'Hagan, J. R. Stat. Soc. B 63
(2001).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import HIGH, LAYER_TOPS_MM, LOW, PARAMETERS, denormalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.legendre import LegendreSum
from device.measurement.ramp_modes.noise import light_ratio
from device.measurement.ramp_modes.radial_profile import COLUMNS, RESPONSE
from device.measurement.ramp_modes.surrogate import (
    DEPTH,
    INCLUSION_COLUMNS,
    OFFSET,
    SIZE,
    TISSUE,
    assemble,
    far_field_strength,
    offsets_in_range,
    polynomial_coordinates,
)

Owner = Literal["probe", "lesion", "tissue", "beside", "press"]


class BelievedDirection(NamedTuple):
    """Whose a direction is, what is believed of it before anything is measured, and its step of differentiation.

    "probe": the same in all presses. "lesion": in all presses with one reference. "tissue": the same, of its layers,
    which may be even. "beside": a vector of the reference press. "press": each press's own.
    """

    owner: Owner
    std: float
    step: float
    mean: float = 0.0


UNEVEN_LOG_STD = 0.1
"""How much the modulus of each layer may differ from the others, of the logarithm; over the lesion, and beside it."""
DIRECTIONS: dict[str, BelievedDirection] = {
    "contact_exponent": BelievedDirection("probe", 0.1, 0.02),
    "face_modulus_log_ratio": BelievedDirection("probe", 0.1, 0.05),
    "middle_modulus_log_ratio": BelievedDirection("probe", 0.1, 0.05),
    "backing_modulus_log_ratio": BelievedDirection("probe", 0.1, 0.05),
    "cell_span_ratio": BelievedDirection("probe", 0.01, 0.005),
    "face_motion_ratio": BelievedDirection("probe", 0.5, 0.25, 0.5),
    "contact_pressure_log_ratio": BelievedDirection("lesion", 0.03, 0.01),
    "albedo_log_ratio": BelievedDirection("lesion", 0.02, 0.01),
    "tissue_log_ratio": BelievedDirection("lesion", 0.05, 0.02),
    "relaxation_ratio": BelievedDirection("lesion", 0.02, 0.02, 0.03),
    "skin_modulus_log_ratio": BelievedDirection("lesion", 0.3, 0.35, 0.35),
    **{
        f"{place}_{top:g}_mm_log_ratio": BelievedDirection("tissue", UNEVEN_LOG_STD, 0.05)
        for place in ("tissue_from", "lesion_tissue_from")
        for top in LAYER_TOPS_MM
    },
    "tilt_beside_deg": BelievedDirection("beside", 0.3, 0.05),
    "tilt_lesion_deg": BelievedDirection("press", 0.3, 0.05),
    "light_along_ratio": BelievedDirection("press", 0.0035, 0.005),
    "light_pair_ratio": BelievedDirection("press", 0.0025, 0.005),
}
"""Standard deviations are a builder's tolerances, a hand's habits and patients' skins, as `host_tools worlds` and
`host_tools/scores/foreign_presses.py` draw them.

Logarithms of the ratios of the layers' moduli and of the lesion's skin and tissue to those beside it; the cell's counts
of a newton over those by which forces are told; the part of its motion with which the face is drawn; the part of its
modulus that tissue loses in the end; the modulus of the uppermost 1.5 mm over that of the tissue, alike over the lesion
and beside it; light of the sides along the inclusion against those opposite, and of both pairs
against each other. The largest contact of skin has none: skin that wets less easily shows nearly the same, so that each
press tells it by its own coordinates.
"""
NAMES = tuple(DIRECTIONS)
COUNT = len(NAMES)
MEAN: Array = np.array([direction.mean for direction in DIRECTIONS.values()])
STD: Array = np.array([direction.std for direction in DIRECTIONS.values()])
PAIR = NAMES.index("light_pair_ratio")


def owned_by(owner: Owner) -> NDArray[np.intp]:
    """Return the numbers of the directions of an owner."""
    return np.array([number for number, one in enumerate(DIRECTIONS.values()) if one.owner == owner])


ACTION = "install the model bundle again, or commission the probe again"
ARRAYS = "baseline_degrees", "baseline_coefficients", "inclusion_degrees", "inclusion_coefficients"


@dataclass(frozen=True, eq=False)
class RegionDerivatives:
    """Changes of rows by a unit of each direction, over `light_ratio`, for offsets `from_mm` to `to_mm`.

    `baseline` [COUNT x P]: what tissue and skin alone make. `inclusion` [COUNT x (P - reference response)]: what an
    inclusion of strength 1 adds.
    """

    baseline: LegendreSum
    inclusion: LegendreSum
    from_mm: float
    to_mm: float

    def changes(self, normalised: Array, rows: Array) -> Array:
        """Return the changes [n, COUNT, P] of rows [n, P] at coordinates [n, 9], or the nearest inside."""
        parameters = denormalise(normalised)
        at = offsets_in_range(polynomial_coordinates(normalised, parameters), self.from_mm, self.to_mm)
        at = np.clip(at, -1, 1)
        baseline = self.baseline.values(at).reshape(len(at), COUNT, COLUMNS)
        inclusion = self.inclusion.values(at).reshape(len(at), COUNT, INCLUSION_COLUMNS)
        strength = far_field_strength(parameters[:, SIZE], parameters[:, DEPTH])[:, None, None]
        nothing = np.zeros((len(at), COUNT, RESPONSE.stop - RESPONSE.start))
        return np.asarray(light_ratio(rows)[:, None] * (baseline + assemble(strength * inclusion, nothing)))

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the polynomials by the names in `ARRAYS`, in single precision."""
        fields = self.baseline, self.inclusion
        values = [part for field in fields for part in (field.degrees, field.coefficients)]
        kinds = (np.uint8, np.float32) * 2
        return {name: np.asarray(value, kind) for name, value, kind in zip(ARRAYS, values, kinds, strict=True)}


@dataclass(frozen=True, eq=False)
class RowDerivatives:
    """Changes of rows of presses near the inclusion and beside it."""

    near: RegionDerivatives
    beside: RegionDerivatives

    def changes(self, normalised: Array, rows: Array) -> Array:
        """Return the changes [n, COUNT, P] of rows [n, P] at coordinates [n, 9], all in the inclusion's direction.

        A tilt, and light of one side, lie along the inclusion; that of `light_pair_ratio` is of one along the rows of
        the image.
        """
        is_beside = denormalise(normalised)[:, OFFSET] > self.near.to_mm
        found = np.empty((len(rows), COUNT, COLUMNS))
        for region, chosen in ((self.near, ~is_beside), (self.beside, is_beside)):
            if chosen.any():
                found[chosen] = region.changes(normalised[chosen], rows[chosen])
        return found

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return what a file holds of them: the arrays of both, and the largest offset."""
        parts = {"near": self.near, "beside": self.beside}
        named = {f"{part}_{name}": value for part, one in parts.items() for name, value in one.arrays().items()}
        return named | {"to_mm": np.array(self.beside.to_mm), "tissue_kpa": TISSUE_KPA}


TISSUE_KPA = np.array([LOW[TISSUE], HIGH[TISSUE]])
"""The tissue over which coordinates run: a file of before, of 4-6 kPa, does not say it."""
DERIVATIVE_ARRAYS = (*(f"{part}_{name}" for part in ("near", "beside") for name in ARRAYS), "to_mm", "tissue_kpa")


def row_derivatives_of(arrays: Mapping[str, NDArray[Any]]) -> RowDerivatives:
    """Return what the arrays in `DERIVATIVE_ARRAYS` say; raise `InvalidQuantity` when one is of another shape.

    Also where they are of tissue of another range than the models'.
    """
    if not np.array_equal(arrays["tissue_kpa"], TISSUE_KPA):
        raise InvalidQuantity("tissue_kpa of the derivatives", arrays["tissue_kpa"], f"{TISSUE_KPA}", ACTION)
    low_mm, end_mm, to_mm = float(LOW[OFFSET]), float(HIGH[OFFSET]), float(arrays["to_mm"])
    return RowDerivatives(_region(arrays, "near", low_mm, end_mm), _region(arrays, "beside", end_mm, to_mm))


def _region(arrays: Mapping[str, NDArray[Any]], part: str, from_mm: float, to_mm: float) -> RegionDerivatives:
    fields: list[LegendreSum] = []
    for name, columns in (("baseline", COUNT * COLUMNS), ("inclusion", COUNT * INCLUSION_COLUMNS)):
        degrees, values = (arrays[f"{part}_{name}_{what}"] for what in ("degrees", "coefficients"))
        expected = (len(degrees), len(PARAMETERS)), (len(degrees), columns)
        if (degrees.shape, values.shape) != expected:
            raise InvalidQuantity(f"shape of the {part} derivatives", values.shape, str(expected[1]), ACTION)
        fields.append(LegendreSum(degrees, values.astype(np.float64)))
    baseline, inclusion = fields
    return RegionDerivatives(baseline, inclusion, from_mm, to_mm)
