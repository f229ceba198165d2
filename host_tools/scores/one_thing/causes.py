"""Worlds that differ from the believed one in one thing, by how much, and whose it is.

Sizes are those that were found to break the models before they knew of probes of somebody's own, and what a builder
may reach. A direction that nobody chose - of a tilt, of the side whose LED dims, the patch of skin - is drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from device.measurement.ramp_modes.misfit_blocks import RowBlock
from device.simulation.physics.layer_table import LayerRatios
from device.simulation.physics.lens import TrueCamera
from device.simulation.physics.skin import ContactLaw, SkinTexture
from device.simulation.physics.world import AS_BELIEVED, OverLesion, PressTilts, Relaxation, TrueLight, World

CauseOwner = Literal["nobody", "probe", "camera", "press", "patient"]
"""Whose a thing is: phantoms tell of the probe, a grid target of its camera, nothing of a press or a patient."""
TwoWorlds = tuple[World, World]
"""Of the first press of a scan and of its second, which have one reference."""
BESIDE_N_PER_S, LESION_N_PER_S, FOUR_TIMES_SLOWER_N_PER_S = 0.2, 0.1, 0.05
"""Ramps while tissue relaxes: that on the lesion half as fast, as a careful hand has it, or slower still."""


@dataclass(frozen=True)
class Cause:
    """One thing that differs: a quantity, by how much in words, whose it is, and the worlds of both presses."""

    quantity: str
    size: str
    owner: CauseOwner
    worlds: Callable[[np.random.Generator], TwoWorlds]

    @property
    def name(self) -> str:
        """Quantity and size."""
        return f"{self.quantity} {self.size}".strip()

    @property
    def probe(self) -> World:
        """What the probe is, where the thing is the probe's."""
        return self.worlds(np.random.default_rng(0))[0]


def causes() -> list[Cause]:
    """Return all things of the chapter, first of them that nothing differs; of one quantity the least first."""
    return [
        NOTHING,
        *(_alike("exponent of the contact law", f"{one:g}", "probe", _exponent(one)) for one in (0.97, 0.9)),
        _alike("form of the contact law", "Langmuir", "probe", World(contact=ContactLaw(form="langmuir"))),
        *(_alike("moduli of the layers", f"+{one} %", "probe", _layers(1 + one / 100)) for one in (10, 25)),
        _alike("load cell's span", "+2 %", "probe", World(cell_span_ratio=1.02)),
        _alike("load cell's span", "-2 %", "probe", World(cell_span_ratio=0.98)),
        _alike("face drawn where it moves", "fully", "probe", World(face_motion_ratio=1.0)),
        _alike("camera, undone by a grid", "0.1 %, 0.03 mm, 0.2 % left", "probe", World(camera=LEFT_BY_A_GRID)),
        *(_alike("pixel scale, not undone", f"+{one:g} %", "camera", _scale(1 + one / 100)) for one in (0.3, 1)),
        _alike("optical axis, not undone", "0.5 mm", "camera", World(camera=TrueCamera(axis_x_mm=0.5))),
        _alike("distortion, not undone", "-3 %", "camera", World(camera=TrueCamera(rim_distortion_percent=-3.0))),
        *(Cause("tilt on the lesion", f"{one:g} degrees", "press", _tilted(one)) for one in (0.1, 0.5)),
        Cause("one LED between the presses", "3 % dimmer", "press", _dimmed(0.97)),
        *(Cause("texture of skin, 2 mm", f"{one:g} %", "patient", _textured(one)) for one in (0.3, 0.5, 1)),
        *(_wetter(one) for one in (3, 10)),
        _alike("tissue over the lesion", "-5 %", "patient", World(lesion=OverLesion(tissue_modulus_ratio=0.95))),
        _alike("skin of 1.5 mm", "twice as stiff", "patient", _stiff_skin(2)),
        relaxing(5),
    ]  # fmt: skip


class CauseToName(NamedTuple):
    """A thing that a refusal ought to name by a block of the row; None where several depart."""

    cause: Cause
    block: RowBlock | None


def causes_to_name() -> list[CauseToName]:
    """Return things of sizes at which presses are refused, and the block that each is of."""
    response: list[Cause] = [
        _alike("exponent of the contact law", "0.9", "probe", _exponent(0.9)),
        _alike("form of the contact law", "Langmuir", "probe", World(contact=ContactLaw(form="langmuir"))),
        _alike("moduli of the layers", "+25 %", "probe", _layers(1.25)),
        _alike("skin of 1.5 mm", "4 times as stiff", "patient", _stiff_skin(4)),
        _alike("pixel scale, not undone", "+2 %", "camera", _scale(1.02)),
        _alike("optical axis, not undone", "0.5 mm", "camera", World(camera=TrueCamera(axis_x_mm=0.5))),
    ]
    first = [
        *(Cause("tilt on the lesion", f"{one:g} degrees", "press", _tilted(one)) for one in (0.5, 2)),
        *(Cause("one LED between the presses", f"{one} % dimmer", "press", _dimmed(1 - one / 100)) for one in (3, 10)),
    ]
    return [
        *(CauseToName(one, "reference_response") for one in response),
        *(CauseToName(_wetter(one), "contrast") for one in (10, 50)),
        *(CauseToName(one, "first_harmonic") for one in first),
        CauseToName(Cause("two opposite LEDs", "10 % dimmer", "press", _dimmed(0.9, are_two=True)), "second_harmonic"),
        CauseToName(Cause("texture of skin, 2 mm", "1 %", "patient", _textured(1)), None),
    ]


def _wetter(percent: float) -> Cause:
    return _alike("wetting over the lesion", f"+{percent:g} %", "patient", _wetting(1 + percent / 100))


def relaxing(percent: float, lesion_n_per_s: float = LESION_N_PER_S) -> Cause:
    """Return tissue that loses so much of its modulus in the end, in 5 s, while the hand is slower on the lesion."""
    slower = Relaxation(percent / 100, 5.0, BESIDE_N_PER_S, lesion_n_per_s)
    size = f"{percent:g} %, {BESIDE_N_PER_S / lesion_n_per_s:g} times slower on the lesion"
    return _alike("relaxation", size, "patient", World(relaxation=slower))


def stiff_below(ratio: float) -> Cause:
    """Return tissue that is so many times as stiff from 20 mm down."""
    return _alike("tissue below 20 mm", f"{ratio:g} times as stiff", "patient", _deep(ratio))


def _alike(quantity: str, size: str, owner: CauseOwner, world: World) -> Cause:
    return Cause(quantity, size, owner, lambda rng: (world, world))


NOTHING = _alike("nothing", "", "nobody", AS_BELIEVED)
LEFT_BY_A_GRID = TrueCamera(1.001, 1.001, axis_x_mm=0.03, rim_distortion_percent=0.2)
"""What must not be left of the camera, and more than `host_tools probe camera-trial` finds left."""


def _exponent(exponent: float) -> World:
    return World(contact=ContactLaw(exponent=exponent))


def _layers(ratio: float) -> World:
    return World(layers=LayerRatios(face_modulus_ratio=ratio, middle_modulus_ratio=ratio, backing_modulus_ratio=ratio))


def _deep(ratio: float) -> World:
    return World(layers=LayerRatios(deep_modulus_ratio=ratio))


def _stiff_skin(ratio: float) -> World:
    return World(layers=LayerRatios(skin_modulus_ratio=float(ratio)))


def _scale(ratio: float) -> World:
    return World(camera=TrueCamera(scale_x_ratio=ratio, scale_y_ratio=ratio))


def _wetting(ratio: float) -> World:
    """Return skin over the lesion that wets so many times as easily: at a pressure so much lower."""
    return World(lesion=OverLesion(contact_pressure_ratio=1 / ratio))


def _tilted(degrees: float) -> Callable[[np.random.Generator], TwoWorlds]:
    """Return presses of a scan that lean so far, each in a direction of its own."""

    def worlds(rng: np.random.Generator) -> TwoWorlds:
        first, second = (
            World(tilt=PressTilts(float(degrees * np.cos(angle)), float(degrees * np.sin(angle))))
            for angle in rng.uniform(0, 2 * np.pi, 2)
        )
        return first, second

    return worlds


def _dimmed(ratio: float, *, are_two: bool = False) -> Callable[[np.random.Generator], TwoWorlds]:
    """Return presses of which one side, any, or both of a pair have so much of their light beside the lesion."""

    def worlds(rng: np.random.Generator) -> TwoWorlds:
        dim = int(rng.integers(4))
        dimmed = {dim, (dim + 2) % 4} if are_two else {dim}
        x, y, minus_x, minus_y = (ratio if side in dimmed else 1.0 for side in range(4))
        world = World(light=TrueLight(lesion_side_ratio=(x, y, minus_x, minus_y)))
        return world, world

    return worlds


def _textured(level_percent: float) -> Callable[[np.random.Generator], TwoWorlds]:
    """Return presses on one patch of skin, any, of such a texture."""

    def worlds(rng: np.random.Generator) -> TwoWorlds:
        world = World(texture=SkinTexture(level_percent, 2.0, int(rng.integers(2**31))))
        return world, world

    return worlds
