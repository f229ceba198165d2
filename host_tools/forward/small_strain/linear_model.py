"""Closed sliding in small strain as a `PressModel`: one solution, scaled to every press that folds nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from host_tools.forward.face_state import FaceState
from host_tools.forward.materials import Elasticity
from host_tools.forward.press_model import Loaded, PressFailed
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.element_residual import ElementResidual
from host_tools.forward.small_strain.folding import Folding
from host_tools.forward.small_strain.linear_press import LinearPress, SolvedPress
from host_tools.forward.symmetry import AXISYMMETRIC, Symmetry
from host_tools.scenes.scene import Press


class LinearModel:
    """Closed sliding in small strain as a `PressModel`: one solution, scaled to every press."""

    def __init__(
        self, mesh: Any, symmetry: Symmetry, sampler: FaceSampler, *, order: int, other_order: int, mixed: bool
    ) -> None:
        self.mesh, self.symmetry, self.sampler, self.mixed = mesh, symmetry, sampler, mixed
        self.order, self.other_order = order, other_order

    def press(self, elasticity: Elasticity, presses: Sequence[Press], *, estimate_error: bool) -> tuple[Loaded, ...]:
        """Return the face at every press, at the model's order and at the other; raise `PressFailed` where it folds."""
        solved = self._solved(elasticity, self.order)
        unit = self._unit(solved)
        require_reach(presses, unit, Folding(solved.press.contact, solved.u))
        if not estimate_error:
            return tuple(Loaded(at_press(press, unit), None) for press in presses)
        other = self._solved(elasticity, self.other_order)
        other_unit, residual = self._unit(other), self._residual(other, solved)
        return tuple(Loaded(at_press(press, unit), at_press(press, other_unit), residual) for press in presses)

    def _solved(self, elasticity: Elasticity, order: int) -> SolvedPress:
        return SolvedPress(LinearPress(self.mesh, self.symmetry, order, mixed=self.mixed), elasticity)

    def _unit(self, solved: SolvedPress) -> FaceState:
        return solved.press.face_state(solved.u, solved.elasticity, self.sampler)

    def _residual(self, low: SolvedPress, high: SolvedPress) -> ElementResidual | None:
        if self.mixed or self.symmetry is not AXISYMMETRIC or self.other_order != self.order - 1:
            return None
        return ElementResidual(low, high, self.sampler)


def at_press(press: Press, unit: FaceState) -> FaceState:
    """Return the unit press scaled to the indentation or force asked for."""
    if press.indentation_mm is not None:
        return unit.scaled(press.indentation_mm / unit.indentation_mm)
    assert press.force_n is not None  # Press guarantees one of the two
    return unit.scaled(press.force_n / unit.force_n)


def require_reach(presses: Sequence[Press], unit: FaceState, folding: Folding) -> None:
    """Refuse a press that would turn matter inside out, with the largest one that does not."""
    deepest = max((at_press(press, unit) for press in presses), key=lambda state: state.indentation_mm)
    scale = deepest.indentation_mm / unit.indentation_mm
    if deepest.indentation_mm < folding.slab_mm and not folding.folds(scale):
        return
    largest = unit.scaled(folding.largest_scale(min(scale, folding.slab_mm / unit.indentation_mm)))
    raise out_of_reach(presses, deepest, largest, folding.slab_mm)


def out_of_reach(presses: Sequence[Press], asked: FaceState, largest: FaceState, slab_mm: float) -> PressFailed:
    """Return the exception that says what was asked for, and the largest press that can be had."""
    by_force = any(press.force_n is not None for press in presses)
    quantity = f"force_n is {asked.force_n:g} N" if by_force else f"indentation_mm is {asked.indentation_mm:g} mm"
    limit = f"{largest.force_n:.3g} N" if by_force else f"{largest.indentation_mm:.3g} mm"
    return PressFailed(
        f"{quantity}, but must be below {limit}: at {largest.indentation_mm:.3g} mm of indentation and "
        f"{largest.force_n:.3g} N small strain begins to turn probe or tissue inside out in this slab "
        f"of {slab_mm:g} mm. Press less."
    )
