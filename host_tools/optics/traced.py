"""A scene for the ray tracer and what it returns: the face, the camera's view, and where all the light went.

Radiance is per unit of emitted LED light, 1/(sr mm2), averaged over a cell; its noise is measured from independent
batches, not assumed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import InvalidQuantity
from host_tools.optics.height_field import HeightField
from host_tools.optics.ray import BOOKS, COUNTERS, TALLIES

GRID = "give ascending, evenly spaced coordinates and fields of shape [ny, nx]"


@dataclass(frozen=True)
class TracedFace:
    """The sensing face: evenly spaced `x_mm` [nx], `y_mm` [ny], and [ny, nx] `w_mm` and `contact_ratio`.

    w > 0 pushes the face into the block; beyond the grid both fields go on as at its edge. Without `skin_behind`,
    skin is only where it is in contact and the air gap is dark.
    Raises `InvalidQuantity` for uneven coordinates, wrong shapes, or contact outside 0..1.
    """

    x_mm: Array
    y_mm: Array
    w_mm: Array
    contact_ratio: Array
    skin_behind: bool = True

    def __post_init__(self) -> None:
        for name in ("x_mm", "y_mm"):
            steps = np.diff(getattr(self, name))
            if not (len(steps) and steps.min() > 0 and np.ptp(steps) < 1e-4 * steps.max()):
                raise InvalidQuantity(name, f"{len(steps) + 1} points", "evenly spaced", GRID)
        for name in ("w_mm", "contact_ratio"):
            field, shape = getattr(self, name), (len(self.y_mm), len(self.x_mm))
            if field.shape != shape or not np.isfinite(field).all():
                raise InvalidQuantity(name, f"of shape {field.shape}", f"finite, of shape {shape}", GRID)
        if self.contact_ratio.min() < 0 or self.contact_ratio.max() > 1:
            found = f"{self.contact_ratio.min():g} to {self.contact_ratio.max():g}"
            raise InvalidQuantity("contact_ratio", found, "at least 0 and at most 1", "use Skin.contact_ratio")

    def height_field(self, thickness_mm: float) -> HeightField:
        """Return the face of a block of this thickness as the compiled tracer reads it."""
        w = np.ascontiguousarray(self.w_mm, dtype=np.float64)
        dx, dy = float(self.x_mm[1] - self.x_mm[0]), float(self.y_mm[1] - self.y_mm[0])
        along_x, along_y = np.abs(np.diff(w, axis=1)).max() / dx, np.abs(np.diff(w, axis=0)).max() / dy
        x0, y0 = float(self.x_mm[0]), float(self.y_mm[0])
        steepest = math.hypot(along_x, along_y)
        return HeightField(w, x0, y0, dx, dy, 1 / dx, 1 / dy, thickness_mm, float(w.max()), float(w.min()), steepest)


@dataclass(frozen=True)
class Traced:
    """What the camera sees, and the energy balance, all per unit of emitted LED light.

    `radiance` [ny, nx] in 1/(sr mm2) at the cells' centres `x_mm`, `y_mm`. `noise_ratio`: rms standard error of a
    cell over the brightest cell. `ledger`: where the light ended (sums to 1); `roulette` is the statistical difference
    from ending faint rays. `bottom_loss`: share that left through the glass; `specular_into_aperture`: of it, into the
    camera's lens unscattered. `reemitted`: given back by the skin. `hits_per_ray`: meetings with the face. `scattered`:
    light [ny, nx] in 1/mm2 that a wet or dry face takes in after a wall or haze (`stray_*`) or after the skin
    (`returned_*`).
    """

    x_mm: Array
    y_mm: Array
    radiance: Array
    noise_ratio: float
    ledger: dict[str, float]
    reemitted: float
    specular_into_aperture: float
    hits_per_ray: float
    scattered: dict[str, Array]

    @property
    def bottom_loss(self) -> float:
        """Share of the light that left through the bottom."""
        return self.ledger["bottom"]


def summed_up(tallies: Array, ledgers: Array, half_width_mm: float) -> Traced:
    """Return the mean of independent batches, tallies [batch, kind, ny, nx] and ledgers [batch, entry]."""
    batches, _, cells, _ = tallies.shape
    means = tallies.mean(axis=0)
    radiance = tallies[:, 0]
    error = radiance.std(axis=0, ddof=1) / math.sqrt(batches)
    books = dict(zip(BOOKS + COUNTERS, ledgers.mean(axis=0).tolist(), strict=True))
    centres = (np.arange(cells) + 0.5) * (2 * half_width_mm / cells) - half_width_mm
    peak = float(means[0].max())
    return Traced(
        x_mm=centres,
        y_mm=centres.copy(),
        radiance=means[0],
        noise_ratio=float(np.sqrt(np.mean(error**2)) / peak) if peak else 0.0,
        ledger={name: books[name] for name in BOOKS},
        reemitted=books["reemitted"],
        specular_into_aperture=books["specular_into_aperture"],
        hits_per_ray=books["hits"],
        scattered=dict(zip(TALLIES[1:], means[1:], strict=True)),
    )
