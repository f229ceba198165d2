"""The solution of a scene: the face with the inclusion and without it, their difference, and what it is good for."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from device.measurement.arrays import Array
from host_tools.forward.deformation import Deformation, deformation
from host_tools.forward.face_state import RADII, FaceState, Rays
from host_tools.forward.plan import ModelPlan
from host_tools.scenes.scene import Scene

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

PAPER_FEATURES = ("max_deformation_mm", "central_deformation_mm3", "deformation_area_mm2")
"""O1-O3 as the inversion uses them."""
PRESSED_RATIO = 0.95
"""Where the pressure must be positive, over the face: at the rim itself it is singular and its sign means nothing."""
RING_RATIO = 0.1
"""Width of the rings whose force must be positive, over the face: as wide as an element at a blunt rim, inside which
the pressure rings between both signs while its sum is right."""


@dataclass(frozen=True, repr=False)
class Solution:
    """What one scene does to the probe. Rays are those of the face; a single one in axisymmetry.

    `stated_error` is relative and estimated (docs/forward_model.md), empty where no estimate was asked for, infinite
    where it is not known. `scene` is what was solved, with its press.
    """

    rays: Rays
    pressed: FaceState
    baseline: FaceState
    plan: ModelPlan
    elements: int
    stated_error: dict[str, float]
    scene: Scene

    @cached_property
    def inclusion_field(self) -> Deformation:
        """O1-O3 of the inclusion field."""
        total_mm3 = self.pressed.total_mm3 - self.baseline.total_mm3
        return deformation(self.rays.r_mm, self.pressed.w_mm - self.baseline.w_mm, total_mm3)

    @cached_property
    def raw(self) -> Deformation:
        """O1-O3 of the deformation itself, the paper's literal protocol."""
        return deformation(self.rays.r_mm, self.pressed.w_mm, self.pressed.total_mm3)

    @property
    def r_mm(self) -> Array:
        """Radii of the first ray, along +x, where an offset inclusion lies; so are the four profiles below."""
        return np.asarray(self.rays.r_mm[0])

    @property
    def w_mm(self) -> Array:
        """Deformation of the face along +x."""
        return np.asarray(self.pressed.w_mm[0])

    @property
    def w_baseline_mm(self) -> Array:
        """The same press without the inclusion."""
        return np.asarray(self.baseline.w_mm[0])

    @property
    def inclusion_deformation_mm(self) -> Array:
        """The inclusion field along +x: w minus the w of the same press without the inclusion."""
        return self.w_mm - self.w_baseline_mm

    @property
    def p_kpa(self) -> Array:
        """Contact pressure along +x, as force per undeformed area: what the probe's tables and models are made of.

        Its last sample, at the rim, grows with the mesh and means nothing.
        """
        return np.asarray(self.pressed.p_kpa[0])

    @property
    def deformed_p_kpa(self) -> Array:
        """Contact pressure along +x, as force per deformed area; of small strain the same."""
        return np.asarray(self.pressed.deformed_p_kpa(self.rays)[0])

    @property
    def p_baseline_kpa(self) -> Array:
        """Contact pressure without the inclusion."""
        return np.asarray(self.baseline.p_kpa[0])

    @property
    def force_n(self) -> float:
        """Force on the probe."""
        return self.pressed.force_n

    @property
    def indentation_mm(self) -> float:
        """Displacement of the probe's back."""
        return self.pressed.indentation_mm

    @property
    def pressure_is_positive(self) -> bool:
        """Whether no ring of the face is pulled; if one is, closed contact is not the solution.

        Unilateral contact cannot pull, however its sampled pressure rings at the edge of the contact.
        """
        if self.plan.contact == "unilateral":
            return True
        inner = self.r_mm <= PRESSED_RATIO * self.r_mm[-1]
        states = (self.pressed, self.baseline)
        return all((_ring_force(self.rays.r_mm[:, inner], state.p_kpa[:, inner]) > 0).all() for state in states)

    def as_record(self) -> dict[str, Any]:
        """Return the solution as the JSON object that `host_tools simulate --json` prints."""
        record = {
            "force_n": self.force_n,
            "contact_force_n": self.pressed.contact_force_n,
            "indentation_mm": self.indentation_mm,
            **asdict(self.inclusion_field),
            "raw": asdict(self.raw),
            "pressure_is_positive": self.pressure_is_positive,
            "stated_error": self.stated_error,
            "plan": self.plan.as_record() | {"elements": self.elements},
            "r_mm": self.r_mm.tolist(),
            "w_mm": self.w_mm.tolist(),
            "w_baseline_mm": self.w_baseline_mm.tolist(),
            "p_kpa": self.p_kpa.tolist(),
            "deformed_p_kpa": self.deformed_p_kpa.tolist(),
        }
        return record if len(self.rays.angle_rad) == 1 else record | self._fields()

    def to_xarray(self) -> xr.Dataset:
        """Return the solution as a data set with units, one row long; `solve_ramp`'s are put together by `dataset_of`.

        Of `host_tools/forward/solution_dataset.py`, which says which names it has.
        """
        from host_tools.forward.solution_dataset import dataset_of

        return dataset_of([self])

    def plot(self) -> Figure:
        """Return a figure of three panels: the deformed face, what the inclusion adds, and the contact pressure."""
        from host_tools.forward.plots import plot_solution

        return plot_solution(self)

    def __repr__(self) -> str:
        """Return one line: load, O1-O3 and the model."""
        o1, o2, o3 = (getattr(self.inclusion_field, name) for name in PAPER_FEATURES)
        load = f"{self.force_n:.4g} N at {self.indentation_mm:.4g} mm"
        inclusion = f"the inclusion adds O1 {o1:.4g} mm, O2 {o2:.4g} mm3, O3 {o3:.4g} mm2"
        model = f"{self.plan.symmetry}, {self.plan.strain} strain, {self.elements} elements"
        return f"<Solution: {load}; {inclusion}; {model}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: numbers with their errors, the plan with its reasons, and the figure."""
        from host_tools.forward.solution_html import solution_html

        return solution_html(self)

    def _fields(self) -> dict[str, Any]:
        """Return the whole fields, one row a ray."""
        return {
            "angle_deg": np.rad2deg(self.rays.angle_rad).tolist(),
            "r_field_mm": self.rays.r_mm.tolist(),
            "w_field_mm": self.pressed.w_mm.tolist(),
            "w_baseline_field_mm": self.baseline.w_mm.tolist(),
            "p_field_kpa": self.pressed.p_kpa.tolist(),
        }


def _ring_force(r_mm: Array, p_kpa: Array) -> Array:
    """Return the force (mN per radian) on every ring of a face [A, R], each as wide as `RING_RATIO` says."""
    density = r_mm * p_kpa
    steps = np.diff(r_mm, axis=-1) * (density[:, 1:] + density[:, :-1]) / 2
    within = np.pad(np.cumsum(steps, axis=-1), ((0, 0), (1, 0)))
    width = max(1, round(RING_RATIO * RADII))
    return np.asarray(within[:, width:] - within[:, :-width])
