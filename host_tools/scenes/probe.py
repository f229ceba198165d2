"""A probe as its builder knows it: what it is made of, its camera and its load cell, each number with its tolerance.

Finite elements take its `waveguide`, light its `light_block`. Both leave out what no model of this project has:
Poisson ratios that differ from layer to layer, LEDs of different brightness.
These are stated all the same, since they decide what a press of this probe may look like.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import Field

from device.measurement.quantities import Bound, InvalidQuantity
from device.measurement.recording.camera_geometry import AXIS, CameraGeometry
from device.measurement.recording.pixel_scale import PixelScale
from host_tools.scenes.light_block import LightBlock
from host_tools.scenes.scene import FaceShape, Waveguide
from host_tools.scenes.stated import SIGMAS, StatedNumbers, Tolerance, require_fitting

ABOVE_ZERO_MM = Bound(0.0, 100.0, "mm", low_included=False)
NOT_NEGATIVE_MM = Bound(0.0, 100.0, "mm")
INDEX = Bound(1.0, 3.0, "")
PIXEL = Bound(1e-4, 1.0, "mm")
SHORTER_SIDE_RATIO = 0.73
"""Part of the face that the frame's shorter side must show; the paper's sensor shows 0.82 of 22 mm.

That leaves an axis 0.9 mm beside the middle: the ring of 8 mm is still seen whole.
"""
WALLS_APART = 1e-3
"""By so much the LEDs' imbalance may differ from 0 in the mean: it is the difference from their mean."""


@dataclass(frozen=True)
class ProbeLayer:
    """One layer of the waveguide."""

    thickness_mm: Annotated[float, ABOVE_ZERO_MM, "Thickness."]
    thickness_mm_tolerance: Tolerance
    youngs_modulus_kpa: Annotated[float, Bound(0.0, 1e6, "kPa", low_included=False), "Young's modulus at small strain."]
    youngs_modulus_kpa_tolerance: Tolerance
    poisson_ratio: Annotated[
        float, Bound(0.0, 0.5, "", low_included=False, high_included=False), "Poisson's ratio, the same in all layers."
    ]
    poisson_ratio_tolerance: Tolerance


@dataclass(frozen=True)
class ProbeFace:
    """The face that touches the tissue."""

    shape: Annotated[FaceShape, 'Shape of the face: "round" or "square".']
    radius_mm: Annotated[float, ABOVE_ZERO_MM, "Radius of a round face, half the side of a square one."]
    radius_mm_tolerance: Tolerance
    dome_mm: Annotated[float, NOT_NEGATIVE_MM, "How far its middle stands out over its edge; 0 is flat."]
    dome_mm_tolerance: Tolerance


@dataclass(frozen=True)
class ProbeBlock:
    """The block that light fills, and the glass below."""

    half_width_mm: Annotated[float, ABOVE_ZERO_MM, "From the axis to the walls that carry the LEDs."]
    half_width_mm_tolerance: Tolerance
    thickness_mm: Annotated[float, ABOVE_ZERO_MM, "From the glass to the face, measured apart from the layers."]
    thickness_mm_tolerance: Tolerance
    refractive_index: Annotated[float, INDEX, "Refractive index of the silicone at the LEDs' wavelength."]
    refractive_index_tolerance: Tolerance
    wall_reflectance: Annotated[float, Bound(0.0, 1.0, ""), "Share of the light that black walls give back."]
    wall_reflectance_tolerance: Tolerance
    haze_per_mm: Annotated[float, Bound(0.0, 10.0, "1/mm"), "Scattering of the silicone; 0 is clear."]
    haze_per_mm_tolerance: Tolerance
    glass_refractive_index: Annotated[float, INDEX, "Refractive index of the glass."]
    glass_thickness_mm: Annotated[float, NOT_NEGATIVE_MM, "Thickness of the glass."]


@dataclass(frozen=True)
class ProbeLeds:
    """The four LEDs, in the middle of the walls at +x, +y, -x and -y."""

    distance_mm: Annotated[float, ABOVE_ZERO_MM, "From the axis to the window that an LED shines through."]
    distance_mm_tolerance: Tolerance
    height_mm: Annotated[float, ABOVE_ZERO_MM, "Middle of an LED above the glass."]
    height_mm_tolerance: Tolerance
    radius_mm: Annotated[float, ABOVE_ZERO_MM, "Radius of an LED's disc."]
    coupling: Annotated[Literal["air", "embedded"], '"air" behind a flat window, "embedded" when cast into the block.']
    lens_exponent: Annotated[float, Bound(1.0, 1e3, ""), "m of an emission as cos(angle)^m; 1 is Lambertian."]
    lens_exponent_tolerance: Tolerance
    imbalance_ratio: Annotated[
        tuple[
            Annotated[float, Bound(-0.5, 0.5, "")],
            Annotated[float, Bound(-0.5, 0.5, "")],
            Annotated[float, Bound(-0.5, 0.5, "")],
            Annotated[float, Bound(-0.5, 0.5, "")],
        ],
        "How much brighter than their mean each LED is, at +x, +y, -x and -y.",
    ]
    imbalance_ratio_tolerance: Tolerance


@dataclass(frozen=True)
class ProbeCamera:
    """The camera below the glass, its lens and the frames that it delivers."""

    width_px: Annotated[int, Bound(64, 4096, "px"), "Columns of a frame."]
    height_px: Annotated[int, Bound(64, 4096, "px"), "Rows of a frame."]
    bits: Annotated[Literal[8, 10, 12], "Bits of a pixel in the sensor's mode: 8, 10 or 12."]
    mm_per_px_x: Annotated[float, PIXEL, "Width of a frame's pixel on the face."]
    mm_per_px_x_tolerance: Tolerance
    mm_per_px_y: Annotated[float, PIXEL, "Height of a frame's pixel on the face."]
    mm_per_px_y_tolerance: Tolerance
    axis_x_mm: Annotated[float, AXIS, "Where the optical axis, the frame's middle, meets the face: along a row."]
    axis_x_mm_tolerance: Tolerance
    axis_y_mm: Annotated[float, AXIS, "The same down a column."]
    axis_y_mm_tolerance: Tolerance
    distortion_ratio: Annotated[
        float,
        Bound(-0.1, 0.1, ""),
        "How much farther out the face is seen where the pixel size says 11 mm; square law.",
    ]
    distortion_ratio_tolerance: Tolerance
    blur_px: Annotated[float, Bound(0.0, 20.0, "px"), "Blur, a standard deviation."]
    blur_px_tolerance: Tolerance
    lens_distance_mm: Annotated[
        float, Bound(1.0, 1e4, "mm"), "From the face to the lens, as cos^4 of the field angle falls off."
    ]
    distance_mm: Annotated[float, ABOVE_ZERO_MM, "From the upper side of the glass to the lens."]
    aperture_radius_mm: Annotated[float, ABOVE_ZERO_MM, "Radius of the lens's aperture."]


@dataclass(frozen=True)
class ProbeCell:
    """The load cell."""

    counts_per_n: Annotated[float, Bound(0.0, 1e7, "counts/N", low_included=False), "Span: counts for one newton."]
    counts_per_n_tolerance: Tolerance


@dataclass(frozen=True)
class Probe:
    """Everything that a builder knows of a probe; raises `InvalidRecord` with all that cannot be built."""

    serial: Annotated[str, Field(min_length=1), "Serial number, as in the probe's settings and on its recordings."]
    layers: tuple[ProbeLayer, ...]
    face: ProbeFace
    block: ProbeBlock
    leds: ProbeLeds
    camera: ProbeCamera
    cell: ProbeCell

    def __post_init__(self) -> None:
        if not self.layers:
            raise InvalidQuantity("layers", "none", "at least one", "add a table [[layers]] for each, face first")
        require_fitting(self, misfits)

    @property
    def waveguide(self) -> Waveguide:
        """The probe as finite elements take it."""
        return Waveguide(
            radius_mm=self.face.radius_mm,
            layer_thicknesses_mm=tuple(layer.thickness_mm for layer in self.layers),
            layer_moduli_kpa=tuple(layer.youngs_modulus_kpa for layer in self.layers),
            poisson_ratio=self.layers[0].poisson_ratio,
            face=self.face.shape,
            dome_mm=self.face.dome_mm,
        )

    @property
    def light_block(self) -> LightBlock:
        """The probe as light takes it."""
        block, leds, camera = self.block, self.leds, self.camera
        return LightBlock(
            half_width_mm=block.half_width_mm,
            thickness_mm=block.thickness_mm,
            refractive_index=block.refractive_index,
            led_height_mm=leds.height_mm,
            led_radius_mm=leds.radius_mm,
            led_coupling=leds.coupling,
            led_lens_exponent=leds.lens_exponent,
            wall_reflectance=block.wall_reflectance,
            haze_per_mm=block.haze_per_mm,
            glass_refractive_index=block.glass_refractive_index,
            glass_thickness_mm=block.glass_thickness_mm,
            aperture_radius_mm=camera.aperture_radius_mm,
            camera_distance_mm=camera.distance_mm,
        )

    @property
    def scale(self) -> PixelScale:
        """Size of a pixel on the face."""
        return PixelScale(self.camera.mm_per_px_x, self.camera.mm_per_px_y)

    @property
    def geometry(self) -> CameraGeometry:
        """Where on the face the camera's pixels look."""
        camera = self.camera
        return CameraGeometry(self.scale, camera.axis_x_mm, camera.axis_y_mm, 100 * camera.distortion_ratio)

    @property
    def frame_mm(self) -> tuple[float, float]:
        """Width and height of what a frame shows of the face."""
        return self.camera.width_px * self.camera.mm_per_px_x, self.camera.height_px * self.camera.mm_per_px_y

    @cached_property
    def sha256(self) -> str:
        """Hash of what tables are computed from, waveguide and light block, as canonical JSON.

        Serial number, tolerances, camera scale and load cell are not in it: knowing these better changes no table.
        """
        made_of = {"waveguide": asdict(self.waveguide), "light_block": asdict(self.light_block)}
        return hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()

    def origin(self) -> dict[str, object]:
        """Return what a table says of the probe that it is of."""
        return {"probe": {"serial": self.serial, "sha256": self.sha256}}


def misfits(stated: StatedNumbers, table: Mapping[str, Any]) -> Iterator[InvalidQuantity]:
    """Yield what cannot be built of numbers that hold alone."""
    yield from _layers_that_do_not_fit(stated)
    yield from _face_beyond_the_block(stated)
    yield from _leds_outside_the_block(stated)
    yield from _camera_that_does_not_fit(stated)
    yield from _face_outside_the_frame(stated)


def _layers_that_do_not_fit(stated: StatedNumbers) -> Iterator[InvalidQuantity]:
    names = [name for name in stated if name.startswith("layers[") and name.endswith(".thickness_mm")]
    stack_mm, block_mm = sum(stated[name] for name in names), stated["block.thickness_mm"]
    deviation_mm = math.hypot(*(stated.tolerance(name) for name in (*names, "block.thickness_mm")))
    if names and abs(stack_mm - block_mm) > SIGMAS * deviation_mm + 1e-9:
        yield InvalidQuantity(
            "sum of layers thickness_mm",
            f"{stack_mm:g} mm",
            f"within {SIGMAS * deviation_mm:.2g} mm of block.thickness_mm of {block_mm:g} mm",
            "measure layers and block again: the layers fill the block from face to glass",
        )
    ratios = sorted({value for name, value in stated.items() if name.endswith(".poisson_ratio")})
    if len(ratios) > 1:
        found = " and ".join(f"{ratio:g}" for ratio in ratios)
        action = "state the mean and a tolerance that holds them all: the forward model knows one ratio"
        yield InvalidQuantity("poisson_ratio of the layers", found, "the same in all layers", action)


def _face_beyond_the_block(stated: StatedNumbers) -> Iterator[InvalidQuantity]:
    radius_mm, half_mm = stated["face.radius_mm"], stated["block.half_width_mm"]
    if radius_mm > half_mm:
        action = "make the face smaller or the block wider: the face is the block's upper side"
        yield _too_large("face.radius_mm", radius_mm, f"block.half_width_mm of {half_mm:g} mm", action)
    dome_mm, first_mm = stated["face.dome_mm"], stated["layers[0].thickness_mm"]
    if dome_mm > first_mm / 2:
        action = "make the dome flatter or the first layer thicker"
        yield _too_large("face.dome_mm", dome_mm, f"half of layers[0].thickness_mm of {first_mm:g} mm", action)


def _leds_outside_the_block(stated: StatedNumbers) -> Iterator[InvalidQuantity]:
    radius_mm, height_mm, thickness_mm = (
        stated[name] for name in ("leds.radius_mm", "leds.height_mm", "block.thickness_mm")
    )
    half_mm, distance_mm = stated["block.half_width_mm"], stated["leds.distance_mm"]
    if height_mm < radius_mm or height_mm > thickness_mm - radius_mm:
        bound = str(Bound(radius_mm, thickness_mm - radius_mm, "mm"))
        yield InvalidQuantity("leds.height_mm", height_mm, bound, "keep the whole LED on the block's wall")
    if radius_mm > half_mm:
        action = "use a smaller LED or a wider block"
        yield _too_large("leds.radius_mm", radius_mm, f"block.half_width_mm of {half_mm:g} mm", action)
    apart_mm = SIGMAS * math.hypot(stated.tolerance("leds.distance_mm"), stated.tolerance("block.half_width_mm"))
    if abs(distance_mm - half_mm) > apart_mm + 1e-9:
        bound = f"within {apart_mm:.2g} mm of block.half_width_mm of {half_mm:g} mm"
        yield InvalidQuantity("leds.distance_mm", distance_mm, bound, "put the LEDs' windows at the block's walls")
    mean = sum(stated[f"leds.imbalance_ratio[{side}]"] for side in range(4)) / 4
    if abs(mean) > WALLS_APART:
        action = "state each LED's brightness over the mean of all four, less 1"
        yield InvalidQuantity("mean of leds.imbalance_ratio", f"{mean:.3g}", f"within {WALLS_APART:g} of 0", action)


def _camera_that_does_not_fit(stated: StatedNumbers) -> Iterator[InvalidQuantity]:
    aperture_mm, half_mm = stated["camera.aperture_radius_mm"], stated["block.half_width_mm"]
    if aperture_mm >= half_mm:
        action = "keep the LEDs' walls outside the camera's lens"
        yield _too_large("camera.aperture_radius_mm", aperture_mm, f"block.half_width_mm of {half_mm:g} mm", action)
    distance_mm, glass_mm = stated["camera.distance_mm"], stated["block.glass_thickness_mm"]
    if distance_mm <= glass_mm:
        bound = f"above block.glass_thickness_mm of {glass_mm:g} mm"
        yield InvalidQuantity("camera.distance_mm", distance_mm, bound, "place the camera below the glass")


def _face_outside_the_frame(stated: StatedNumbers) -> Iterator[InvalidQuantity]:
    """Yield what a frame misses: along its longer side it must show the whole face, along its shorter one most of it.

    An image axis beside the frame's middle takes from one end what it gives to the other.
    """
    width_mm, height_mm = (
        stated[f"camera.{side}_px"] * stated[f"camera.mm_per_px_{axis}"]
        for side, axis in (("width", "x"), ("height", "y"))
    )
    seen_mm = [
        length_mm - 2 * abs(stated[f"camera.axis_{axis}_mm"]) for axis, length_mm in (("x", width_mm), ("y", height_mm))
    ]
    if any(map(math.isnan, seen_mm)):
        return
    face_mm = 2 * stated["face.radius_mm"]
    for name, length_mm, needed_mm in (
        ("longer side of the camera's window", max(seen_mm), face_mm),
        ("shorter side of the camera's window", min(seen_mm), SHORTER_SIDE_RATIO * face_mm),
    ):
        if length_mm < needed_mm:
            bound = f"at least {needed_mm:.3g} mm of the face's {face_mm:g} mm"
            action = "use a wider lens or more pixels, or centre the camera"
            yield InvalidQuantity(name, f"{length_mm:.3g} mm", bound, action)


def _too_large(quantity: str, value_mm: float, bound: str, action: str) -> InvalidQuantity:
    return InvalidQuantity(quantity, value_mm, f"at most {bound}", action)
