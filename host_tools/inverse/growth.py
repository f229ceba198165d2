"""Contrasts of a ramp to contrasts and growth: how the light of the press without the lump grows from load to load.

It is the logarithm of the reference over that at the largest load, ring by ring: the pattern of LEDs and lens drops
out, and what is left knows of tissue and skin. Its noise is that which the contrasts have of the same reference frames.
The probe reads it too: `growth` of `device/measurement/press_profile.py`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host_tools.inverse.observation import Observation, noise_of_reference
from host_tools.inverse.protocol import Protocol
from host_tools.inverse.rings import Array, Rings
from host_tools.inverse.sight import Sight


def with_growth(observed: Observation, seen: Sequence[Sight], rings: Rings, protocol: Protocol) -> Observation:
    """Return the observation with (P - 1) K more numbers; P is the number of loads pressed on the axis."""
    ramp, count = seen[: len(protocol.forces_n)], len(rings.r_mm)
    rise = _rise(len(ramp), count)
    unchanged = np.zeros(len(ramp) * count)
    by_reference = {
        name: np.concatenate([s.reference_derivatives[name] for s in ramp]) for name in ramp[0].reference_derivatives
    }
    derivatives = {
        name: np.concatenate([change, rise @ by_reference.get(name, unchanged)])
        for name, change in observed.derivatives.items()
    }
    white = np.concatenate(noise_of_reference(seen, rings, protocol)[: len(ramp)])
    smooth = np.kron(np.eye(len(ramp)), rings.coupling(protocol.load_correlation_mm))
    own = rise @ (np.diag(white) + protocol.systematic_ratio**2 * smooth) @ rise.T
    shared = np.zeros((len(observed.values), len(rise)))
    ratio = np.concatenate([s.light / s.reference for s in ramp])
    shared[: len(ratio)] = -np.diag(ratio * white) @ rise.T  # a brighter reference is less contrast
    return Observation(
        np.concatenate([observed.values, rise @ np.log(np.concatenate([s.reference for s in ramp]))]),
        derivatives,
        np.block([[observed.covariance, shared], [shared.T, own]]),
    )


def _rise(loads: int, rings: int) -> Array:
    """Return the matrix [(P - 1) K, P K] that takes the last load's logarithms from those of all others."""
    from_last = np.hstack([np.eye(loads - 1), -np.ones((loads - 1, 1))])
    return np.asarray(np.kron(from_last, np.eye(rings)), dtype=np.float64)
