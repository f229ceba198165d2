"""All ramps on phantoms together to what the probe is: a Gaussian posterior of its directions, and its model error.

Each ramp has a skin, an offset and a truth known to its tolerances; all share the probe. Least squares over all of
them at once, each ramp whitened by camera, drift, smooth errors and what nobody knows of a press; the posterior of the
probe is what remains when the others are marginalised. What no direction carries is an error that all ramps share,
which depends on skin and tissue, and a smooth one of each press; their sizes are the likeliest by the marginal
likelihood of all ramps.
Sources: Kennedy & O'Hagan, J. R. Stat. Soc. B 63 (2001), model discrepancy; Tierney & Kadane, JASA 81 (1986), Laplace's
approximation of the marginal likelihood; docs/own_probe.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import NamedTuple, Protocol

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from device.measurement.arrays import Array
from device.measurement.parameters import EVEN_STD
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.commissioned.discrepancy import Discrepancy
from device.measurement.ramp_modes.commissioned.own_posterior import AXES, OwnPosterior, seen_covariance
from device.measurement.ramp_modes.commissioned.own_probe import OwnProbe
from device.measurement.ramp_modes.commissioned.row_derivatives import MEAN, NAMES, STD, RowDerivatives, owned_by
from device.measurement.ramp_modes.noise import ErrorLevels, PressNoise
from device.measurement.ramp_modes.radial_profile import RESPONSE
from device.measurement.ramp_modes.surrogate import OFFSET, PressRows
from host_tools.commissioning.phantom_ramps import PhantomRamp
from host_tools.commissioning.prior_discrepancy import SharedLack, prior_discrepancy
from host_tools.commissioning.probe_prior import OF_DESIGN, ProbePrior

PROBE = owned_by("probe")
MODEL_RATIOS = (0.002, 0.003, 0.004, 0.006, 0.009, 0.013)
"""Levels of the smooth error of the model that are weighed against each other, of the light."""
USUAL_MODEL_RATIO = MODEL_RATIOS[1]
FLAT_FIELD_RATIO = 0.0047
"""Flat field of 0.2 % as the design's bundle has it, and 0.3 % of skin that differs from place to place, of both."""
FLAT_FIELD_RATIOS = (FLAT_FIELD_RATIO, 0.006, 0.008)
"""The same of skin of 0.3, 0.4 and 0.55 %, weighed, too. No less: patients' skin is no smoother than a casting's."""
SKIN = NAMES.index("skin_modulus_log_ratio")
ONE_CASTING = 1 / 3
"""A phantom is one casting: over its inclusion it differs from beside by this part of a lesion's skin and tissue."""
FLOOR = 0.3
"""The posterior is believed no narrower than this part of the tolerance: it also carries what linear terms lack."""
WHITENED_AGAIN, MOST_STEPS = 3, 40
DISCREPANCY_RATIOS = (0.0, 0.01, 0.03, 0.1, 0.2)
"""Levels of what the forward model lacks that are weighed, of what an inclusion does to the light."""
UNLIKE_CASTINGS = 2.0
"""It is believed so many times as large as phantoms say: castings have two skins, patients each their own."""
SETTLED = 1e-6
"""A fit ends where a step gains less than this part of the squared residuals: of their evidence, 0.03."""
BEGUN_AT = 0.1
"""Of the reach, which is that of a scan: 0.8 mm."""
FARTHEST = 1.5
"""Coordinates may leave the trained ranges so far, but for an offset's."""
NEGLIGIBLE = 1e-6


def tolerances_only(derivatives: RowDerivatives, levels: ErrorLevels, prior: ProbePrior = OF_DESIGN) -> OwnProbe:
    """Return what is believed of a probe before any phantom: its builder's tolerances, and a hand's habits."""
    return OwnProbe(derivatives, prior.mean, np.diag(prior.std**2), levels)


def levels_on_skin(of_design: ErrorLevels, flat_field_ratio: float, model_ratio: float) -> ErrorLevels:
    """Return the design's levels with smooth errors of a flat field that has the skin's texture in it, and of a model.

    Skin differs alike over the lesion and beside it, so each has half of what is not the face's. A scan's presses share
    the face and the patch beside; each is believed to have a patch of its own over the lesion, however close.
    """
    of_face = (of_design.flat_field_ratio / flat_field_ratio) ** 2
    return replace(
        of_design,
        flat_field_ratio=flat_field_ratio,
        flat_field_shared_ratio=(1 + of_face) / 2,
        model_ratio=model_ratio,
    )


@dataclass(frozen=True, eq=False)
class ProbeFit:
    """Posterior of the probe's directions: mean [D] and covariance [D, D]; `log_evidence` of all ramps.

    `misfit_ratio` [n] of each ramp: squared residuals over their number. `left_ratio` [n, contrast and response]: by
    how much ring means of each are seen above what is explained, of the light; NaN where a bare block says nothing.
    `offset_mm` [n]: how far off the axis each inclusion lies, of a bare block NaN.
    `prior` is what its builder stated. `steps`: of the last least squares, which end by themselves below `MOST_STEPS`.
    """

    mean: Array
    covariance: Array
    log_evidence: float
    misfit_ratio: Array
    offset_mm: Array
    left_ratio: Array
    levels: ErrorLevels
    discrepancy: Discrepancy
    believed: BelievedErrors
    prior: ProbePrior = OF_DESIGN
    steps: int = 0

    @property
    def tolerances_away(self) -> Array:
        """How far each direction [D] lies from what was expected of it, in standard deviations of that."""
        return np.asarray((self.mean - self.prior.mean[PROBE]) / self.prior.std[PROBE])

    def own_probe(self, derivatives: RowDerivatives) -> OwnProbe:
        """Return what is believed of the probe and its presses from now on."""
        believed = tolerances_only(derivatives, self.levels, self.prior)
        mean, covariance = np.array(believed.mean), np.array(believed.covariance)
        mean[PROBE] = self.mean
        covariance[np.ix_(PROBE, PROBE)] = np.diag((FLOOR * self.prior.std[PROBE]) ** 2)
        return replace(believed, mean=mean, covariance=covariance, discrepancy=self.discrepancy)


class Design(NamedTuple):
    """The forward model and noise that all probes of a design share, and the derivatives by what they differ in.

    `prior` is what one probe's builder says of it.
    """

    answers: RampAnswers
    derivatives: RowDerivatives
    prior: ProbePrior = OF_DESIGN


class BelievedErrors(NamedTuple):
    """How large what no direction carries is believed: lacking of the forward model, its smooth error, and the skin's.

    The first is of what an inclusion does to the light, the others of the light.
    """

    discrepancy_ratio: float
    model_ratio: float
    flat_field_ratio: float


def fit_probe(ramps: Sequence[PhantomRamp], design: Design, believed: BelievedErrors | None = None) -> ProbeFit:
    """Return the posterior of the probe under errors that are believed, or else under the likeliest of those weighed.

    A discrepancy of the likeliest size is then taken `UNLIKE_CASTINGS` times as large.
    """
    if believed:
        return _JointFit(ramps, design, believed).solved()
    found = _likeliest_fit(ramps, design)
    if not found.believed.discrepancy_ratio:
        return found
    larger = found.believed._replace(discrepancy_ratio=UNLIKE_CASTINGS * found.believed.discrepancy_ratio)
    return _JointFit(ramps, design, larger).solved()


def _likeliest_fit(ramps: Sequence[PhantomRamp], design: Design) -> ProbeFit:
    """Return the fit of the largest evidence, one level after the other and each from the least.

    First, with an ordinary smooth error and skin, that of what the forward model lacks; then that of its smooth error;
    then that of skin and flat field, which hardly trades with them: it is alike at all forces.
    """

    def solved(*levels: float) -> ProbeFit:
        return _JointFit(ramps, design, BelievedErrors(*levels)).solved()

    found = _likeliest(solved(lacking, USUAL_MODEL_RATIO, FLAT_FIELD_RATIO) for lacking in DISCREPANCY_RATIOS)
    lacking = found.believed.discrepancy_ratio
    found = _likeliest(
        found if ratio == USUAL_MODEL_RATIO else solved(lacking, ratio, FLAT_FIELD_RATIO) for ratio in MODEL_RATIOS
    )
    chosen = found.believed[:2]
    return _likeliest(chain([found], (solved(*chosen, ratio) for ratio in FLAT_FIELD_RATIOS[1:])))


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

    def whitened_lack(self, at: Array, discrepancy: Discrepancy) -> Array: ...

    def residuals_and_jacobian(self, at: Array) -> tuple[Array, Array]: ...

    def weighted(self, whitened: Array) -> Array: ...


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

    def whitened_lack(self, at: Array, discrepancy: Discrepancy) -> Array:
        point = self._point(at)
        return np.asarray(self._whitening @ discrepancy.spread(point, self._surrogate.rows(point))[0, RESPONSE])

    def residuals_and_jacobian(self, at: Array) -> tuple[Array, Array]:
        rows, slopes = self._surrogate.rows_and_jacobian(self._point(at[0]))
        jacobian = np.zeros((1, len(self._row), at.shape[1]))
        jacobian[0, :, :OFFSET] = self._whitening @ slopes[0, RESPONSE, :OFFSET]
        return (rows[:, RESPONSE] - self._row) @ self._whitening.T, jacobian

    def weighted(self, whitened: Array) -> Array:
        return np.asarray(whitened @ self._whitening)

    @staticmethod
    def _point(at: Array) -> Array:
        return np.append(at[:OFFSET], -1.0)[None]


class _Once:
    """A function that is not asked again where it was asked last: least squares want residuals, then their slopes."""

    def __init__(self, function: Callable[[Array], tuple[Array, Array]]) -> None:
        self._function, self._at = function, np.empty(0)

    def __call__(self, at: Array) -> tuple[Array, Array]:
        if not np.array_equal(at, self._at):
            self._at, self._value = np.array(at), self._function(at)
        return self._value


class _JointFit:
    """Least squares over the probe's directions, then ten coordinates of each ramp."""

    def __init__(self, ramps: Sequence[PhantomRamp], design: Design, believed: BelievedErrors) -> None:
        noise, self._believed = design.answers.noise, believed
        levels = levels_on_skin(noise.levels, believed.flat_field_ratio, believed.model_ratio)
        self._lacking = prior_discrepancy(believed.discrepancy_ratio)
        self._ramps, self._surrogate, self._levels = ramps, design.answers.surrogate, levels
        self._noise, self._derivatives = replace(noise, levels=levels), design.derivatives
        self._prior = design.prior
        self._expected, self._tolerances = (part[PROBE] for part in design.prior)
        self._stated = np.array([np.append(ramp.stated[:OFFSET], np.zeros(AXES)) for ramp in ramps])
        self._std = np.array([np.append(ramp.std[:OFFSET], np.full(AXES, EVEN_STD)) for ramp in ramps])
        self._of_presses = presses_on_castings(design.derivatives, levels)
        self._reach_mm = design.answers.surrogate.to_mm  # a ramp may lie as far aside as those of a scan

    def solved(self) -> ProbeFit:
        """Return the best fit and the Gaussian posterior about it."""
        at = np.concatenate([self._expected, self._start().ravel()])
        for _ in range(WHITENED_AGAIN):
            explained = self._explained(at)
            lack = self._lack(at, explained)
            shared = SharedLack(np.concatenate(lack))
            found = self._least_squares(at, explained, shared)
            at = found.x
        residuals, jacobian = self._residuals(at, explained, shared)
        precision = jacobian.T @ jacobian
        log_volume = sum(one.log_volume for one in explained) + shared.log_volume
        evidence = log_volume - 0.5 * float(residuals @ residuals) - 0.5 * float(np.linalg.slogdet(precision)[1])
        left, slopes = self._of_ramps(at, explained)
        covariance, discrepancy = self._posterior(left, slopes, shared)
        counts = np.cumsum([len(one) for one in lack])
        unexplained = np.split(left + shared.lack @ shared.mean(left), counts[:-1])
        misfit = np.array([np.mean(one**2) for one in unexplained])
        of_light, mean = self._left_ratio(unexplained, explained), at[: len(PROBE)]
        return ProbeFit(
            mean,
            covariance,
            evidence,
            misfit,
            self._offset_mm(at),
            of_light,
            self._levels,
            discrepancy,
            self._believed,
            self._prior,
            found.nfev,
        )

    def _least_squares(self, at: Array, explained: Sequence[_Ramp], shared: SharedLack) -> OptimizeResult:
        seen = _Once(partial(self._residuals, explained=explained, shared=shared))
        low, high = self._bounds()
        return least_squares(
            lambda x: seen(x)[0],
            np.clip(at, low + 1e-6, high - 1e-6),
            jac=lambda x: seen(x)[1],
            bounds=(low, high),
            x_scale="jac",
            ftol=SETTLED,
            max_nfev=MOST_STEPS,
        )

    def _offset_mm(self, x: Array) -> Array:
        _, at = self._parts(x)
        has_inclusion = np.array([ramp.has_inclusion for ramp in self._ramps])
        return np.where(has_inclusion, self._reach_mm * np.linalg.norm(at[:, OFFSET:], axis=1), np.nan)

    def _left_ratio(self, unexplained: Sequence[Array], explained: Sequence[_Ramp]) -> Array:
        """Return `ProbeFit.left_ratio`, of what is left of each ramp, whitened.

        Gain, zero, tilts and skin over the inclusion carry the likeliest part of it, which is taken off.
        """
        still = replace(self._noise, levels=replace(self._levels, gain_ratio=0.0, zero_n=0.0, force_n=0.0))
        found = np.full((len(explained), RESPONSE.stop), np.nan)
        for row, ramp, one, whitened in zip(found, self._ramps, explained, unexplained, strict=True):
            rows, across = ramp.seen.rows, ramp.seen.across
            if ramp.has_inclusion and across is not None:
                row[:] = -seen_covariance(rows, across, still)[: RESPONSE.stop] @ one.weighted(whitened)
            else:
                row[RESPONSE] = -still.covariance(rows[0])[RESPONSE, RESPONSE] @ one.weighted(whitened)
        return found

    def _lack(self, x: Array, explained: Sequence[_Ramp]) -> list[Array]:
        """Return what a unit of each part of the discrepancy changes of each ramp [S, R], whitened."""
        _, at = self._parts(x)
        return [ramp.whitened_lack(point, self._lacking) for ramp, point in zip(explained, at, strict=True)]

    def _posterior(self, left: Array, slopes: Array, shared: SharedLack) -> tuple[Array, Discrepancy]:
        """Return the covariance [D, D] of the probe's directions, and the discrepancy with what goes with it of them.

        Both are told by the same ramps, whose own coordinates are marginalised.
        """
        design = np.hstack([slopes, shared.lack])
        tolerances = np.concatenate([self._tolerances, self._std.ravel(), np.ones(shared.lack.shape[1])])
        covariance = np.linalg.inv(design.T @ design + np.diag(tolerances**-2))
        told = np.r_[: len(PROBE), slopes.shape[1] : design.shape[1]]
        factor: Array = np.linalg.cholesky(covariance[np.ix_(told, told)]).astype(np.float64)
        of_probe, of_lack = factor[: len(PROBE)], factor[len(PROBE) :]
        mean = self._lacking.factor @ shared.mean(left)
        return of_probe @ of_probe.T, Discrepancy(mean, self._lacking.factor @ of_lack, of_probe)

    def _start(self) -> Array:
        """Return coordinates [n, 10], each inclusion a little towards its bright side: in the middle nothing slopes."""
        start: Array = np.clip(self._stated, -1, 1)
        start[:, OFFSET] = BEGUN_AT
        return start

    def _bounds(self) -> tuple[Array, Array]:
        of_ramps = np.full_like(self._stated, FARTHEST)
        of_ramps[:, OFFSET:] = 2**-0.5  # both axes together stay within the reach
        ends = np.concatenate([np.full(len(PROBE), np.inf), of_ramps.ravel()])
        return -ends, ends

    def _parts(self, x: Array) -> tuple[Array, Array]:
        return x[: len(PROBE)], x[len(PROBE) :].reshape(self._stated.shape)

    def _explained(self, x: Array) -> list[_Ramp]:
        """Return what whitens each ramp, about where the fit has come to."""
        _, at = self._parts(x)
        return [
            OwnPosterior(ramp.seen, self._surrogate, self._noise, self._of_presses, self._reach_mm, point)
            if ramp.has_inclusion
            else _PlainBlock(ramp, self._surrogate, self._noise, self._derivatives)
            for ramp, point in zip(self._ramps, at, strict=True)
        ]

    def _residuals(self, x: Array, explained: Sequence[_Ramp], shared: SharedLack) -> tuple[Array, Array]:
        """Return whitened residuals of ramps, of their statements and of tolerances, and their derivatives."""
        left, slopes = self._of_ramps(x, explained)
        std = np.concatenate([self._tolerances, self._std.ravel()])
        middle = np.concatenate([self._expected, self._stated.ravel()])
        return (
            np.concatenate([shared.whitened(left), (x - middle) / std]),
            np.concatenate([shared.whitened(slopes), np.diag(1 / std)]),
        )

    def _of_ramps(self, x: Array, explained: Sequence[_Ramp]) -> tuple[Array, Array]:
        """Return residuals of all ramps, each whitened by itself, and their derivatives."""
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
        return np.concatenate(residuals), np.concatenate(jacobian)


def presses_on_castings(derivatives: RowDerivatives, levels: ErrorLevels) -> OwnProbe:
    """Return what is not known of a press on a phantom, of a probe that is known to be the design's."""
    mean, std = np.array(MEAN), np.array(STD)
    mean[PROBE], std[PROBE] = 0.0, NEGLIGIBLE
    std[owned_by("lesion")] *= ONE_CASTING
    return on_castings(OwnProbe(derivatives, mean, np.diag(std**2), levels))


def on_castings(own: OwnProbe) -> OwnProbe:
    """Return what is believed of presses on castings, each of one silicone up to its surface.

    They have no skin, and are even in depth.
    """
    mean, covariance = np.array(own.mean), np.array(own.covariance)
    for number in (SKIN, *owned_by("tissue")):
        mean[number], covariance[number], covariance[:, number] = 0.0, 0.0, 0.0
        covariance[number, number] = NEGLIGIBLE**2
    return replace(own, mean=mean, covariance=covariance)
