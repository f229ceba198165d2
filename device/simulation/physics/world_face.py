"""A pressed face in a world: each press leans as it does, on tissue that differs by place and gives way in time.

Faces are made for three moduli of the tissue and are quadratic between them in its logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from device.measurement.recording.tactile_image import Image
from device.simulation.physics.chebyshev import interpolation_weights
from device.simulation.physics.neighbour import NeighbourFace
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.physics.slab import Slab
from device.simulation.physics.world import World


class WorldFace:
    """What `face_in` gives for a slab, pressed in a world; nothing else than that in the one that is believed."""

    def __init__(self, world: World, slab: Slab, face_in: Callable[[Slab], NeighbourFace]) -> None:
        """Raises `InvalidQuantity` for what `face_in` refuses."""
        lowest, highest = world.tissue_ratios()
        ratios = [lowest, math.sqrt(lowest * highest), highest] if lowest < highest else [lowest]
        self._world, self._ln_ratios = world, np.log(ratios)
        self._faces = [face_in(slab.changed(ratio)) for ratio in ratios]

    def at(self, force_n: float, place: ProbePlacement, pressed_s: float | None = None) -> tuple[Image, Image]:
        """Return w_mm and p_kpa [ny, nx]; pressed for `pressed_s`, as long as a usual ramp takes unless it is told."""
        world, share = self._world, self._world.lesion_share(place)
        leaning = world.tilt.leaning(place, share)
        if len(self._faces) == 1:
            return self._faces[0].at(force_n, leaning)
        since_s = world.relaxation.pressed_s(force_n, share) if pressed_s is None else pressed_s
        weights = interpolation_weights(self._ln_ratios, math.log(world.tissue_ratio(place, since_s)))
        parts = [
            (np.float32(weight), face.at(force_n, leaning))
            for weight, face in zip(weights, self._faces, strict=True)
            if weight
        ]
        w_mm, p_kpa = (np.asarray(sum(weight * fields[i] for weight, fields in parts), np.float32) for i in (0, 1))
        return w_mm, np.maximum(p_kpa, 0)
