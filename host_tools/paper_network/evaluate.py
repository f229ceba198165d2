"""Turns truths and estimates into relative errors, and these into the table the paper prints.

A relative error is |estimate - truth| / truth, so it is meaningless near a truth of zero (a vanishing inclusion).
Source of the paper's figures: Lee & Won, IEEE JBHI 17(2), 2013, section IV-A (nine phantoms, mean of 100 trials).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from rich.table import Table

from device.measurement.arrays import Array
from device.measurement.quantities import UNKNOWNS, InvalidQuantity

PAPER_PERCENT = {
    "mean": (6.98, 7.17, 5.07),
    "SD": (6.28, 7.47, 3.39),
    "min": (0.7, 2.2, 1.1),
    "max": (20.0, 26.4, 11.72),
}
"""Relative errors of (size, depth, Young's modulus) in the paper. Its body says 6.99 where its abstract says 6.98."""


def relative_errors(truth: Array, estimate: Array) -> Array:
    """Return |estimate - truth| / truth [n, 3]; raises `InvalidQuantity` for a truth that is not above zero."""
    for row, column in np.argwhere(~(truth > 0.0)):
        name = f"{UNKNOWNS[column]} of row {row}"
        raise InvalidQuantity(name, truth[row, column], "above 0", "leave the scene out of relative errors")
    return np.asarray(np.abs(estimate - truth) / truth)


@dataclass(frozen=True, eq=False)
class ErrorTable:
    """Truths and estimates of scenes [n, 3], n >= 2, with their relative errors in percent."""

    truth: Array
    estimate: Array

    @property
    def percent(self) -> Array:
        """Relative error of each scene and unknown, in percent [n, 3]."""
        return 100.0 * relative_errors(self.truth, self.estimate)

    def totals(self) -> dict[str, Array]:
        """Return mean, SD (of the sample, n - 1), min and max over the scenes, in percent, each [3]."""
        percent = self.percent
        return {
            "mean": percent.mean(axis=0),
            "SD": percent.std(axis=0, ddof=1),
            "min": percent.min(axis=0),
            "max": percent.max(axis=0),
        }


def render(errors: ErrorTable) -> Table:
    """Return a table for the terminal: one line a scene, then the totals beside the paper's."""
    table = Table(title="Relative error on held-out scenes (paper's figure in brackets)")
    table.add_column("scene")
    for name in ("size", "depth", "Young's modulus"):
        table.add_column(name, justify="right")
    units = [name.rpartition("_")[2].replace("kpa", "kPa") for name in UNKNOWNS]
    for index, (truth, estimate, percent) in enumerate(zip(errors.truth, errors.estimate, errors.percent, strict=True)):
        cells = zip(estimate, truth, units, percent, strict=True)
        table.add_row(str(index + 1), *(f"{e:.2f} for {t:.2f} {unit}: {p:.1f} %" for e, t, unit, p in cells))
    table.add_section()
    for name, ours in errors.totals().items():
        table.add_row(name, *(f"{o:.2f} % ({p:g} %)" for o, p in zip(ours, PAPER_PERCENT[name], strict=True)))
    return table
