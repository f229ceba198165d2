"""Scores of a model: on its nine phantoms noise-free and through the camera, and its intervals on random scenes.

Through the camera means: recordings of the simulated probe with fresh noise, the device's own correction, features,
regressions and averaging. The intervals are counted on scenes that neither network nor calibration has seen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from device.measurement.arrays import Array
from device.measurement.bundle import ModelBundle
from device.measurement.calibration import Calibration
from device.measurement.estimate import SPOKEN, Estimate
from device.measurement.paper_mode.estimate import estimate_paper, image_features
from device.measurement.quantities import UNKNOWNS, Inclusion
from device.measurement.recording.recording import Recording
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.calibrate import as_row, fit_line
from host_tools.calibration.phantom import phantom_recording
from host_tools.forward.solve import solve
from host_tools.paper_network.evaluate import ErrorTable, render
from host_tools.scenes.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW, Press, Scene

NOISE_FREE = "noise-free finite-element features"
THROUGH_CAMERA = "through the simulated camera, each with the regressions of the other eight"
SCORED_LOW = (2.0, PAPER_BOX_LOW[1], PAPER_BOX_LOW[2])
"""Below 2 mm the inclusion's contrast drowns in the camera's noise and a relative error of the size means nothing."""


@dataclass(frozen=True)
class Rig:
    """What turns an inclusion into an estimate: model, calibration, and what the virtual probe is made of."""

    bundle: ModelBundle
    calibration: Calibration
    tables: ProbeTables
    scenario: Scenario

    def noise_free(self, truth: Inclusion) -> Array:
        """Return the network's answer [3] to exact finite-element features."""
        return np.asarray(self.bundle.estimate(self.features(truth)[None]).estimate[0])

    def features(self, truth: Inclusion) -> Array:
        """Return the exact deformation features [3] of a press with the certificate's force."""
        return as_row(solve(Scene(truth, Press(force_n=self.calibration.paper_lines.force_n))).inclusion_field)

    def through_camera(self, truth: Inclusion, seed: int) -> Estimate:
        """Return the device's answer to a recording with fresh noise."""
        return estimate_paper(self.recording(truth, seed), self.bundle, self.calibration)

    def recording(self, truth: Inclusion, seed: int) -> Recording:
        """Return a recording of one phantom with fresh noise."""
        return phantom_recording(truth, self.tables, seed=seed, scenario=self.scenario)


def values(estimates: Sequence[Estimate], part: str = "value") -> Array:
    """Return the values of estimates [n, 3], or another part of their quantities; NaN where there is none."""
    rows = [[getattr(getattr(estimate, name), part) for name in UNKNOWNS] for estimate in estimates]
    return np.array([[np.nan if value is None else value for value in row] for row in rows])


def phantom_errors(rig: Rig, phantoms: Sequence[Inclusion], *, seed: int) -> dict[str, ErrorTable]:
    """Return the errors on the model's phantoms, by how they are seen."""
    truth = np.array([phantom.as_tuple() for phantom in phantoms])
    exact = np.array([rig.noise_free(phantom) for phantom in phantoms])
    return {
        NOISE_FREE: ErrorTable(truth, exact),
        THROUGH_CAMERA: ErrorTable(truth, left_out_estimates(rig, phantoms, seed=seed)),
    }


def print_phantoms(errors: Mapping[str, ErrorTable], out: Console) -> None:
    """Print the errors on the model's phantoms beside the paper's."""
    for seen, table in errors.items():
        out.print(f"\n[bold]Nine phantoms, {seen}[/bold]")
        out.print(render(table))


def left_out_estimates(rig: Rig, phantoms: Sequence[Inclusion], *, seed: int) -> Array:
    """Return the estimates [n, 3] of fresh recordings of phantoms, none of them in its own regressions.

    The paper fits its regressions on the very inclusions that it scores; here that would flatter the size by a third.
    """
    calibrated = rig.calibration.paper_lines
    first, fresh = (
        [image_features(rig.recording(p, s + i), calibrated.settings) for i, p in enumerate(phantoms)]
        for s in (seed, seed + len(phantoms))
    )
    image = np.array([rows.mean(axis=0) for rows in first])
    exact = np.array([rig.features(phantom) for phantom in phantoms])
    estimates = []
    for i, rows in enumerate(fresh):
        others = np.arange(len(phantoms)) != i
        lines = tuple(fit_line(x, y)[0] for x, y in zip(image[others].T, exact[others].T, strict=True))
        features = replace(calibrated, regressions=lines).deformation_features(rows)
        estimates.append(rig.bundle.estimate(features).estimate.mean(axis=0))
    return np.array(estimates)


@dataclass(frozen=True)
class SceneIntervals:
    """Random scenes through the camera: truths [n, 3], and whether each is answered [n].

    Of each unknown [n, 3]: whether the truth is inside the interval, whether it is called identifiable, and the
    relative error.
    """

    truth: Array
    answered: NDArray[np.bool_]
    inside: NDArray[np.bool_]
    known: NDArray[np.bool_]
    error_ratio: Array

    def ratios(self) -> dict[str, Sequence[float]]:
        """Return what is said of the scenes, for each unknown."""
        error, known = self.error_ratio, self.known
        guess = np.abs(self.truth.mean(axis=0) - self.truth) / self.truth
        return {
            "truth inside the 90 % interval": self.inside[self.answered].mean(axis=0).tolist(),
            "called identifiable": known[self.answered].mean(axis=0).tolist(),
            "median error": np.median(error[self.answered], axis=0).tolist(),
            "median error where identifiable": [_median(error[:, i][known[:, i]]) for i in range(len(UNKNOWNS))],
            "median error of a constant guess": np.median(guess, axis=0).tolist(),
        }


def random_intervals(rig: Rig, *, scenes: int, seed: int) -> SceneIntervals:
    """Return what random scenes through the camera are answered."""
    truths = np.random.default_rng(seed).uniform(SCORED_LOW, PAPER_BOX_HIGH, (scenes, 3))
    seen = [rig.through_camera(Inclusion(*map(float, row)), seed + 100 + i) for i, row in enumerate(truths)]
    low, high = values(seen, "low"), values(seen, "high")
    known = np.array([[getattr(e, name).identifiable for name in UNKNOWNS] for e in seen])
    error = np.abs(values(seen) - truths) / truths
    inside = np.asarray((low <= truths) & (truths <= high))
    return SceneIntervals(truths, np.asarray(np.isfinite(low).all(axis=1)), inside, known, error)


def print_intervals(found: SceneIntervals, out: Console) -> None:
    """Print errors, coverage and width of the 90 % intervals of random scenes."""
    title = f"{found.answered.sum()} of {len(found.answered)} random scenes answered"
    table = Table("", *(SPOKEN[name] for name in UNKNOWNS), title=title)
    for name, ratios in found.ratios().items():
        table.add_row(name, *_percent(ratios))
    out.print("\n[bold]Random scenes (2-15 mm), through the simulated camera with noise[/bold]")
    out.print(table)


def paper_record(errors: Mapping[str, ErrorTable], intervals: SceneIntervals) -> dict[str, Any]:
    """Return the scores of mode paper as JSON; null stands for a number that is none."""
    return {
        "phantoms": {
            seen: {
                "truth": table.truth.tolist(),
                "estimate": table.estimate.tolist(),
                "percent": {name: _by_unknown(total) for name, total in table.totals().items()},
            }
            for seen, table in errors.items()
        },
        "random_scenes": {
            "scenes": len(intervals.answered),
            "answered": int(intervals.answered.sum()),
            "ratios": {name: _by_unknown(ratios) for name, ratios in intervals.ratios().items()},
        },
    }


def _by_unknown(numbers: Sequence[float] | Array) -> dict[str, float | None]:
    return {name: float(x) if np.isfinite(x) else None for name, x in zip(UNKNOWNS, numbers, strict=True)}


def _median(errors: Array) -> float:
    return float(np.median(errors)) if len(errors) else float("nan")


def _percent(ratios: Sequence[float] | Array) -> list[str]:
    return ["-" if np.isnan(ratio) else f"{100 * ratio:.1f} %" for ratio in ratios]
