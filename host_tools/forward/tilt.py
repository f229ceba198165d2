"""A probe that is tilted while it touches: its back turns about y by one degree, in small strain and closed contact.

Linear, so it adds to any press; where the sum of the pressures would pull, the face has lifted, and closed contact no
longer holds. The field is a cosine of the angle, so the ray along +x says it all.
"""

from __future__ import annotations

import math

from ngsolve import x

from host_tools.forward.contact import contact_pressure_kpa
from host_tools.forward.face_state import FloatArray, Rays
from host_tools.forward.linear_press import LinearPress
from host_tools.forward.materials import baseline
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.solid_mesh import SolidResolution, solid_mesh
from host_tools.forward.symmetry import SOLID
from host_tools.scene import Scene

ORDER = 3


def tilt_per_degree(
    scene: Scene, *, resolution: SolidResolution | None = None, order: int = ORDER
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return r_mm, w_mm and p_kpa [R] along +x for one degree that lowers the +x side, without an inclusion."""
    mesh = solid_mesh(scene, symmetry="half", order=order, resolution=resolution or SolidResolution())
    rays = Rays.over(scene.waveguide)
    sampler = FaceSampler(mesh, rays, "half")
    press, materials = LinearPress(mesh, SOLID, order), baseline(scene)
    sinking_mm = math.tan(math.radians(1.0)) * x
    u = press.displacement(materials, sinking_mm)
    probe, _ = press.contact.bodies(u.components)
    pressure = contact_pressure_kpa(mesh, SOLID, order, press.stress_of_probe(u, materials))
    return rays.r_mm[0], sampler(probe.u[-1] + sinking_mm)[0], sampler(pressure)[0]
