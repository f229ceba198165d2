"""One scene drives light, image and force together: what the emulated chips ask when they are asked.

The camera's frame shows the face under the force that the load cell reports at that time, lit as the LED chip's
registers say.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.led_sides import LedRatio
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import Counts
from device.simulation.grid_target import CappedFace
from device.simulation.hand import VirtualHand
from device.simulation.physics.face_motion import FaceMotion, load_face_motion
from device.simulation.physics.image_formation import ImageFormation, LinearImage, ScatteredImage
from device.simulation.physics.layer_table import (
    AS_TABULATED,
    EVEN,
    DepthRatios,
    LayerTable,
    TissueLayerTable,
    load_layer_table,
    load_tissue_layers,
)
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.neighbour import NeighbouredFace, NeighbourFace
from device.simulation.physics.off_axis_table import OffAxisTable, load_off_axis_table
from device.simulation.physics.pressed_face import PressedFace, ProbePlacement
from device.simulation.physics.skin import SkinTexture
from device.simulation.physics.slab import Slab
from device.simulation.physics.surface_table import PressRamps, SurfaceTable, load_surface_table
from device.simulation.physics.world import OverLesion, World
from device.simulation.physics.world_face import WorldFace
from device.simulation.scenario import Scenario

ACTION = "run `host_tools table` to make both again"
ONE_PROBE = "run `host_tools table` and `host_tools optics build` with the file of one probe"
SIMULATED_PROBE_SHA256 = "efd4d351ec5f09677ff081351f4e7fa64a0469ac25e92ad99008b3476f0f6892"
"""Of `models/simulated_probe/probe.toml`; tables that do not say of which probe they are, are of this one."""
FACE_TABLES = ("surface_table", "off_axis_table")


@dataclass(frozen=True)
class ProbeTables:
    """What stands in for finite elements and ray tracing on the device."""

    centred: SurfaceTable
    off_axis: OffAxisTable
    light: LookupOptics
    layers: LayerTable | None = None
    motion: FaceMotion | None = None
    tissue: TissueLayerTable | None = None

    @classmethod
    def load(cls, folder: Path) -> ProbeTables:
        """Read the tables of a folder; those of layers and of the face's motion may be absent.

        Raises `InvalidQuantity` for one that is missing or not what it says, or when they are not of one probe.
        """
        layers = load_layer_table(folder) if (folder / "layer_table.npz").exists() else None
        motion = load_face_motion(folder) if (folder / "face_motion.npz").exists() else None
        tissue = load_tissue_layers(folder) if (folder / "tissue_layers.npz").exists() else None
        needed = load_surface_table(folder), load_off_axis_table(folder), LookupOptics.load(folder)
        tables = cls(*needed, layers, motion, tissue)
        further = {"layer_table": layers, "face_motion": motion, "tissue_layers": tissue}
        faces = [*FACE_TABLES, *(name for name, one in further.items() if one)]
        usual = table_record(folder, faces[0]).get("scene_defaults")
        for name in faces[1:]:
            if (scene := table_record(folder, name).get("scene_defaults")) != usual:
                raise InvalidQuantity(
                    f"{name.replace('_', ' ')}'s scene", scene, f"{usual} as the surface table's", ACTION
                )
        first = probe_of_table(folder, faces[0])
        for name in (*faces[1:], "light_table"):
            if (found := probe_of_table(folder, name)) != first:
                bound = f"{first[:12]} as the surface table's"
                raise InvalidQuantity(f"{name.replace('_', ' ')}'s probe", found[:12], bound, ONE_PROBE)
        return tables

    def ramps(
        self,
        inclusion: Inclusion,
        slab: Slab,
        world: World,
        depth_ratios: DepthRatios = EVEN,
        *,
        solved: PressRamps | None = None,
    ) -> PressRamps:
        """Return the ramps of one inclusion in a slab and a world, from those `solved` or else the table's.

        `depth_ratios`: moduli over the slab's of its layers from the surface to the base.

        Raises `InvalidQuantity` for an inclusion outside the tables, and for what a world needs a table for that is not
        there or does not hold its tissue.
        """
        ramps = solved or self.centred.ramps(inclusion, slab)
        if world.layers != AS_TABULATED:
            if self.layers is None:
                raise _no_table("world.layers", "layers")
            ramps = self.layers.changed(ramps, world.layers, inclusion, slab)
        if depth_ratios != EVEN:
            if self.tissue is None:
                raise _no_table("world.tissue", "tissue")
            ramps = self.tissue.changed(ramps, depth_ratios, inclusion, slab)
        if world.face_motion_ratio:
            if self.motion is None:
                raise _no_table("world.face_motion_ratio", "motion")
            ramps = self.motion.moved(ramps, world.face_motion_ratio, inclusion, slab)
        return ramps


def _no_table(quantity: str, part: str) -> InvalidQuantity:
    action = f"run `host_tools table --part {part}`"
    return InvalidQuantity(quantity, "given", "absent where there is no table for it", action)


def table_record(folder: Path, name: str) -> dict[str, Any]:
    """Return what a table that was loaded says of itself."""
    return dict(json.loads((folder / f"{name}.json").read_text(encoding="utf-8")))


def probe_of_table(folder: Path, name: str) -> str:
    """Return the hash of the probe that a table that was loaded is of: what the probe's file says it is made of."""
    stated = table_record(folder, name).get("probe")
    return str(stated.get("sha256")) if isinstance(stated, dict) else SIMULATED_PROBE_SHA256


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

        `scale` is the certificate's. Raises `InvalidQuantity` when the table does not hold the inclusion, or where
        `ramps` are of one tissue and the scenario's world of several.
        """
        self.scenario, self.hand = scenario, VirtualHand(scenario.hand)
        self._image = _image_formation(scenario, tables, shape, scale)
        self._face = self._capped(tables) if scenario.grid else self._on_tissue(tables, ramps)

    def _capped(self, tables: ProbeTables) -> CappedFace:
        return CappedFace(float(tables.centred.r_mm[-1]), self._image.x_mm, self._image.y_mm)

    def _on_tissue(self, tables: ProbeTables, ramps: PressRamps | None) -> WorldFace:
        world, slab = self.scenario.world, self.scenario.slab
        return WorldFace(world, slab, lambda changed, ratios: self._faces(tables, changed, ratios, ramps))

    def _faces(
        self, tables: ProbeTables, slab: Slab, depth_ratios: DepthRatios, ramps: PressRamps | None
    ) -> NeighbourFace:
        scenario, x_mm, y_mm = self.scenario, self._image.x_mm, self._image.y_mm
        if ramps and slab != scenario.slab:
            raise InvalidQuantity("world's tissue", "not the scene's", "it where ramps are given", "leave it as it is")

        def face(inclusion: Inclusion, solved: PressRamps | None = None) -> NeighbourFace:
            pressed = tables.ramps(inclusion, slab, scenario.world, depth_ratios, solved=solved)
            return PressedFace(pressed, tables.off_axis, inclusion, x_mm, y_mm, slab)

        first, second = face(scenario.inclusion, ramps), scenario.neighbour
        return NeighbouredFace(first, face(second.inclusion), second) if second else first

    def cell_counts(self, t_s: float) -> float:
        """Return the noise-free load-cell counts at a time."""
        cell = self.scenario.cell
        return cell.zero_counts + cell.counts_per_n * self.scenario.world.cell_span_ratio * self.hand.force_n(t_s)

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
        pressed_s: float | None = None,
    ) -> Counts:
        """Return the counts of one exposure; a wet face shows full contact, foreign light falls on every pixel.

        `pressed_s`: since when the probe is pressed, for tissue that relaxes; as in a usual ramp unless it is told.
        """
        w_mm, p_kpa = self._face.at(force_n, place, pressed_s)
        intensity = self._image.intensity(w_mm, p_kpa, led_ratio, wet_ratio=wet_ratio, place=place)
        if ambient_ratio:
            intensity = intensity + intensity.dtype.type(ambient_ratio)
        seed = self.scenario.seed, frame_number
        return self.scenario.sensor.expose(intensity, exposure_us=exposure_us, gain=gain, seed=seed)


def _image_formation(
    scenario: Scenario, tables: ProbeTables, shape: tuple[int, int], scale: PixelScale
) -> ImageFormation:
    if scenario.light == "linear":
        return LinearImage(scenario.optics, shape, scale)
    skin, world, print_on = scenario.skin, scenario.world, None
    if scenario.grid:
        skin, print_on = scenario.grid.PLATE, scenario.grid.light_ratio
        world = replace(world, lesion=OverLesion(), texture=SkinTexture())  # a plate has none of skin's differences
    return ScatteredImage(tables.light, skin, scenario.lens, shape, scale, world, print_on)
