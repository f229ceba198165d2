"""A probe's file to a scene file of the simulator: `make run PROBE=probe.toml` runs the probe that a builder states.

The simulator's tables are of one design. What a scene's `[world]` holds against it may differ: moduli of the layers,
brightness of the LEDs, camera and load cell. All else must be the design's, or it needs tables of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from random import Random
from statistics import NormalDist
from typing import Any

from device.files.toml_record import InvalidRecord, as_table
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.led_sides import LedRatio
from device.simulation.physics.layer_table import LayerRatios
from device.simulation.physics.lens import Lens, TrueCamera
from device.simulation.physics.world import TrueLight, World
from device.simulation.scenario import Scenario
from host_tools.scenes.probe import Probe

CUT = 2.0
"""Standard deviations beyond which nothing is drawn: a builder throws such a part away."""
DIGITS = 4
OF_THE_WORLD = "layer_moduli_kpa"
"""What a world changes of what finite elements and light take."""
SENSOR = "width_px", "height_px", "bits"


class ToleranceDraw:
    """Numbers of one probe, drawn within tolerances and rounded as they are written; the same for the same name."""

    def __init__(self, name: str) -> None:
        self._random, self._normal = Random(name), NormalDist()

    def about(self, middle: float, tolerance: float) -> float:
        """Return a normal number about a middle, its tolerance one standard deviation, cut at `CUT`."""
        ends = self._normal.cdf(-CUT), self._normal.cdf(CUT)
        return round(middle + tolerance * self._normal.inv_cdf(self._random.uniform(*ends)), DIGITS)

    def within(self, low: float, high: float) -> float:
        """Return a number evenly between two."""
        return round(self._random.uniform(low, high), DIGITS)

    def whole(self) -> int:
        """Return a whole number from 0, as a seed."""
        return self._random.randrange(2**31)

    def sides(self, tolerance: float) -> LedRatio:
        """Return a ratio of each of the four sides, about 1."""
        return self.about(1, tolerance), self.about(1, tolerance), self.about(1, tolerance), self.about(1, tolerance)


def scene_of_probe(probe: Probe, design: Probe, number: int | None = None) -> Scenario:
    """Return the scene of a probe as its file says, or of the `number`-th one that is built within its tolerances.

    Raises `InvalidRecord` with everything in which the probe is not the `design` that the simulator's tables are of.
    """
    if problems := list(_of_another_design(probe, design)):
        raise InvalidRecord(problems)
    built = _world(probe, design, None if number is None else ToleranceDraw(f"{probe.serial} number {number}"))
    return Scenario(world=built, lens=Lens(probe.camera.blur_px, probe.camera.lens_distance_mm))


def _of_another_design(probe: Probe, design: Probe) -> Iterator[InvalidQuantity]:
    stated, usual = (asdict(one.waveguide) | asdict(one.light_block) for one in (probe, design))
    action = "take the design's, or sweep and train this probe with --probe (docs/own_probe.md)"
    for name, value in stated.items():
        if name != OF_THE_WORLD and value != usual[name]:
            yield InvalidQuantity(name, value, f"{usual[name]}, as the simulator's tables have it", action)
    for name in SENSOR:
        value, expected = getattr(probe.camera, name), getattr(design.camera, name)
        if value != expected:
            action = "take the simulated sensor's mode"
            yield InvalidQuantity(f"camera.{name}", value, f"{expected}, as the simulated sensor has it", action)


def _world(probe: Probe, design: Probe, draw: ToleranceDraw | None) -> World:
    """Return what the probe is against the design: as stated, or drawn."""
    camera, usual = probe.camera, design.camera

    def about(value: float, tolerance: float) -> float:
        return draw.about(value, tolerance) if draw else round(value, DIGITS)

    def over(name: str, stated: object, designed: object) -> float:
        usual_value = getattr(designed, name)
        return about(getattr(stated, name) / usual_value, getattr(stated, f"{name}_tolerance") / usual_value)

    pairs = zip(probe.layers, design.layers, strict=True)
    moduli = [over("youngs_modulus_kpa", one, other) for one, other in pairs]
    x, y, left, below = (about(1 + one, probe.leds.imbalance_ratio_tolerance) for one in probe.leds.imbalance_ratio)
    return World(
        camera=TrueCamera(
            scale_x_ratio=over("mm_per_px_x", camera, usual),
            scale_y_ratio=over("mm_per_px_y", camera, usual),
            axis_x_mm=about(camera.axis_x_mm, camera.axis_x_mm_tolerance),
            axis_y_mm=about(camera.axis_y_mm, camera.axis_y_mm_tolerance),
            rim_distortion_percent=about(100 * camera.distortion_ratio, 100 * camera.distortion_ratio_tolerance),
        ),
        light=TrueLight(side_ratio=(x, y, left, below)),
        layers=LayerRatios(*moduli),
        cell_span_ratio=over("counts_per_n", probe.cell, design.cell),
    )


def as_scene_table(scene: Scenario) -> dict[str, Any]:
    """Return what of such a scene differs from a scene without anything, as a scene file holds it."""
    table, plain = as_table(scene), as_table(Scenario())
    return {name: table[name] for name in ("lens", "world") if table[name] != plain[name]}
