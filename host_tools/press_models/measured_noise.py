"""The parts of a press's noise that are measured: the camera's, what the surrogate misses, and what the tables miss.

The camera's is how recordings scatter about the exact values. Camera, cell and the hand's tremor are in it; drift of
light and cell and smooth errors are not, they have levels of their own. A force that is read wrong moves all rings
alike, so what few rings tell by themselves is far below any column's noise. Correlations are therefore shrunk no more
than recordings kept apart ask for: those of a closed formula (Schaefer & Strimmer, Stat. Appl. Genet. Mol. Biol. 4,
2005), which cares for large correlations only, made that noise three times as large as it is. Source: Warton, JASA 103
(2008), shrinkage by cross-validated likelihood.

The tables stand for finite elements: between their points, and on elements that are quick. What both cost is seen where
inclusions are solved anew on better ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.quantities import UNKNOWNS, Inclusion
from device.measurement.ramp_modes.noise import light_ratio, rms_contrast
from device.measurement.ramp_modes.radial_profile import CONTRAST
from device.measurement.ramp_modes.surrogate import OFFSET, PressRows
from device.simulation.physics.slab import Slab
from device.simulation.physics.surface_table import PressRamps
from device.simulation.virtual_probe import ProbeTables
from host_tools.forward.plan import Level
from host_tools.forward.press_model import PressFailed
from host_tools.press_models.fit_surrogate import missed_rows
from host_tools.press_models.press_samples import PressSamples, draw_beside, draw_parameters, profile_rows
from host_tools.press_models.recorded_presses import direction_of_press_rad, in_parallel, record_presses
from host_tools.press_models.seeds import derived_seed, press_seed
from host_tools.probe_tables.force_ramps import inclusion_ramp, scene_in

PARTS = 5
SHRINKAGES = np.geomspace(1e-4, 1.0, 33)
FINER = (Level("blunt_rim", 4),)
"""Elements of what is solved anew: off by 0.1 % of an inclusion's peak, at 2.5 times the time of the tables'."""
LARGEST_N = 0.6
"""A little above the profile's largest force: pressed further, finer elements fold at a rim more often."""
SKINS = 3
"""Presses of each inclusion that is solved anew."""
TINY = 1e-9
"""A column that is 0 in all but one part of the errors still has a covariance that can be inverted."""


def camera_noise(tables: ProbeTables, near: int, beside: int, *, seed: int, jobs: int = -1) -> Array:
    """Return the covariance [P, P] of profile rows of random presses about the exact ones, over the light.

    So many presses lie `near` the inclusion, and so many `beside` it.
    """
    errors = [
        recorded_errors(tables, draw(count, np.random.default_rng(own)), seed=own, jobs=jobs)
        for count, draw, own in (
            (near, draw_parameters, derived_seed(seed, "camera of standard")),
            (beside, draw_beside, derived_seed(seed, "camera beside")),
        )
    ]
    return shrunk_covariance(np.concatenate(errors))


def recorded_errors(tables: ProbeTables, parameters: Array, *, seed: int, jobs: int = -1) -> Array:
    """Return by how much rows of recorded presses with parameters [n, 9] differ from exact ones [n, P], over the light.

    Drift of light and cell and smooth errors are not in it.
    """
    recorded = record_presses(tables, parameters, "standard", seed=seed, jobs=jobs)
    exact = exact_rows(tables, parameters, seed=seed, jobs=jobs)
    return (np.concatenate(recorded.rows) - exact) / light_ratio(exact)


def exact_rows(tables: ProbeTables, parameters: Array, *, seed: int, jobs: int = -1) -> Array:
    """Return the profile rows [n, P] without noise of presses that are recorded with a seed, each in its direction."""

    def exact(number: int) -> Array:
        direction_rad = np.array([direction_of_press_rad(press_seed(seed, number))])
        return np.asarray(profile_rows(tables, parameters[number : number + 1], direction_rad)[0])

    return np.array(in_parallel(exact, len(parameters), jobs))


def surrogate_error(surrogate: PressRows, *kept: PressSamples) -> Array:
    """Return the covariance [P, P] of what a surrogate misses of presses kept apart, as `PressNoise.forward`.

    Errors of large and shallow inclusions are the largest: about as the root of the contrast.
    """
    return shrunk_covariance(
        np.concatenate([_for_unit_contrast(missed_rows(surrogate, one), one.rows) for one in kept])
    )


def table_error(tables: ProbeTables, inclusions: int, *, seed: int, jobs: int = -1) -> Array:
    """Return the covariance [P, P] of what the tables miss of inclusions solved anew, as `PressNoise.forward`.

    Random inclusions on the axis, in random tissue of the trained ranges: `FINER` elements and no interpolation. Only
    the contrast is told: there are no harmonics there, and finer elements in three dimensions are out of reach.
    """

    def missed(number: int) -> Array:
        parameters, solved = _solved_anew(tables, press_seed(seed, number))
        known = profile_rows(tables, parameters)
        return _for_unit_contrast(profile_rows(tables, parameters, ramps=solved) - known, known)

    errors = np.concatenate(in_parallel(missed, inclusions, jobs, smallest_batch=1))
    found = np.zeros((errors.shape[1], errors.shape[1]))
    found[CONTRAST, CONTRAST] = shrunk_covariance(errors[:, CONTRAST])
    return found


def _solved_anew(tables: ProbeTables, seed: int) -> tuple[Array, PressRamps]:
    """Return presses [n, 9] of one inclusion on several skins, and its ramps.

    One whose finer elements fold is drawn again: small, shallow and hard ones are somewhat too few. The press without
    an inclusion is the tables': what these miss there looks like other tissue, which a ramp tells.
    """
    rng, tissue = np.random.default_rng(seed), slice(len(UNKNOWNS), len(UNKNOWNS) + 2)
    while True:
        parameters = draw_parameters(SKINS, rng)
        parameters[:, : tissue.stop], parameters[:, OFFSET] = parameters[0, : tissue.stop], 0.0
        inclusion, slab = Inclusion(*parameters[0, : len(UNKNOWNS)]), Slab(*parameters[0, tissue])
        try:
            solved = inclusion_ramp(scene_in(slab, inclusion), LARGEST_N, FINER)
        except PressFailed:
            continue
        return parameters, tables.centred.ramps(inclusion, slab)._replace(inclusion_field=solved)


def _for_unit_contrast(errors: Array, rows: Array) -> Array:
    """Return errors [n, P] of rows over the light, for a root mean square contrast of 1."""
    return np.asarray(errors / light_ratio(rows) / np.sqrt(rms_contrast(rows))[:, None])


def shrunk_covariance(errors: Array) -> Array:
    """Return the mean square [P, P] of errors [n, P], correlations shrunk by as much as chance made them."""
    std = np.sqrt(np.mean(errors**2, axis=0))
    standard = errors / std
    return np.asarray(std[:, None] * std * _shrunk_correlation(standard, shrinkage(standard)))


def shrinkage(standard: Array) -> float:
    """Return by how much correlations of n standardised errors [n, P] are to be shrunk: one of `SHRINKAGES`.

    It is the one under which parts of the errors are likeliest by the others' correlations.
    """
    parts = np.array_split(np.arange(len(standard)), min(PARTS, len(standard)))
    likely = [sum(_log_likelihood(standard, part, ratio) for part in parts) for ratio in SHRINKAGES]
    return float(SHRINKAGES[int(np.argmax(likely))])


def _log_likelihood(standard: Array, part: NDArray[np.intp], ratio: float) -> float:
    """Return the Gaussian log likelihood of a part of errors [n, P] by the shrunk correlations of the others."""
    correlation = _shrunk_correlation(np.delete(standard, part, axis=0), ratio)
    factor = np.linalg.cholesky(correlation)
    whitened = np.linalg.solve(factor, standard[part].T)
    return float(-0.5 * np.sum(whitened**2) - len(part) * np.log(np.diag(factor)).sum())


def _shrunk_correlation(standard: Array, ratio: float) -> Array:
    """Return the mean products [P, P] of errors [n, P], those of two columns less by a ratio."""
    count, columns = standard.shape
    correlation = standard.T @ standard / max(count, 1)
    shrunk = (1 - ratio) * correlation + ratio * np.diag(np.diag(correlation))
    shrunk[np.diag_indices(columns)] += ratio * TINY
    return np.asarray(shrunk)
