"""All ramps on phantoms together to what the probe is: a Gaussian posterior of its directions, and its model error.

Each ramp has a skin, an offset and a truth known to its tolerances; all share the probe. Least squares over all of
them at once, each ramp whitened by camera, drift, smooth errors and what nobody knows of a press; the posterior of the
probe is what remains when the others are marginalised. How far the forward model is from this probe, which no direction
carries, is a smooth error of each press whose level is the likeliest by the marginal likelihood of all ramps.
Sources: Kennedy & O'Hagan, J. R. Stat. Soc. B 63 (2001), model discrepancy; Tierney & Kadane, JASA 81 (1986), Laplace's
approximation of the marginal likelihood; docs/own_probe.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import NamedTuple, Protocol

import numpy as np
from scipy.optimize import least_squares

from device.measurement.arrays import Array
from device.measurement.parameters import EVEN_STD, HIGH
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.noise import ErrorLevels, PressNoise
from device.measurement.ramp_modes.own_posterior import AXES, OwnPosterior
from device.measurement.ramp_modes.own_probe import OwnProbe
from device.measurement.ramp_modes.radial_profile import RESPONSE
from device.measurement.ramp_modes.row_derivatives import MEAN, STD, RowDerivatives, owned_by
from device.measurement.ramp_modes.surrogate import OFFSET, PressRows
from host_tools.commissioning.phantom_ramps import PhantomRamp

PROBE = owned_by("probe")
MODEL_RATIOS = (0.002, 0.003, 0.004, 0.006, 0.009, 0.013)
"""Levels of the smooth error of the model that are weighed against each other, of the light."""
FLAT_FIELD_RATIO = 0.0047
"""Flat field of 0.2 % as the design's bundle has it, and 0.3 % of skin that differs from place to place, of both."""
FLAT_FIELD_RATIOS = (FLAT_FIELD_RATIO, 0.006, 0.008)
"""The same of skin of 0.3, 0.4 and 0.55 %, weighed, too. No less: patients' skin is no smoother than a casting's."""
ONE_CASTING = 1 / 3
"""A phantom is one casting: over its inclusion it differs from beside by this part of a lesion's skin and tissue."""
FLOOR = 0.3
"""The posterior is believed no narrower than this part of the tolerance: it also carries what linear terms lack."""
WHITENED_AGAIN, MOST_STEPS = 3, 40
REACH_MM = float(HIGH[OFFSET])
BEGUN_AT = 0.1
FARTHEST = 1.5
"""Coordinates may leave the trained ranges so far, but for an offset's."""
NEGLIGIBLE = 1e-6


def tolerances_only(derivatives: RowDerivatives, levels: ErrorLevels) -> OwnProbe:
    """Return what is believed of a probe before any phantom: its builder's tolerances, and a hand's habits."""
    return OwnProbe(derivatives, MEAN, np.diag(STD**2), levels)


@dataclass(frozen=True, eq=False)
class ProbeFit:
    """Posterior of the probe's directions: mean [D] and covariance [D, D]; `log_evidence` of all ramps.

    `misfit_ratio` [n] of each ramp: squared residuals over their number.
    """

    mean: Array
    covariance: Array
    log_evidence: float
    misfit_ratio: Array
    levels: ErrorLevels

    def own_probe(self, derivatives: RowDerivatives) -> OwnProbe:
        """Return what is believed of the probe and its presses from now on."""
        believed = tolerances_only(derivatives, self.levels)
        mean, covariance = np.array(believed.mean), np.array(believed.covariance)
        mean[PROBE] = self.mean
        covariance[np.ix_(PROBE, PROBE)] = self.covariance + np.diag((FLOOR * STD[PROBE]) ** 2)
        return replace(believed, mean=mean, covariance=covariance)


class Design(NamedTuple):
    """The forward model and noise that all probes of a design share, and the derivatives by what they differ in."""

    answers: RampAnswers
    derivatives: RowDerivatives


def fit_probe(
    ramps: Sequence[PhantomRamp],
    design: Design,
    model_ratios: Sequence[float] = MODEL_RATIOS,
    flat_field_ratios: Sequence[float] = FLAT_FIELD_RATIOS,
) -> ProbeFit:
    """Return the posterior of the probe under the likeliest levels of its smooth errors, both given from the least.

    First that of the model for an ordinary skin, then that of skin and flat field: they hardly trade with each other,
    for one is alike at all forces and the other is not.
    """
    noise = design.answers.noise

    def solved(model_ratio: float, flat_field_ratio: float) -> ProbeFit:
        levels = replace(noise.levels, flat_field_ratio=flat_field_ratio, model_ratio=model_ratio)
        return _JointFit(ramps, design, levels).solved()

    found = _likeliest(solved(model_ratio, flat_field_ratios[0]) for model_ratio in model_ratios)
    others = (solved(found.levels.model_ratio, ratio) for ratio in flat_field_ratios[1:])
    return _likeliest(chain([found], others))


def _likeliest(fits: Iterable[ProbeFit]) -> ProbeFit:
    """Return the first fit that is likelier than the next, for the evidence has one top: what follows is not solved."""
    remaining = iter(fits)
    best = next(remaining)
    for fit in remaining:
        if fit.log_evidence < best.log_evidence:
            break
        best = fit
    return best


class _Ramp(Protocol):
    """How well coordinates [10] explain one ramp: those of `OwnPosterior` of a single press."""

    @property
    def log_volume(self) -> float: ...

    def whitened_changes(self, at: Array) -> Array: ...

    def residuals_and_jacobian(self, at: Array) -> tuple[Array, Array]: ...


class _PlainBlock:
    """A ramp on a block without an inclusion: only its reference response says something."""

    def __init__(self, ramp: PhantomRamp, surrogate: PressRows, noise: PressNoise, derivatives: RowDerivatives) -> None:
        self._row, self._surrogate, self._derivatives = ramp.seen.rows[0, RESPONSE], surrogate, derivatives
        covariance = noise.covariance(ramp.seen.rows[0])[RESPONSE, RESPONSE]
        self._whitening = np.linalg.inv(np.linalg.cholesky(covariance))

    @property
    def log_volume(self) -> float:
        return float(np.log(np.diag(self._whitening)).sum())

    def whitened_changes(self, at: Array) -> Array:
        point = self._point(at)
        changes = self._derivatives.changes(point, self._surrogate.rows(point))
        return np.asarray(self._whitening @ changes[0, :, RESPONSE].T)

    def residuals_and_jacobian(self, at: Array) -> tuple[Array, Array]:
        rows, slopes = self._surrogate.rows_and_jacobian(self._point(at[0]))
        jacobian = np.zeros((1, len(self._row), at.shape[1]))
        jacobian[0, :, :OFFSET] = self._whitening @ slopes[0, RESPONSE, :OFFSET]
        return (rows[:, RESPONSE] - self._row) @ self._whitening.T, jacobian

    @staticmethod
    def _point(at: Array) -> Array:
        return np.append(at[:OFFSET], -1.0)[None]


class _JointFit:
    """Least squares over the probe's directions, then ten coordinates of each ramp."""

    def __init__(self, ramps: Sequence[PhantomRamp], design: Design, levels: ErrorLevels) -> None:
        self._ramps, self._surrogate, self._levels = ramps, design.answers.surrogate, levels
        self._noise, self._derivatives = replace(design.answers.noise, levels=levels), design.derivatives
        self._stated = np.array([np.append(ramp.stated[:OFFSET], np.zeros(AXES)) for ramp in ramps])
        self._std = np.array([np.append(ramp.std[:OFFSET], np.full(AXES, EVEN_STD)) for ramp in ramps])
        self._prior = _of_presses(design.derivatives, levels)

    def solved(self) -> ProbeFit:
        """Return the best fit and the Gaussian posterior about it."""
        at = np.concatenate([MEAN[PROBE], self._start().ravel()])
        low, high = self._bounds()
        for _ in range(WHITENED_AGAIN):
            explained = self._explained(at)
            found = least_squares(
                lambda x, of: self._residuals(x, of)[0],
                np.clip(at, low + 1e-6, high - 1e-6),
                jac=lambda x, of: self._residuals(x, of)[1],
                bounds=(low, high),
                x_scale="jac",
                args=(explained,),
                max_nfev=MOST_STEPS,
            )
            at = found.x
        residuals, jacobian = self._residuals(at, explained)
        precision = jacobian.T @ jacobian
        covariance: Array = np.linalg.inv(precision).astype(np.float64)[: len(PROBE), : len(PROBE)]
        log_volume = sum(one.log_volume for one in explained)
        evidence = log_volume - 0.5 * float(residuals @ residuals) - 0.5 * float(np.linalg.slogdet(precision)[1])
        return ProbeFit(at[: len(PROBE)], covariance, evidence, self._misfits(at, explained), self._levels)

    def _start(self) -> Array:
        """Return coordinates [n, 10], each inclusion a little towards its bright side: in the middle nothing slopes."""
        start: Array = np.clip(self._stated, -1, 1)
        start[:, OFFSET] = BEGUN_AT
        return start

    def _bounds(self) -> tuple[Array, Array]:
        of_ramps = np.full_like(self._stated, FARTHEST)
        of_ramps[:, OFFSET:] = 1.0
        ends = np.concatenate([np.full(len(PROBE), np.inf), of_ramps.ravel()])
        return -ends, ends

    def _parts(self, x: Array) -> tuple[Array, Array]:
        return x[: len(PROBE)], x[len(PROBE) :].reshape(self._stated.shape)

    def _explained(self, x: Array) -> list[_Ramp]:
        """Return what whitens each ramp, about where the fit has come to."""
        _, at = self._parts(x)
        return [
            OwnPosterior(ramp.seen, self._surrogate, self._noise, self._prior, REACH_MM, point)
            if ramp.has_inclusion
            else _PlainBlock(ramp, self._surrogate, self._noise, self._derivatives)
            for ramp, point in zip(self._ramps, at, strict=True)
        ]

    def _residuals(self, x: Array, explained: Sequence[_Ramp]) -> tuple[Array, Array]:
        """Return whitened residuals of ramps, of their statements and of tolerances, and their derivatives."""
        probe, at = self._parts(x)
        residuals, jacobian = [], []
        for number, (ramp, point) in enumerate(zip(explained, at, strict=True)):
            (left,), (slope,) = ramp.residuals_and_jacobian(point[None])
            changes = ramp.whitened_changes(point)[:, PROBE]
            whole = np.zeros((len(left), len(x)))
            whole[:, : len(PROBE)] = changes
            first = len(PROBE) + number * at.shape[1]
            whole[:, first : first + at.shape[1]] = slope
            residuals.append(left + changes @ probe)
            jacobian.append(whole)
        std = np.concatenate([STD[PROBE], self._std.ravel()])
        middle = np.concatenate([MEAN[PROBE], self._stated.ravel()])
        residuals.append((x - middle) / std)
        jacobian.append(np.diag(1 / std))
        return np.concatenate(residuals), np.concatenate(jacobian)

    def _misfits(self, x: Array, explained: Sequence[_Ramp]) -> Array:
        probe, at = self._parts(x)
        left = [
            ramp.residuals_and_jacobian(point[None])[0][0] + ramp.whitened_changes(point)[:, PROBE] @ probe
            for ramp, point in zip(explained, at, strict=True)
        ]
        return np.array([np.mean(one**2) for one in left])


def _of_presses(derivatives: RowDerivatives, levels: ErrorLevels) -> OwnProbe:
    """Return what is not known of a press on a phantom, of a probe that is known to be the design's."""
    mean, std = np.array(MEAN), np.array(STD)
    mean[PROBE], std[PROBE] = 0.0, NEGLIGIBLE
    std[owned_by("lesion")] *= ONE_CASTING
    return OwnProbe(derivatives, mean, np.diag(std**2), levels)
