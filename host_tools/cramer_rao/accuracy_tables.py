"""Bounds of one inclusion over its modulus to how often a press of it determines the modulus.

A Cramer-Rao bound is a straight line about one modulus and knows no ends. Here the modulus runs along a line on which
every step of one is as visible as any other, by its bound there, and its posterior ends where the box ends; size and
depth are known as the Gaussian box says. Source: the line is Rao's distance, Bull. Calcutta Math. Soc. 37 (1945).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from device.measurement.arrays import Array
from device.measurement.confidence_belt import IDENTIFIABLE_RATIO
from device.measurement.parameters import EVEN_STD, RANGES
from device.measurement.quantities import UNKNOWNS
from host_tools.cramer_rao.bounds import Limits

MODULUS = UNKNOWNS.index("youngs_modulus_kpa")
BOX = RANGES["youngs_modulus_kpa"]
LN_MODULUS: Array = np.linspace(np.log(BOX.low), np.log(BOX.high), 401)
"""Where the posterior is computed; even in it is how the box spreads inclusions."""
NARROW = IDENTIFIABLE_RATIO * EVEN_STD * float(LN_MODULUS[-1] - LN_MODULUS[0]) / 2
"""The spread of ln E under which the probe calls the modulus identifiable."""
ERRORS: Array = np.linspace(-4.0, 4.0, 321)
"""Errors of a press in standard deviations, and how often each occurs."""
OFTEN: Array = np.exp(-(ERRORS**2) / 2) / np.exp(-(ERRORS**2) / 2).sum()
LEAST_INFORMATION = 1e-6
"""Less of ln E is nothing: it is known to a factor of e to the 1000."""


def std_of_modulus(found: Limits) -> float:
    """Return the bound of ln E when only size and depth are held by the Gaussian box.

    A prior of the modulus adds to its own information, so taking it away again is a subtraction.
    """
    information = found.std_with_box[MODULUS] ** -2 - found.box_std[MODULUS] ** -2
    return float(max(information, LEAST_INFORMATION) ** -0.5)


def visible_line(moduli_kpa: Sequence[float], std: Array) -> Array:
    """Return places [n] of `LN_MODULUS` on the line, from bounds [M] of ln E at rising moduli [M].

    Between them the logarithm of the bound is straight in ln E, and beyond them it goes on so.
    """
    at, log_std = np.log(moduli_kpa), np.log(std)
    slope = np.diff(log_std) / np.diff(at)
    piece = np.clip(np.searchsorted(at, LN_MODULUS) - 1, 0, len(slope) - 1)
    density = np.exp(-(log_std[piece] + slope[piece] * (LN_MODULUS - at[piece])))
    steps = (density[1:] + density[:-1]) / 2 * np.diff(LN_MODULUS)
    return np.concatenate([[0.0], np.cumsum(steps)])


def posterior_spread(line: Array, seen: Array) -> Array:
    """Return the standard deviations [m] of ln E when presses show places [m] on the line [n], with an error of one."""
    weight = np.exp(-((line[:, None] - seen) ** 2) / 2 + np.min((line[:, None] - seen) ** 2, axis=0) / 2)
    weight /= weight.sum(axis=0)
    mean = LN_MODULUS @ weight
    return np.asarray(np.sqrt(np.sum((LN_MODULUS[:, None] - mean) ** 2 * weight, axis=0)))


def determined_share(line: Array, modulus_kpa: float) -> float:
    """Return in which share of presses of an inclusion of this modulus its posterior is narrow enough for the probe."""
    place = np.interp(np.log(modulus_kpa), LN_MODULUS, line)
    return float(OFTEN @ (posterior_spread(line, place + ERRORS) < NARROW))
