"""With what press and waveguide the network of mode paper was trained: of another its features mean something else.

Deformation grows with the force and with the softness of the face, so a network that is fed those of another press
answers another size, and nothing in the image tells.
Source: Lee & Won 2013, section III: one press and one waveguide for all scenes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from device.measurement.quantities import InvalidQuantity, unit_of

FORCE_TOLERANCE = 0.06
"""Relative. Features grow with the force: a press a fifth harder leaves the intervals beside the truth."""
WAVEGUIDE_TOLERANCE = 0.03
"""Relative, half of that of the force: the pressure goes by the square of the face's radius."""
CENTRAL_RATIO = 0.9
"""Part of the face's radius that the features are taken from: the rim beyond is singular."""
PRESS, WAVEGUIDE = "press", "waveguide"
DEFAULT_SCENE: dict[str, dict[str, Any]] = {
    PRESS: {"force_n": 0.5},
    WAVEGUIDE: {
        "radius_mm": 11.0,
        "layer_thicknesses_mm": (2.0, 3.0, 5.0),
        "layer_moduli_kpa": (60.0, 40.0, 20.0),
        "poisson_ratio": 0.49,
        "face": "round",
        "dome_mm": 0.0,
    },
}
"""What a card that does not say it counts as: the models that were released before cards said it are of this scene."""


def other_press(card: Mapping[str, Any], force_n: float, waveguide: Mapping[str, Any]) -> Iterator[InvalidQuantity]:
    """Yield in what the press of a calibration is not that of a network's card.

    `force_n` in N; `waveguide`: what is known of it, by the names of `DEFAULT_SCENE` with their units.
    """
    own = trained_with(card, PRESS, "force_n")
    if not is_near(force_n, own, FORCE_TOLERANCE):
        action = f"calibrate with --force-n {told(own)}, or train on a sweep of {force_n:g} N"
        yield InvalidQuantity("calibration's force_n", f"{force_n:g} N", _bound(own, "N", FORCE_TOLERANCE), action)
    for name, value in waveguide.items():
        own, unit = trained_with(card, WAVEGUIDE, name), unit_of(name).replace("1", "")
        if not is_near(value, own, WAVEGUIDE_TOLERANCE):
            action = "name a model of this waveguide, or train one: `host_tools sweep --probe`, `host_tools train`"
            found, bound = f"{told(value)} {unit}".strip(), _bound(own, unit, WAVEGUIDE_TOLERANCE)
            yield InvalidQuantity(f"calibration's {name}", found, bound, action)


def trained_with(card: Mapping[str, Any], section: str, name: str) -> Any:
    """Return what a card says of the scenes of its network's training, the default where it says nothing.

    `section` and `name` are those of `DEFAULT_SCENE`.
    """
    stated = (card.get("scene_defaults") or {}).get(section, {})
    return stated.get(name, DEFAULT_SCENE[section][name])


def is_near(value: Any, own: Any, tolerance: float) -> bool:
    """Return whether a text is the same, or numbers, as many, are within a relative tolerance."""
    if value is None or own is None or isinstance(value, str) or isinstance(own, str):
        return bool(value == own)
    if isinstance(value, Sequence) and isinstance(own, Sequence):
        near = (is_near(one, other, tolerance) for one, other in zip(value, own, strict=False))
        return len(value) == len(own) and all(near)
    if isinstance(value, Sequence) or isinstance(own, Sequence):
        return False
    return bool(abs(value - own) <= tolerance * abs(own))


def _bound(own: Any, unit: str, tolerance: float) -> str:
    within = "" if own is None or isinstance(own, str) else f" within {tolerance:.0%}"
    return f"{told(own)} {unit}".strip() + f"{within}, with which the model was trained"


def told(value: Any) -> str:
    """Return a number, several or a text in words, without the digits that nobody gave."""
    if value is None or isinstance(value, str):
        return value or "none"
    if isinstance(value, Sequence):
        return ", ".join(told(one) for one in value)
    return f"{value:g}"
