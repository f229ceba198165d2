"""What a forward model may lack of a probe before any phantom: a Gaussian process over rings and forces.

In full rank: rows are known to a thousandth of their contrast, and what a cut leaves out is more. Its lengths and the
part that skin and tissue change are about the likeliest by the marginal likelihood of phantoms of probes whose light
was traced in another block and scattered by another law. Source: Kennedy & O'Hagan, J. R. Stat. Soc. B 63 (2001);
docs/own_probe.md.
"""

from __future__ import annotations

import numpy as np

from device.measurement.arrays import Array
from device.measurement.ramp_modes.commissioned.discrepancy import KNOWN_BY, NOTHING, PARTS, PROBES, Discrepancy
from device.measurement.ramp_modes.noise import LOADS
from device.measurement.ramp_modes.radial_profile import (
    COLUMNS,
    CONTRAST,
    FIRST,
    PROFILE_FORCES_N,
    RESPONSE,
    SECOND,
)
from device.measurement.recording.ring_means import RING_RADII_MM, RINGS

GROWTH = 0.3
"""That of the reference response, of the light, over these."""
BY_SKIN_RATIO = 0.25
"""Part of it that each coordinate of skin and tissue changes, at the end of its range: the likeliest of four."""
LACK_MM, LACK_LOG_N = 2.5, 1.0
"""Over so many millimetres and logarithms of force what it lacks is alike."""
TINY = 1e-6
"""What is added to a covariance of smooth functions, of their size, so that it has a factor."""
ROUNDING = 1e-12


def prior_discrepancy(ratio: float) -> Discrepancy:
    """Return what the forward model may lack before any phantom, a part so large of what an inclusion does."""
    if not ratio:
        return NOTHING
    alike = np.zeros((COLUMNS, COLUMNS))
    for columns, (first, last), loads, std in (
        (CONTRAST, (0, RINGS), LOADS, ratio),
        (RESPONSE, (0, RINGS), LOADS - 1, GROWTH * ratio),
        (FIRST, (1, RINGS), LOADS, ratio),
        (SECOND, (1, RINGS - 1), LOADS, ratio),
    ):
        r_mm, log_n = RING_RADII_MM[first:last], np.log(PROFILE_FORCES_N[:loads])
        alike[columns, columns] = std**2 * np.kron(_alike(log_n / LACK_LOG_N), _alike(r_mm / LACK_MM))
    factor = np.linalg.cholesky(alike + (TINY * ratio) ** 2 * np.eye(COLUMNS))
    parts = np.diag([1.0, *[BY_SKIN_RATIO] * len(KNOWN_BY)])
    whole = np.einsum("kl,pq->kplq", parts, factor).reshape(PARTS, COLUMNS, -1)
    return Discrepancy(np.zeros((PARTS, COLUMNS)), whole, np.zeros((PROBES, PARTS * COLUMNS)))


def _alike(at: Array) -> Array:
    """Return the correlation of a smooth function at places [n], over one unit."""
    return np.asarray(np.exp(-((at[:, None] - at) ** 2) / 2))


class SharedLack:
    """What all ramps share that the forward model lacks: `lack` [S, R] is a factor of it, each ramp white by itself.

    Their covariance is 1 + L L'. What is whitened loses along each of L's principal directions what it has too much;
    directions in which that is less than rounding are left out.
    """

    def __init__(self, lack: Array) -> None:
        self.lack = lack
        variance, parts = np.linalg.eigh(lack.T @ lack)
        told = variance > ROUNDING * max(1.0, float(variance.max(initial=0.0)))
        self._variance, self._parts = variance[told], parts[:, told]
        self._along = lack @ self._parts / np.sqrt(self._variance)

    @property
    def log_volume(self) -> float:
        """Logarithm of the density of all ramps over that of each by itself, at its middle."""
        return -0.5 * float(np.log1p(self._variance).sum())

    def whitened(self, values: Array) -> Array:
        """Return values [S, ...] of all ramps, white together."""
        less = 1 - 1 / np.sqrt(1 + self._variance)
        return np.asarray(values - (self._along * less) @ (self._along.T @ values))

    def mean(self, left: Array) -> Array:
        """Return the likeliest of what is lacking [R], of residuals [S] of all ramps."""
        ratio = np.sqrt(self._variance) / (1 + self._variance)
        return -np.asarray(self._parts @ (ratio * (self._along.T @ left)))
