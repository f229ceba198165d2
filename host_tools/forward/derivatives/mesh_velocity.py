"""A scene's lengths to velocities of its mesh: how every point moves when a size, a depth or a thickness changes.

The inclusion is moved as a whole or blown up from its top, the base is moved, the probe and the skin stay; in between
the velocity is harmonic, so no element is torn. A derivative taken along it belongs to one mesh: remeshing would add
jumps of some 1e-5, more than some of the derivatives. Source: Haslinger & Makinen, Introduction to Shape Optimization
(2003), chapter 3 (material derivative).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ngsolve import CF, BilinearForm, Grad, GridFunction, InnerProduct, Mesh, VectorH1, dx, x, y, z

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.forward.materials import FLESH, INCLUSION, LAYERS
from host_tools.scenes.scene import Scene

OFFSET = "offset_x_mm"
HELD = {"dirichlet": "face|skin|base", "dirichletx": "axis|side|plane_x", "dirichlety": "plane_y"}
"""Where the mesh stands still: whole, and along each axis; in axisymmetry y is the height and no plane cuts it."""


def mesh_velocities(scene: Scene, mesh: Any) -> dict[str, Any]:
    """Return the velocity (mm, grid function) per unit of ln d, ln h and ln T, and in 3-D per mm of the offset.

    The mesh is that of the scene, as it stands deformed. Raise `InvalidQuantity` for a scene without an inclusion or
    with layers in its tissue: their planes would be dragged along.
    """
    inclusion, tissue = inclusion_of(scene), scene.tissue
    if tissue.layers:
        raise InvalidQuantity("tissue.layers", len(tissue.layers), "0", "ask for a homogeneous slab")
    place, harmonic = scene.placement, _Harmonic(mesh)
    flat = mesh.dim == 2
    from_top = (
        (x, y + inclusion.depth_mm) if flat else (x - place.offset_x_mm, y - place.offset_y_mm, z + inclusion.depth_mm)
    )
    down = (0.0,) * (mesh.dim - 1) + (-1.0,)
    fields = {
        "size_mm": harmonic(inclusion=CF(from_top)),
        "depth_mm": harmonic(inclusion=inclusion.depth_mm * CF(down)),
        "thickness_mm": harmonic(base=tissue.thickness_mm * CF(down)),
    }
    return fields if flat else fields | {OFFSET: harmonic(inclusion=CF((1.0, 0.0, 0.0)))}


def inclusion_of(scene: Scene) -> Inclusion:
    """Return the scene's inclusion; raise `InvalidQuantity` if there is none, or if it is as the tissue."""
    if scene.inclusion is None or not scene.has_inclusion:
        raise InvalidQuantity("inclusion", "none", "one whose size may vary", "give the scene an inclusion")
    return scene.inclusion


class _Harmonic:
    """Harmonic extension, into the tissue around the inclusion, of what is given on the inclusion or the base."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh, moved = mesh, mesh.deformation
        order = moved.space.globalorder if moved else mesh.GetCurveOrder()
        held = HELD if mesh.dim == 3 else HELD | {"dirichlety": ""}
        self.space = VectorH1(mesh, order=order, **held)
        inside = self.space.GetDofs(mesh.Materials(INCLUSION))
        free = self.space.FreeDofs() & ~inside & ~self.space.GetDofs(mesh.Materials(LAYERS))
        u, v = self.space.TnT()
        self.laplacian = BilinearForm(self.space, symmetric=True)
        self.laplacian += InnerProduct(Grad(u), Grad(v)) * dx(FLESH)
        self.laplacian.Assemble()
        self.inverse = self.laplacian.mat.Inverse(free, "sparsecholesky")

    def __call__(self, *, inclusion: Any = None, base: Any = None) -> Any:
        field = GridFunction(self.space)
        if inclusion is not None:
            field.Set(inclusion, definedon=self.mesh.Materials(INCLUSION))
        if base is not None:
            field.Set(base, definedon=self.mesh.Boundaries("base"))
        rest = field.vec.CreateVector()
        rest.data = self.laplacian.mat * field.vec
        field.vec.data -= self.inverse * rest
        return field


@contextmanager
def moved(mesh: Any, velocity: Any, share: float) -> Iterator[None]:
    """Move a mesh by a share of a velocity (on top of the deformation it has), and back at the end."""
    before = mesh.deformation
    further = GridFunction(velocity.space)
    further.vec.data = share * velocity.vec
    if before:
        further.vec.data += before.vec
    mesh.SetDeformation(further)
    try:
        yield
    finally:
        if before:
            mesh.SetDeformation(before)
        else:
            mesh.UnsetDeformation()
