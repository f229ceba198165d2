"""What one mesh errs in small strain, and the step to its next order, to what is stated of it in finite strain.

In finite strain the rim of the contact must stay blunt, for elements smaller than its slip fold. What blunt elements
cost no order on that mesh sees, so a step between two orders alone states too little. Small strain sees it: on the same
mesh and at the same order it errs in the same sense, and there the true answer is cheap, on a mesh with layers around
the rims. What the load adds, the step sees. `host_tools verify --effectivity` measures how often the true error lies
within.
"""

from __future__ import annotations

from collections.abc import Mapping

from host_tools.forward.error_estimates.stated_error import CANCELLING, INTEGRAL, ROUNDING

FORETOLD_FACTOR = 3.0
"""Stated error over that of the same mesh in small strain."""
FORCED_FACTOR = 1.25
"""Under a force O2 states so much more: it is what the face's lifted middle and lowered border leave of each other."""
LOADS = ("force_n", "indentation_mm")
LEAST_SHARE = 0.5
"""A feature whose own error crosses zero by chance is given this much of the largest of all."""


def foretold_error(
    same_mesh: Mapping[str, float], converged: Mapping[str, float], by_step: Mapping[str, float]
) -> dict[str, float]:
    """Return the relative error to state by feature, from the numbers of two presses in small strain.

    `by_step` is what the step to the next order states. Of force and indentation the prescribed one has none, nor has
    what is 0; an area of the whole window, which small strain foretells nothing of, may err where it is smaller.
    """
    foretold = {name: abs(same_mesh[name] - true) / abs(true) if true else 0.0 for name, true in converged.items()}
    own = {name: max(FORETOLD_FACTOR * error, by_step[name]) for name, error in foretold.items()}
    largest = max(error for name, error in own.items() if name not in CANCELLING)
    stated = {name: max(error, LEAST_SHARE * largest) for name, error in own.items()}
    prescribed = {name for name in LOADS if foretold[name] <= ROUNDING}
    stated |= {name: 0.0 for name, true in converged.items() if name in prescribed or not true}
    return stated if stated["force_n"] else stated | {INTEGRAL: FORCED_FACTOR * stated[INTEGRAL]}
