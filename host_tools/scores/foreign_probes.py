"""Probes that somebody else built: worlds drawn from a builder's tolerances, all of them at once, as scenario files.

Each quantity is normal about what the models believe, its tolerance one standard deviation, and cut at two. A world
depends on its seed and number alone, whatever the version of any library.
"""

from __future__ import annotations

from pathlib import Path

import tomli_w

from device.files.durable import write_durably
from device.files.toml_record import as_table
from device.measurement.quantities import InvalidQuantity
from device.simulation.physics.layer_table import LayerRatios
from device.simulation.physics.lens import TrueCamera
from device.simulation.physics.skin import ContactLaw, SkinTexture
from device.simulation.physics.world import OverLesion, PressTilts, Relaxation, TrueLight, World
from host_tools.scenes.probe_scene import ToleranceDraw


def foreign_world(seed: int, number: int) -> World:
    """Return one world of random tolerances.

    Of the probe: moduli of its layers 10 %, pixel scales 1 %, axis 0.3 mm, distortion 2 %, blur up to 0.05 mm, exponent
    0.1, largest contact down to 0.95, LEDs 10 %, span 1 %. Of the presses: tilts 0.3 degrees, LEDs between them 0.5 %;
    over the lesion wetting 3 %, albedo 2 %, tissue 5 %; relaxation of 2-5 % in 2-10 s, ramps of 0.1-0.2 N/s, texture of
    0.3 % over 2 mm, both to a third.
    """
    draw = ToleranceDraw(f"world {number} of seed {seed}")
    return World(
        contact=ContactLaw(exponent=draw.about(1, 0.1), largest_ratio=draw.within(0.95, 1.0)),
        camera=TrueCamera(
            scale_x_ratio=draw.about(1, 0.01),
            scale_y_ratio=draw.about(1, 0.01),
            axis_x_mm=draw.about(0, 0.3),
            axis_y_mm=draw.about(0, 0.3),
            rim_distortion_percent=draw.about(0, 2.0),
            further_blur_mm=draw.within(0.0, 0.05),
        ),
        lesion=OverLesion(draw.about(1, 0.03), draw.about(1, 0.02), draw.about(1, 0.05)),
        tilt=PressTilts(draw.about(0, 0.3), draw.about(0, 0.3), draw.about(0, 0.3), draw.about(0, 0.3)),
        relaxation=Relaxation(
            lost_ratio=draw.within(0.02, 0.05),
            time_constant_s=draw.within(2.0, 10.0),
            beside_n_per_s=draw.within(0.1, 0.2),
            lesion_n_per_s=draw.within(0.1, 0.2),
        ),
        light=TrueLight(draw.sides(0.1), draw.sides(0.005)),
        layers=LayerRatios(draw.about(1, 0.1), draw.about(1, 0.1), draw.about(1, 0.1)),
        texture=SkinTexture(draw.within(0.2, 0.4), draw.within(1.5, 2.5), draw.whole()),
        cell_span_ratio=draw.about(1, 0.01),
    )


def write_worlds(count: int, seed: int, out: Path) -> list[Path]:
    """Write world_01.toml and so on, at most 99; each holds where it came from. Return their paths.

    Raises `InvalidQuantity` where there are others, which would pass for worlds of this seed.
    """
    paths = [out / f"world_{number:02}.toml" for number in range(1, count + 1)]
    if others := sorted(path.name for path in out.glob("world_*.toml") if path not in paths):
        bound = f"in a folder without {', '.join(others)}"
        raise InvalidQuantity("count", count, bound, "name a new folder, or delete these first")
    for number, path in enumerate(paths, start=1):
        said = f"# A probe of random tolerances: number {number} of `host_tools worlds --seed {seed}`.\n"
        write_durably(path, (said + tomli_w.dumps({"world": as_table(foreign_world(seed, number))})).encode())
    return paths
