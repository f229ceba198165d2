"""Phantom recordings with truth to a calibration certificate.

Three straight lines map image features to deformation features; their leave-one-out residuals say how well. Those
residuals, put on scenes of the whole box and sent through the network, give the held-out scenes behind every interval.
Source: Lee & Won 2013, section III (regressions on nine phantoms).
"""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from device import __version__
from device.measurement.calibration import FORCE_TOLERANCE, Calibration, Regression
from device.measurement.estimate import image_features
from device.measurement.features import FeatureSettings
from device.measurement.intervals import HeldOut
from device.measurement.inversion import FEATURE_UNITS, ModelBundle
from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require
from device.measurement.recording import Recording
from device.simulation.surface_table import SurfaceTable
from host_tools.forward.deformation import Deformation, deformation
from host_tools.forward.solve import solve
from host_tools.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW, Press, Scene, Waveguide

Array = NDArray[np.float64]

PHANTOMS_NEEDED = 4
"""A line with a leave-one-out error needs at least this many."""
HELD_OUT_SCENES = 1000
WEAKEST_PEAK_MM = 5e-4
"""Lumps with a lower peak are not answered (contrast below 0.2 %), so their area's error need not grow further."""


def calibrate(
    recordings: Sequence[Recording], bundle: ModelBundle, table: SurfaceTable, *, force_n: float, seed: int = 1
) -> Calibration:
    """Return the certificate of the probe that made the recordings; raises `InvalidQuantity` on what cannot be used."""
    serial = _require_usable(recordings, force_n)
    settings = FeatureSettings(window_radius_mm=Waveguide().central_radius_mm)
    image = np.array([image_features(recording, settings).mean(axis=0) for recording in recordings])
    truths = [recording.truth for recording in recordings if recording.truth]
    features = np.array([as_row(solve(Scene(truth, Press(force_n=force_n))).lump) for truth in truths])
    lines, residuals = zip(*(fit_line(image[:, i], features[:, i]) for i in range(features.shape[1])), strict=True)
    errors = scaled_errors(np.column_stack(residuals), features[:, 0])
    held_out = held_out_scenes(bundle, table, errors, force_n=force_n, seed=seed)
    return Calibration(
        id=str(uuid.uuid5(uuid.NAMESPACE_OID, f"{serial} {bundle.sha256} {image.tobytes().hex()}")),
        made_at=datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z"),
        serial=serial,
        model_sha256=bundle.sha256,
        model_card_sha256=bundle.card_sha256,
        force_n=force_n,
        scale=recordings[0].camera.scale,
        settings=settings,
        regressions=lines,
        phantoms=len(recordings),
        held_out=held_out,
        software=__version__,
        simulated=any(recording.simulated for recording in recordings),
    )


def _require_usable(recordings: Sequence[Recording], force_n: float) -> str:
    action = "record more phantoms"
    require("phantom recordings", len(recordings), Bound(PHANTOMS_NEEDED, 10_000, "recordings"), action)
    for recording in recordings:
        presses = len(recording.with_role("press"))
        require(f"press frames of {recording.id}", presses, Bound(1, 1e6, "frames"), "record the phantom again")
        mean_n = float(np.mean([frame.force_n for frame in recording.with_role("press")]))
        bound = Bound(force_n * (1 - FORCE_TOLERANCE), force_n * (1 + FORCE_TOLERANCE), "N")
        require(f"mean force of {recording.id}", mean_n, bound, "press the phantom with the force of --force-n")
        if recording.camera.scale != recordings[0].camera.scale:
            raise InvalidQuantity("pixel size", recording.camera.scale, "the same in all recordings", "record anew")
        if recording.truth is None:
            raise InvalidQuantity(
                "truth", f"missing in {recording.id}", "the phantom's inclusion", "add it or leave it out"
            )
    serials = sorted({recording.serial for recording in recordings})
    if len(serials) > 1:
        raise InvalidQuantity("serial", " and ".join(serials), "one probe", "calibrate each probe on its own")
    return serials[0]


def as_row(lump: Deformation) -> Array:
    """Return the deformation features in the model's order."""
    return np.array([getattr(lump, name) for name in FEATURE_UNITS])


def fit_line(x: Array, y: Array) -> tuple[Regression, Array]:
    """Return the least-squares line y = slope x + intercept and its leave-one-out residuals e_i / (1 - h_ii)."""
    if np.ptp(x) <= 1e-9 * np.abs(x).max():
        raise InvalidQuantity("phantoms' features", "all equal", "different", "use phantoms of different inclusions")
    design = np.column_stack([x, np.ones_like(x)])
    (slope, intercept), *_ = np.linalg.lstsq(design, y, rcond=None)
    error = y - design @ (slope, intercept)
    leverage = np.sum(design @ np.linalg.inv(design.T @ design) * design, axis=1)
    left_out = error / (1 - leverage)
    r_squared = 1 - float(error @ error) / float(np.sum((y - y.mean()) ** 2))
    return Regression(float(slope), float(intercept), r_squared, float(left_out.std(ddof=1))), left_out


def table_features(table: SurfaceTable, inclusion: Inclusion, force_n: float) -> Array:
    """Return the deformation features of an inclusion in small strain, the network's own, from the table of faces."""
    lump_mm = table.lump(inclusion).at_small_strain(force_n).w_mm
    total_mm3 = float(np.trapezoid(2 * np.pi * table.r_mm * lump_mm, table.r_mm))
    return as_row(deformation(table.r_mm, lump_mm, total_mm3))


def scaled_errors(residuals: Array, peak_mm: Array) -> Array:
    """Return residuals [n, 3] as errors that do not depend on how strong the lump is.

    A contrast error dc shifts the half-maximum contour by dc / slope, and the slope grows with the peak: so the area's
    error times the peak is constant, while peak and sum err by the same amount for every lump.
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
