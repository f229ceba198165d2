"""A pressed face in a world: each press leans as it does, on tissue that differs by place and gives way in time.

Faces are made for three moduli of the tissue and are quadratic between them in its logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from device.measurement.arrays import Array
from device.measurement.recording.tactile_image import Image
from device.simulation.physics.chebyshev import interpolation_weights
from device.simulation.physics.layer_table import DepthRatios
from device.simulation.physics.neighbour import NeighbourFace
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.physics.slab import Slab
from device.simulation.physics.world import World

FaceIn = Callable[[Slab, DepthRatios], NeighbourFace]
"""The face in a slab whose layers have these moduli over its own."""


class WorldFace:
    """What `face_in` gives for a slab, pressed in a world; nothing else than that in the one that is believed."""

    def __init__(self, world: World, slab: Slab, face_in: FaceIn) -> None:
        """Raises `InvalidQuantity` for what `face_in` refuses."""
        lowest, highest = world.tissue_ratios()
        ratios = [lowest, math.sqrt(lowest * highest), highest] if lowest < highest else [lowest]
        self._world, self._ln_ratios = world, np.log(ratios)
        slabs, tissue = [slab.changed(ratio) for ratio in ratios], world.tissue
        self._lesion = [face_in(one, tissue.lesion_ratio) for one in slabs]
        self._beside = self._lesion if tissue.is_alike else [face_in(one, tissue.beside_ratio) for one in slabs]

    def at(self, force_n: float, place: ProbePlacement, pressed_s: float | None = None) -> tuple[Image, Image]:
        """Return w_mm and p_kpa [ny, nx]; pressed for `pressed_s`, as long as a usual ramp takes unless it is told."""
        world, share = self._world, self._world.lesion_share(place)
        leaning = world.tilt.leaning(place, share)
        if len(self._lesion) == 1 and world.tissue.is_alike:
            return self._lesion[0].at(force_n, leaning)
        since_s = world.relaxation.pressed_s(force_n, share) if pressed_s is None else pressed_s
        weights = self._of_moduli(world.tissue_ratio(place, since_s))
        of_places = [(share, self._lesion), (1 - share, self._beside)]
        if world.tissue.is_alike:
            of_places = [(1.0, self._lesion)]
        parts = [
            (np.float32(part * weight), face.at(force_n, leaning))
            for part, faces in of_places
            for weight, face in zip(weights, faces, strict=True)
            if part * weight
        ]
        w_mm, p_kpa = (np.asarray(sum(weight * fields[i] for weight, fields in parts), np.float32) for i in (0, 1))
        return w_mm, np.maximum(p_kpa, 0)

    def _of_moduli(self, tissue_ratio: float) -> Array:
        """Return the weights of the faces in tissue of so many times the scene's modulus."""
        if len(self._ln_ratios) == 1:
            return np.ones(1)
        return interpolation_weights(self._ln_ratios, math.log(tissue_ratio))
