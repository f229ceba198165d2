"""The shift of the tissue's labels on the face to one in the whole tissue: harmonic, so smooth and without overshoot.

It vanishes on the axis, base, side and in the inclusion, and is free on the skin. Only radii are relabelled, so
planes between tissue layers stay where they are.
"""

from __future__ import annotations

from typing import Any

from ngsolve import BilinearForm, IfPos, Integrate, Projector, dx, grad, x

from host_tools.forward.materials import FLESH, INCLUSION
from host_tools.forward.symmetry import AXISYMMETRIC


class LabelSpread:
    """Harmonic extension, in a space of shifts over the tissue, of the values on its face."""

    def __init__(self, labels: Any) -> None:
        self.labels, mesh = labels, labels.mesh
        self.flesh = dx(FLESH, bonus_intorder=AXISYMMETRIC.bonus_order)
        kept = labels.GetDofs(mesh.Boundaries("face|base|side")) | labels.GetDofs(mesh.Materials(INCLUSION))
        self.inner = labels.FreeDofs() & ~kept
        self.on_face = Projector(labels.GetDofs(mesh.Boundaries("face")) & labels.FreeDofs(), True)
        m, n = labels.TnT()
        self.laplacian = BilinearForm(labels, symmetric=True)
        self.laplacian += (grad(m) * grad(n) + m * n / x**2) * x * self.flesh  # of the vector field m e_r
        self.laplacian.Assemble()
        self.inverse = self.laplacian.mat.Inverse(self.inner, "sparsecholesky")

    def __call__(self, shift: Any) -> Any:
        """Return the vector (mm) that agrees with a given one on the face and is harmonic elsewhere."""
        spread, rest = shift.CreateVector(), shift.CreateVector()
        spread.data = shift
        self.on_face.Project(spread)
        rest.data = self.laplacian.mat * spread
        spread.data -= self.inverse * rest
        return spread

    def in_order(self, shift: Any) -> bool:
        """Return whether no label overtakes its neighbour: 1 + dm/dr > 0 and 1 + m/r > 0 at every quadrature point."""
        smallest = IfPos(1 + grad(shift)[0], 0, 1) + IfPos(1 + shift / x, 0, 1)
        return float(Integrate(smallest * self.flesh, self.labels.mesh)) == 0.0
