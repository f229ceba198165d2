"""A scene and a protocol to how well size, depth and modulus of the lump can be known at all.

Every bound is computed with elements of two orders; the larger one is quoted, and a difference of more than 20 % says
that errors of the elements, not the lump, are part of it. It holds for errors so small that the measurement is a
straight line of the unknowns: a bound above some 50 % only says "not known".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from device.measurement.quantities import UNKNOWNS
from host_tools.forward.sensitive_offset import sensitive_offset
from host_tools.forward.sensitive_ramp import LumpSensitivity, sensitive_ramp
from host_tools.forward.sensitivity import FORCE
from host_tools.inverse.information import Array, CramerRao, cramer_rao, with_nuisances
from host_tools.inverse.observation import CONTACT_LAW, FORCE_ERROR, GAIN, PLACE, Sight, observe, rings_of, sights
from host_tools.inverse.protocol import Protocol
from host_tools.inverse.rings import Rings
from host_tools.inverse.scalars import scalars_of
from host_tools.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW, Scene

SMALLEST_SIZE_MM = 2.0
"""Lower end of the box's sizes: it begins at 0, which has no logarithm."""
BOX_STD = np.log(np.array(PAPER_BOX_HIGH) / (SMALLEST_SIZE_MM, *PAPER_BOX_LOW[1:])) / np.sqrt(12)
"""Standard deviations of the logarithms of d, h and E spread evenly over the box: 58, 32 and 32 %."""
CONVERGED_RATIO = 1.2


@dataclass(frozen=True, eq=False)
class Limit:
    """The bound by the measurement alone, and together with the box that the lump is known to come from."""

    alone: CramerRao
    with_box: CramerRao


@dataclass(frozen=True, eq=False)
class Limits:
    """Bounds by the order of the elements; both arrays [3] are the larger ones, in the order of `UNKNOWNS`."""

    by_order: Mapping[int, Limit]

    @property
    def std(self) -> Array:
        """Standard deviations of ln d, ln h, ln E by the measurement alone."""
        return np.asarray(np.max([limit.alone.std for limit in self.by_order.values()], axis=0))

    @property
    def std_with_box(self) -> Array:
        """Standard deviations of ln d, ln h, ln E with the box as prior."""
        return np.asarray(np.max([limit.with_box.std for limit in self.by_order.values()], axis=0))

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


def limits(scene: Scene, protocol: Protocol) -> Limits:
    """Return the bounds of a protocol on a scene.

    Raise `InvalidQuantity` for a scene that the derivatives do not serve (off the axis, layered, without a lump).
    """
    ramps = sensitive_ramp(scene, protocol.forces_n, strain=protocol.strain)
    aside = [sensitive_offset(scene, offset_mm, protocol.forces_n[-1]) for offset_mm in protocol.offsets_mm]
    return Limits(
        {order: limit_of((*ramp, *(press[order] for press in aside)), protocol) for order, ramp in ramps.items()}
    )


def limit_of(presses: Sequence[LumpSensitivity], protocol: Protocol) -> Limit:
    """Return the bound of a protocol on its presses, those beside the lump last, as they were solved."""
    return limit_of_sights(sights(presses, protocol.observable), rings_of(presses), protocol)


def limit_of_sights(seen: Sequence[Sight], rings: Rings, protocol: Protocol) -> Limit:
    """Return the bound of a protocol on what its sensor sees: making that takes most of the time after the solve."""
    observed = observe(seen, rings, protocol)
    if protocol.observable == "scalars":
        observed = scalars_of(observed, len(seen), rings)
    spreads = _spreads(protocol, len(seen))
    nuisances = np.stack([observed.derivatives[name] for name in spreads], axis=1)
    covariance = with_nuisances(observed.covariance, nuisances, np.array(list(spreads.values())))
    jacobian = np.stack([observed.derivatives[name] for name in UNKNOWNS], axis=1)
    return Limit(cramer_rao(jacobian, covariance), cramer_rao(jacobian, covariance, BOX_STD))


def _spreads(protocol: Protocol, presses: int) -> dict[str, float]:
    """Return the standard deviation of every quantity that is neither asked for nor known."""
    common = {
        "tissue_modulus_kpa": protocol.tissue_modulus_spread_ratio,
        "thickness_mm": protocol.thickness_spread_ratio,
        CONTACT_LAW: protocol.contact_law_spread_ratio,
        GAIN: protocol.gain_spread_ratio,
        FORCE: protocol.force_scale_spread_ratio,
    }
    own = {f"{FORCE_ERROR}_{i}": protocol.force_error_ratio for i in range(presses)}
    aside = range(len(protocol.forces_n), presses)
    return common | own | {f"{PLACE}_{i}": protocol.place_spread_mm for i in aside}
