"""A scene to the elastic constants of each material of its mesh, with the inclusion and without it.

Mesh materials are layer0.. (waveguide, from the face up), tissue0.. (from the surface down, the bulk last) and
inclusion0.. (the part of the inclusion inside each tissue layer). The baseline is the *same mesh* in which every part
of the inclusion is made of the layer around it: separate meshes would put 50 % error on the smallest inclusions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from host_tools.scenes.scene import Scene

LAYERS, TISSUE, INCLUSION = "layer.*", "tissue.*", "inclusion.*"
FLESH = f"{TISSUE}|{INCLUSION}"

LOCKING_POISSON_RATIO = 0.499
"""Above it a displacement-only solution of order 3 begins to lock (0.05 % there, 4 % at 0.49999)."""


@dataclass(frozen=True)
class Elasticity:
    """Young's modulus (kPa) and Poisson ratio of every material of a mesh."""

    modulus_kpa: dict[str, float]
    poisson_ratio: dict[str, float]

    @property
    def locks(self) -> bool:
        """Whether displacements alone would lock, so that a pressure must be solved for."""
        return max(self.poisson_ratio.values()) > LOCKING_POISSON_RATIO

    def fields(self, mesh: Any) -> tuple[Any, Any]:
        """Return modulus (kPa) and Poisson ratio as coefficient functions of a mesh."""
        return mesh.MaterialCF(self.modulus_kpa), mesh.MaterialCF(self.poisson_ratio)


Parts = Mapping[str, Elasticity]
"""By the name of a modulus, the materials that have it; all others are without stiffness."""


def baseline(scene: Scene) -> Elasticity:
    """Return the materials without the inclusion."""
    probe, stack = scene.waveguide, scene.tissue.stack
    modulus = {f"layer{i}": value for i, value in enumerate(probe.layer_moduli_kpa)}
    poisson = dict.fromkeys(modulus, probe.poisson_ratio)
    for i, layer in enumerate(stack):
        for part in (f"tissue{i}", f"inclusion{i}"):
            modulus[part], poisson[part] = layer.youngs_modulus_kpa, layer.poisson_ratio
    return Elasticity(modulus, poisson)


def with_inclusion(scene: Scene) -> Elasticity:
    """Return the materials of the scene; those of the baseline when there is nothing to solve for."""
    plain = baseline(scene)
    if scene.inclusion is None or not scene.has_inclusion:
        return plain
    parts = [f"inclusion{i}" for i in range(len(scene.tissue.stack))]
    modulus = plain.modulus_kpa | dict.fromkeys(parts, scene.inclusion.youngs_modulus_kpa)
    return Elasticity(modulus, plain.poisson_ratio | dict.fromkeys(parts, scene.placement.poisson_ratio))


def only(elasticity: Elasticity, *materials: str) -> Elasticity:
    """Return the same materials without stiffness but in those whose name begins so."""
    moduli = {name: E if name.startswith(materials) else 0.0 for name, E in elasticity.modulus_kpa.items()}
    return Elasticity(moduli, elasticity.poisson_ratio)
