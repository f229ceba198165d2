"""What a sweep sweeps: how many scenes of the paper's box, from which seed, pressed with which forces, in which strain.

Every scene is pressed with the same *forces*, since that is what the probe can hold: at equal force the inclusion field
is two thirds of what it is at equal indentation. Source of the box: Lee & Won 2013, section III.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require
from host_tools.scenes.scene import (
    PAPER_BOX_HIGH,
    PAPER_BOX_LOW,
    WITHIN_S,
    AskedStrain,
    Press,
    Scene,
    Waveguide,
)

DEFAULT_FORCES_N = (0.5,)
SCHEMA = "tsis.sweep/1"
SCHEMA_OF_LOADS = "tsis.sweep/2"
"""Rows of /1 hold one load in small strain, on one level; rows of /2 hold a `load` axis, and the origin names loads and
strain."""
STRAINS = get_args(AskedStrain)


def asked_strain(strain: AskedStrain | None, tolerance: float | None) -> AskedStrain:
    """Return the strain measure that was asked for: unless told, what a tolerance asks for, small strain without."""
    return strain or ("small" if tolerance is None else "auto")


@dataclass(frozen=True)
class SweepPlan:
    """What is swept: `scenes` draws from the box with a seed, each pressed with every one of `forces_n`, rising.

    By one probe's `waveguide`, the simulated one's unless given. With a `tolerance` (relative) every scene climbs until
    what it states of every feature is within it, for `within_s` at most, or has failed; `strain` may then be "auto".
    """

    scenes: int
    seed: int
    forces_n: tuple[float, ...] = DEFAULT_FORCES_N
    strain: AskedStrain = "small"
    waveguide: Waveguide = field(default_factory=Waveguide)
    tolerance: float | None = None
    within_s: float = WITHIN_S

    def __post_init__(self) -> None:
        require("scenes", self.scenes, Bound(1, 1_000_000, "scenes"), "ask for at least one scene")
        require("seed", self.seed, Bound(0, 2**63, ""), "give a whole number from 0")
        if self.strain not in STRAINS:
            raise InvalidQuantity("strain", repr(self.strain), f"one of {', '.join(STRAINS)}", "choose one of them")
        if self.strain == "auto" and self.tolerance is None:
            raise InvalidQuantity("strain", "auto", "small or finite without a tolerance", "give a tolerance, too")
        if not self.forces_n or any(b <= a for a, b in zip(self.forces_n, self.forces_n[1:], strict=False)):
            raise InvalidQuantity("forces_n", self.forces_n, "at least one force, rising", "order the loads")
        if self.tolerance is not None:
            require("tolerance", self.tolerance, Bound(0.0, 1.0, "", low_included=False), "give a ratio, 0.01 for 1 %")
        require("within_s", self.within_s, Bound(0.0, 1e6, "s", low_included=False), "allow some time")
        for force_n in self.forces_n:
            Press(force_n=force_n)

    @property
    def has_load_axis(self) -> bool:
        """Whether rows hold a value for each load; one load in small strain on one level is a row of plain values."""
        return len(self.forces_n) > 1 or self.strain != "small" or self.tolerance is not None

    def truths(self) -> NDArray[np.float64]:
        """Return the drawn (size_mm, depth_mm, youngs_modulus_kpa) [scenes, 3]; prefix-stable."""
        return np.random.default_rng(self.seed).uniform(PAPER_BOX_LOW, PAPER_BOX_HIGH, (self.scenes, 3))

    @property
    def middle_scene(self) -> Scene:
        """The scene of the middle of the box."""
        return self.scene((np.array(PAPER_BOX_LOW) + PAPER_BOX_HIGH) / 2)

    def scene(self, truth: NDArray[np.float64]) -> Scene:
        """Return the scene of one draw, under the largest load."""
        return Scene(Inclusion(*map(float, truth)), Press(force_n=self.forces_n[-1]), self.waveguide)

    def as_record(self) -> dict[str, Any]:
        """Return what the journal and the data set say of their origin."""
        surroundings = Scene(None, Press(force_n=self.forces_n[-1]), self.waveguide).surroundings()
        loads: dict[str, Any] = {"force_n": self.forces_n[-1]}
        if self.has_load_axis:
            loads = {"forces_n": list(self.forces_n), "strain": self.strain}
            surroundings |= {"press": {"forces_n": list(self.forces_n)}}
        return {
            "schema": SCHEMA_OF_LOADS if self.has_load_axis else SCHEMA,
            "scenes": self.scenes,
            "seed": self.seed,
            **loads,
            "box": {"low": PAPER_BOX_LOW, "high": PAPER_BOX_HIGH},
            "scene_defaults": surroundings,
            **({} if self.tolerance is None else {"tolerance": self.tolerance, "within_s": self.within_s}),
        }
