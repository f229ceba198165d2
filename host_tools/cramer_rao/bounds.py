"""A scene and a protocol to how well size, depth and modulus of the inclusion can be known at all.

Every bound is computed with elements of two orders; the larger one is quoted, and a difference of more than 20 % says
that errors of the elements, not the inclusion, are part of it. It holds for errors so small that the measurement is a
straight line of the unknowns: a bound above some 50 % only says "not known".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from device.measurement.arrays import Array
from device.measurement.confidence_belt import IDENTIFIABLE_RATIO
from device.measurement.parameters import EVEN_STD, NOMINAL, PARAMETERS, slope_of_normalised
from device.measurement.quantities import UNKNOWNS, Inclusion
from host_tools.cramer_rao.information import CramerRao, cramer_rao, with_nuisances
from host_tools.cramer_rao.observation import (
    FORCE_ERROR,
    GAIN,
    PLACE,
    ZERO,
    observe,
    scalars_of,
    with_reference_response,
)
from host_tools.cramer_rao.observed_press import ObservedPress, observed_presses, rings_of
from host_tools.cramer_rao.protocol import PressProtocol
from host_tools.cramer_rao.rings import Rings
from host_tools.forward.derivatives.mesh_velocity import inclusion_of
from host_tools.forward.derivatives.sensitive_presses import InclusionSensitivity, sensitive_offset, sensitive_ramp
from host_tools.forward.derivatives.sensitivity import FORCE
from host_tools.scenes.scene import Scene

CONVERGED_RATIO = 1.2


@dataclass(frozen=True, eq=False)
class Limit:
    """The bound by the measurement alone, and together with the box that the inclusion is known to come from."""

    alone: CramerRao
    with_box: CramerRao


@dataclass(frozen=True, eq=False)
class Limits:
    """Bounds by the order of the elements; `std` and `std_with_box` [3] are the larger ones, as `UNKNOWNS` has them."""

    by_order: Mapping[int, Limit]
    box_std: Array
    """What the box alone says at this inclusion [3]."""

    @property
    def std(self) -> Array:
        """Standard deviations of ln d, ln h, ln E by the measurement alone."""
        return np.asarray(np.max([limit.alone.std for limit in self.by_order.values()], axis=0))

    @property
    def std_with_box(self) -> Array:
        """Standard deviations of ln d, ln h, ln E with the box as prior."""
        return np.asarray(np.max([limit.with_box.std for limit in self.by_order.values()], axis=0))

    @property
    def identifiable(self) -> tuple[bool, ...]:
        """For each unknown, whether the probe would call an estimate as good as the bound identifiable.

        It does when the spread is under half of what the box alone leaves (`device/measurement/confidence_belt.py`).
        """
        return tuple(bool(narrow) for narrow in self.std_with_box < IDENTIFIABLE_RATIO * self.box_std)

    @property
    def not_converged(self) -> tuple[str, ...]:
        """The unknowns whose bounds of both orders differ by more than 20 %."""
        bounds = np.array([limit.alone.std for limit in self.by_order.values()])
        apart = ~(bounds.max(axis=0) <= CONVERGED_RATIO * bounds.min(axis=0))
        return tuple(name for name, is_apart in zip(UNKNOWNS, apart, strict=True) if is_apart)

    @property
    def quoted(self) -> Limit:
        """The limit of the order whose worst direction is the larger."""
        return max(self.by_order.values(), key=lambda limit: limit.alone.worst_std)


def limits(scene: Scene, protocol: PressProtocol) -> Limits:
    """Return the bounds of a protocol on a scene.

    Raise `InvalidQuantity` for a scene that the derivatives do not serve (off the axis, layered, without an inclusion).
    """
    ramps = sensitive_ramp(scene, protocol.forces_n, strain=protocol.strain)
    aside = [sensitive_offset(scene, offset_mm, protocol.forces_n[-1]) for offset_mm in protocol.offsets_mm]
    box_std = std_of_box(inclusion_of(scene))
    by_order = {
        order: limit_of((*ramp, *(press[order] for press in aside)), protocol, box_std) for order, ramp in ramps.items()
    }
    return Limits(by_order, box_std)


def std_of_box(inclusion: Inclusion) -> Array:
    """Return the standard deviations [3] of ln d, ln h, ln E at an inclusion, for inclusions spread over the box.

    The box and how inclusions are spread over it: `RANGES` of `device/measurement/parameters.py`. In a coordinate
    that is even it has one width everywhere; in its logarithm a small size is known worse than a large one.
    """
    unknowns = {name: getattr(inclusion, name) for name in UNKNOWNS}
    values = np.array([(unknowns | NOMINAL)[name] for name in PARAMETERS])
    slope = slope_of_normalised(values)[: len(UNKNOWNS)]
    return np.asarray(EVEN_STD * slope / np.array(inclusion.as_tuple()))


def limit_of(presses: Sequence[InclusionSensitivity], protocol: PressProtocol, box_std: Array) -> Limit:
    """Return the bound of a protocol on its presses, those beside the inclusion last, as they were solved."""
    return limit_of_observed(observed_presses(presses, protocol.observable), rings_of(presses), protocol, box_std)


def limit_of_observed(seen: Sequence[ObservedPress], rings: Rings, protocol: PressProtocol, box_std: Array) -> Limit:
    """Return the bound of a protocol on what its sensor sees: making that takes most of the time after the solve."""
    observed = observe(seen, rings, protocol)
    if protocol.observable == "scalars":
        observed = scalars_of(observed, len(seen), rings)
    else:
        observed = with_reference_response(observed, seen, rings, protocol)
    spreads = _spreads(protocol, len(seen))
    nuisances = np.stack([observed.derivatives[name] for name in spreads], axis=1)
    covariance = with_nuisances(observed.covariance, nuisances, np.array(list(spreads.values())))
    jacobian = np.stack([observed.derivatives[name] for name in UNKNOWNS], axis=1)
    return Limit(cramer_rao(jacobian, covariance), cramer_rao(jacobian, covariance, box_std))


def _spreads(protocol: PressProtocol, presses: int) -> dict[str, float]:
    """Return the standard deviation of every quantity that is neither asked for nor known."""
    common = {
        "tissue_modulus_kpa": protocol.tissue_modulus_spread_ratio,
        "thickness_mm": protocol.thickness_spread_ratio,
        "contact_pressure_kpa": protocol.contact_law_spread_ratio,
        "albedo": protocol.albedo_spread_ratio,
        "spread_mm": protocol.scattering_spread_ratio,
        GAIN: protocol.gain_spread_ratio,
        FORCE: protocol.force_scale_spread_ratio,
        ZERO: protocol.zero_spread_n,
    }
    own = {f"{FORCE_ERROR}_{i}": protocol.force_error_ratio for i in range(presses)}
    aside = range(len(protocol.forces_n), presses)
    return common | own | {f"{PLACE}_{i}": protocol.place_spread_mm for i in aside}
