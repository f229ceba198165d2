"""One scene drives light, image and force together: what the emulated chips ask when they are asked.

The camera's frame shows the face under the force that the load cell reports at that time, lit as the LED chip's
registers say.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.led_sides import LedRatio
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import Counts
from device.simulation.hand import VirtualHand
from device.simulation.physics.image_formation import ImageFormation, LinearImage, ScatteredImage
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.neighbour import NeighbouredFace, NeighbourFace
from device.simulation.physics.off_axis_table import OffAxisTable, load_off_axis_table
from device.simulation.physics.pressed_face import PressedFace, ProbePlacement
from device.simulation.physics.surface_table import PressRamps, SurfaceTable, load_surface_table
from device.simulation.scenario import Scenario

ACTION = "run `host_tools table` to make both again"


@dataclass(frozen=True)
class ProbeTables:
    """What stands in for finite elements and ray tracing on the device."""

    centred: SurfaceTable
    off_axis: OffAxisTable
    light: LookupOptics

    @classmethod
    def load(cls, folder: Path) -> ProbeTables:
        """Read the three tables of a folder.

        Raises `InvalidQuantity` for one that is missing or not what it says, or when they are not of one probe.
        """
        tables = cls(load_surface_table(folder), load_off_axis_table(folder), LookupOptics.load(folder))
        scenes = [
            json.loads((folder / f"{name}.json").read_text(encoding="utf-8")).get("scene_defaults")
            for name in ("surface_table", "off_axis_table")
        ]
        if scenes[0] != scenes[1]:
            raise InvalidQuantity("off axis table's scene", scenes[1], f"{scenes[0]} as the surface table's", ACTION)
        return tables


class VirtualProbe:
    """The physics below the chips: hand to force, force and inclusion to face, face and LEDs to counts."""

    def __init__(
        self,
        scenario: Scenario,
        tables: ProbeTables,
        shape: tuple[int, int],
        scale: PixelScale,
        *,
        ramps: PressRamps | None = None,
    ) -> None:
        """Prepare for frames of [height, width], pressed as `ramps` say or else the table.

        Raises `InvalidQuantity` when the table does not hold the inclusion.
        """
        self.scenario, self.hand = scenario, VirtualHand(scenario.hand)
        self._image = _image_formation(scenario, tables, shape, scale)
        self._face = self._faces(tables, ramps)

    def _faces(self, tables: ProbeTables, ramps: PressRamps | None) -> NeighbourFace:
        scenario, x_mm, y_mm = self.scenario, self._image.x_mm, self._image.y_mm

        def face(inclusion: Inclusion, solved: PressRamps | None = None) -> NeighbourFace:
            solved = solved or tables.centred.ramps(inclusion, scenario.slab)
            return PressedFace(solved, tables.off_axis, inclusion, x_mm, y_mm, scenario.slab)

        first, second = face(scenario.inclusion, ramps), scenario.neighbour
        return NeighbouredFace(first, face(second.inclusion), second) if second else first

    def cell_counts(self, t_s: float) -> float:
        """Return the noise-free load-cell counts at a time."""
        cell = self.scenario.cell
        return cell.zero_counts + cell.counts_per_n * self.hand.force_n(t_s)

    def frame_counts(
        self,
        *,
        force_n: float,
        place: ProbePlacement,
        led_ratio: LedRatio,
        exposure_us: float,
        gain: float,
        frame_number: int,
        wet_ratio: float = 0.0,
        ambient_ratio: float = 0.0,
    ) -> Counts:
        """Return the counts of one exposure; a wet face shows full contact, foreign light falls on every pixel."""
        w_mm, p_kpa = self._face.at(force_n, place)
        intensity = self._image.intensity(w_mm, p_kpa, led_ratio, wet_ratio=wet_ratio)
        if ambient_ratio:
            intensity = intensity + intensity.dtype.type(ambient_ratio)
        seed = self.scenario.seed, frame_number
        return self.scenario.sensor.expose(intensity, exposure_us=exposure_us, gain=gain, seed=seed)


def _image_formation(
    scenario: Scenario, tables: ProbeTables, shape: tuple[int, int], scale: PixelScale
) -> ImageFormation:
    if scenario.light == "linear":
        return LinearImage(scenario.optics, shape, scale)
    return ScatteredImage(tables.light, scenario.skin, scenario.lens, shape, scale)
