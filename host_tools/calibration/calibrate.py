"""Phantom recordings with truth to a calibration certificate.

Three straight lines map image features to deformation features; their leave-one-out residuals say how well. Those
residuals, put on scenes of the whole box and sent through the network, give the held-out scenes behind every interval.
Source: Lee & Won 2013, section III (regressions on nine phantoms).

What else a certificate holds: host_tools/calibration/certified_probe.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np

from device import __version__
from device.measurement.arrays import Array
from device.measurement.bundle import ModelBundle
from device.measurement.calibration import (
    VALID_DAYS,
    Calibration,
    Validity,
    certificate_id,
    written,
)
from device.measurement.paper_mode.estimate import PAPER_UNITS, image_features
from device.measurement.paper_mode.features import FeatureSettings
from device.measurement.paper_mode.intervals import HeldOut
from device.measurement.paper_mode.lines import PaperLines, Regression
from device.measurement.paper_mode.trained_press import other_press
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.recording import Recording
from device.measurement.recording.untouched_face import UntouchedFace
from device.simulation.physics.surface_table import SurfaceTable
from host_tools.calibration.certified_probe import oldest_at, source_sha256, untouched_face
from host_tools.calibration.gates import (
    Gate,
    age_gate,
    agreed_cell,
    fit_gates,
    number_gate,
    phantom_numbers,
    recording_gates,
    require_all,
    unusable,
)
from host_tools.calibration.known_bench import KnownBench
from host_tools.forward.deformation import Deformation, deformation
from host_tools.forward.solve import solve
from host_tools.scenes.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW

A_YEAR_DAYS = 365.0
HELD_OUT_SCENES = 1000
WEAKEST_PEAK_MM = 5e-4
"""Inclusions with a lower peak are not answered (contrast below 0.2 %), so their area's error need not grow further."""


@dataclass(frozen=True)
class Provenance:
    """What no recording knows: who calibrated, on which set of phantoms, when, and for how many days it is to hold.

    Without `phantom_serial` it is what the recordings say, without `made_at` (RFC 3339) now; without `valid_days`, a
    year, or of a simulated probe a hundred.
    """

    operator: str = ""
    phantom_serial: str = ""
    made_at: str | None = None
    valid_days: float | None = None


class Calibrated(NamedTuple):
    """A certificate and the gates that it has passed."""

    certificate: Calibration
    gates: tuple[Gate, ...]


class Fit(NamedTuple):
    """Three lines, their leave-one-out residuals [phantoms, 3], and the deformation features [phantoms, 3]."""

    lines: tuple[Regression, ...]
    residuals: Array
    features: Array


class Measured(NamedTuple):
    """What phantom recordings measure, once it has passed its gates."""

    made_at: str
    validity: Validity
    untouched: UntouchedFace
    fit: Fit
    gates: tuple[Gate, ...]


def calibrate(
    recordings: Sequence[Recording],
    bundle: ModelBundle,
    table: SurfaceTable,
    *,
    force_n: float,
    provenance: Provenance | None = None,
    bench: KnownBench | None = None,
    seed: int = 1,
) -> Calibrated:
    """Return the certificate of the probe that made the recordings.

    `bench` says what pressed on which tissue: the simulated probe's waveguide on the default tissue unless given.
    Raises `CalibrationRejected`, an `InvalidQuantity`, with everything that the recordings do not hold, and in what
    their press is not that of the model's training.
    """
    stated, known = provenance or Provenance(), bench or KnownBench()
    settings = FeatureSettings(window_radius_mm=known.waveguide.central_radius_mm)
    foreign = tuple(other_press(bundle.card, force_n, asdict(known.waveguide)))
    known = replace(known, contradictions=(*known.contradictions, *foreign))
    measured = _measured(recordings, settings, force_n, stated, known)
    errors = scaled_errors(measured.fit.residuals, measured.fit.features[:, 0])
    first = recordings[0]
    lines = PaperLines(
        model_sha256=bundle.sha256,
        model_card_sha256=bundle.card_sha256,
        force_n=force_n,
        settings=settings,
        regressions=measured.fit.lines,
        held_out=held_out_scenes(bundle, table, errors, force_n=force_n, seed=seed),
    )
    certificate = Calibration(
        id="",
        made_at=measured.made_at,
        validity=measured.validity,
        operator=stated.operator,
        serial=first.serial,
        phantom_serial=stated.phantom_serial or first.phantom_serial,
        camera=first.camera,
        cell=agreed_cell(recordings),
        untouched=measured.untouched,
        phantoms=len(recordings),
        software=__version__,
        software_sha256=source_sha256(),
        simulated=any(recording.simulated for recording in recordings),
        lines=lines,
    )
    return Calibrated(replace(certificate, id=certificate_id(certificate)), measured.gates)


def _measured(
    recordings: Sequence[Recording], settings: FeatureSettings, force_n: float, stated: Provenance, bench: KnownBench
) -> Measured:
    """Return what the recordings measure; raise `CalibrationRejected` when that is not good enough."""
    problems = [*unusable(recordings, force_n, stated.phantom_serial), *bench.contradictions]
    require_all([number_gate(recordings)], problems)
    made_at = stated.made_at or written(datetime.now(UTC))
    validity = _validity(recordings, stated.valid_days)
    untouched = untouched_face(recordings)
    fit = _fit(recordings, settings, force_n, bench)
    of_recordings = recording_gates(recordings, untouched)
    gates = (*of_recordings, age_gate(validity, made_at), *fit_gates(fit.lines, fit.features))
    require_all(gates)
    return Measured(made_at, validity, untouched, fit, gates)


def _validity(recordings: Sequence[Recording], valid_days: float | None) -> Validity:
    """Return the days from the first of the recordings: a calibration is as old as its oldest phantom."""
    is_ageless = all(recording.simulated for recording in recordings)
    usual_days = VALID_DAYS.high if is_ageless else A_YEAR_DAYS
    return Validity.of(oldest_at(recordings), usual_days if valid_days is None else valid_days)


def _fit(recordings: Sequence[Recording], settings: FeatureSettings, force_n: float, bench: KnownBench) -> Fit:
    image = np.array([image_features(recording, settings).mean(axis=0) for recording in recordings])
    truths = [recording.truth for recording in recordings if recording.truth]
    scenes = [bench.scene(place, truth, force_n) for place, truth in enumerate(truths)]
    features = np.array([as_row(solve(scene).inclusion_field) for scene in scenes])
    phantoms = phantom_numbers(recordings)
    fits = (fit_line(image[:, i], features[:, i], phantoms) for i in range(features.shape[1]))
    lines, residuals = zip(*fits, strict=True)
    return Fit(lines, np.column_stack(residuals), features)


def as_row(inclusion: Deformation) -> Array:
    """Return the deformation features in the model's order."""
    return np.array([getattr(inclusion, name) for name in PAPER_UNITS])


def fit_line(x: Array, y: Array, phantoms: Sequence[int] | None = None) -> tuple[Regression, Array]:
    """Return the least-squares line y = slope x + intercept and its leave-one-out residuals.

    All recordings of a phantom, by their number in `phantoms`, are left out together: (1 - H)^-1 e of their part of the
    hat matrix. Unless given each is of its own.
    """
    if np.ptp(x) <= 1e-9 * np.abs(x).max():
        raise InvalidQuantity("phantoms' features", "all equal", "different", "use phantoms of different inclusions")
    design = np.column_stack([x, np.ones_like(x)])
    (slope, intercept), *_ = np.linalg.lstsq(design, y, rcond=None)
    error = y - design @ (slope, intercept)
    without = np.eye(len(x)) - design @ np.linalg.inv(design.T @ design) @ design.T
    left_out, numbers = np.empty(len(x)), np.arange(len(x)) if phantoms is None else np.asarray(phantoms)
    for number in np.unique(numbers):
        of_one = numbers == number
        left_out[of_one] = np.linalg.solve(without[np.ix_(of_one, of_one)], error[of_one])
    r_squared = 1 - float(error @ error) / float(np.sum((y - y.mean()) ** 2))
    return Regression(float(slope), float(intercept), r_squared, float(left_out.std(ddof=1))), left_out


def table_features(table: SurfaceTable, inclusion: Inclusion, force_n: float) -> Array:
    """Return the deformation features of an inclusion in small strain, the network's own, from the table of faces."""
    inclusion_mm = table.inclusion_field(inclusion).at_small_strain(force_n).w_mm
    total_mm3 = float(np.trapezoid(2 * np.pi * table.r_mm * inclusion_mm, table.r_mm))
    return as_row(deformation(table.r_mm, inclusion_mm, total_mm3))


def scaled_errors(residuals: Array, peak_mm: Array) -> Array:
    """Return residuals [n, 3] as errors that do not depend on how strong the inclusion is.

    A contrast error dc shifts the half-maximum contour by dc / slope, and the slope grows with the peak: so the area's
    error times the peak is constant, while peak and sum err by the same amount for every inclusion.
    """
    peak, total, area = residuals.T
    return np.column_stack([peak, total, area * peak_mm])


def held_out_scenes(
    bundle: ModelBundle, table: SurfaceTable, errors: Array, *, force_n: float, seed: int, scenes: int = HELD_OUT_SCENES
) -> HeldOut:
    """Return estimates of random scenes whose features carry errors like the calibration's own `scaled_errors`."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform(PAPER_BOX_LOW, PAPER_BOX_HIGH, (scenes, 3))
    exact = np.array([table_features(table, Inclusion(*map(float, row)), force_n) for row in truth])
    drawn = rng.multivariate_normal(np.zeros(3), errors.T @ errors / len(errors), scenes)
    drawn[:, 2] /= np.maximum(exact[:, 0], WEAKEST_PEAK_MM)
    estimate = bundle.estimate(exact + drawn).estimate
    return HeldOut(estimate, truth, box_low=np.array(PAPER_BOX_LOW), box_high=np.array(PAPER_BOX_HIGH))
