"""A sliding contact to what its derivatives need besides its state: the parts of each modulus, and the slip of the rim.

Made while the contact is undeformed. The rim is held at its slip in small strain (`sliding.py`): a number of the scene,
so it has derivatives, too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from ngsolve import BitArray

from host_tools.forward.derivatives.form_action import StateVector, along, applied, product
from host_tools.forward.finite_strain.sliding import SLIP, SlidingContact
from host_tools.forward.materials import Parts

LIGHT_MM = 1e-3
"""A press so light that differences over it are those of small strain, to 1e-6."""


class SlidingParts:
    """The parts of an undeformed contact; `rim_rates` are the derivatives of the rim's slip per mm of indentation."""

    def __init__(self, contact: SlidingContact, parts: Parts, velocities: Mapping[str, Any]) -> None:
        self.by_modulus = {
            name: SlidingContact(contact.mesh, part, contact.order, edge_force=True) for name, part in parts.items()
        }
        self._contact = contact
        slip = contact.push.components[SLIP].vec.FV().NumPy()
        self.rim = contact.space.Range(SLIP).start + int(np.flatnonzero(slip)[0])
        free = BitArray(contact.free)
        free.Set(self.rim)
        contact.energy.AssembleLinearization(contact.u.vec)
        self._inverse = contact.energy.mat.Inverse(free, "sparsecholesky")
        self._rate = contact.u.vec.CreateVector()
        self._rate.data = contact.push.vec - self._inverse * product(contact.energy.mat, contact.push.vec)
        self.rim_rates = {name: self._rim_rate(self._along(velocity)) for name, velocity in velocities.items()}
        self.rim_rates |= {name: self._rim_rate(self._forces_by(name)) for name in parts}

    def forces_by(self, modulus: str, state: StateVector, spread: StateVector) -> StateVector:
        """Return the forces that one modulus makes at a state."""
        part = self.by_modulus[modulus]
        part.spread.vec.data = spread
        return applied(part.energy, state)

    def _rim_rate(self, change: StateVector) -> float:
        motion = change.CreateVector()
        motion.data = -1.0 * (self._inverse * change)
        return float(motion[self.rim])

    def _forces_by(self, modulus: str) -> StateVector:
        spread = self._contact.memory[1]
        return self._at_rest(lambda state: self.forces_by(modulus, state, spread))

    def _along(self, velocity: Any) -> StateVector:
        def forces(state: StateVector) -> StateVector:
            return along(velocity, self._contact.mesh, lambda: applied(self._contact.energy, state))

        return self._at_rest(forces)

    def _at_rest(self, forces: Callable[[StateVector], StateVector]) -> StateVector:
        """Return the derivative of forces, at rest, along the rate of the press in small strain."""
        state = self._rate.CreateVector()
        state.data = LIGHT_MM * self._rate
        change = forces(state)
        state.data = -LIGHT_MM * self._rate
        change -= forces(state)
        change *= 0.5 / LIGHT_MM
        return change
