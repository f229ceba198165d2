"""A light block under a face in partial contact to a scene file of Mitsuba 3 and the mesh of the face beside it.

The face is one surface of two laws mixed by its contact ratio: a dielectric against air where dry, a diffuse reflector
in the block's own index where wet. Skin behind a second interface would be nearer to the tracer's general case, but
hides the LEDs from Mitsuba's light sampling. Source: Mitsuba 3 documentation, "blendbsdf", "ply", "orthographic".
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import InvalidQuantity
from device.simulation.physics.skin import Skin
from host_tools.optics.traced import TracedFace
from host_tools.scenes.light_block import SIDES, LightBlock

SCENE_FILE, FACE_FILE = "scene.xml", "face.ply"
LED_CLEARANCE_MM = 1e-3
"""LEDs float this far inside their wall, since two surfaces in one plane cannot be told apart."""


@dataclass(frozen=True)
class MitsubaCamera:
    """A square image of the whole face, seen from below by a telecentric camera; paths end after `depth` segments."""

    pixels: int = 96
    depth: int = 24


def write_mitsuba_scene(
    folder: Path,
    block: LightBlock,
    face: TracedFace,
    skin: Skin,
    *,
    led_ratio: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0),
    camera: MitsubaCamera | None = None,
) -> Path:
    """Write scene and mesh into a folder that exists; return the scene's path.

    Radiance in the image is in 1/(sr mm2) per unit flux of all LEDs together. Raises `InvalidQuantity` for what this
    scene cannot hold: LEDs behind an air gap, haze, a glass plate, skin behind dry places,
    a spread, skin of another index, or a face that does not reach from wall to wall.
    """
    _require_comparable(block, face, skin)
    path = folder / SCENE_FILE
    write_face(folder / FACE_FILE, face, block.thickness_mm)
    path.write_text(_scene(block, skin, led_ratio, camera or MitsubaCamera()))
    return path


def _require_comparable(block: LightBlock, face: TracedFace, skin: Skin) -> None:
    wanted: tuple[tuple[str, Any, Any], ...] = (
        ("led_coupling", block.led_coupling, "embedded"),
        ("led_lens_exponent", block.led_lens_exponent, 1.0),
        ("haze_per_mm", block.haze_per_mm, 0.0),
        ("glass_refractive_index", block.glass_refractive_index, block.refractive_index),
        ("glass_thickness_mm", block.glass_thickness_mm, 0.0),
        ("skin_behind", face.skin_behind, False),
        ("spread_mm", skin.spread_mm, 0.0),
        ("skin refractive_index", skin.refractive_index, block.refractive_index),
    )
    for name, value, only in wanted:
        if value != only:
            raise InvalidQuantity(name, value, f"{only}", "change the scene: Mitsuba's is the simpler one")
    for name, ends_mm in (("x_mm", face.x_mm[[0, -1]]), ("y_mm", face.y_mm[[0, -1]])):
        if not np.allclose(ends_mm, (-block.half_width_mm, block.half_width_mm)):
            found, wanted_mm = f"{ends_mm[0]:g} to {ends_mm[1]:g}", f"+- {block.half_width_mm:g} mm"
            raise InvalidQuantity(name, found, wanted_mm, "give the face from wall to wall, or the mesh has gaps")


def write_face(path: Path, face: TracedFace, thickness_mm: float) -> None:
    """Write the face as triangles between its grid points; each point carries its contact ratio as "phi"."""
    x_mm, y_mm = np.meshgrid(face.x_mm, face.y_mm)
    columns = (x_mm, y_mm, thickness_mm - face.w_mm, face.contact_ratio)
    points = np.stack([c.ravel() for c in columns], axis=1).astype("<f4")
    triangles = _triangles(*x_mm.shape)
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
        "property float x\nproperty float y\nproperty float z\nproperty float phi_0\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.empty(len(triangles), np.dtype([("corners", "u1"), ("vertex", "<i4", 3)]))
    rows["corners"], rows["vertex"] = 3, triangles
    path.write_bytes(header.encode() + points.tobytes() + rows.tobytes())


def _triangles(rows: int, columns: int) -> NDArray[np.int32]:
    """Return two triangles (n, 3) a cell, counter-clockwise seen from above: their normals leave the block."""
    corner = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    a, b, c, d = (corner[i, j].ravel() for i, j in _CELL)
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


_CELL = (
    np.s_[:-1, :-1],
    np.s_[:-1, 1:],
    np.s_[1:, 1:],
    np.s_[1:, :-1],
)


def _scene(block: LightBlock, skin: Skin, led_ratio: tuple[float, float, float, float], camera: MitsubaCamera) -> str:
    glass = f'<float name="int_ior" value="{block.refractive_index:g}"/><float name="ext_ior" value="1"/>'
    dielectric = f'<bsdf type="dielectric">{glass}</bsdf>'
    parts = [
        f'<integrator type="path"><integer name="max_depth" value="{camera.depth}"/></integrator>',
        _sensor(block, camera),
        f'<bsdf type="diffuse" id="wall"><rgb name="reflectance" value="{block.wall_reflectance:g}"/></bsdf>',
        _rectangle(block.half_width_mm, block.half_width_mm, (0, 0, 0), (0, 0, -1), dielectric),
        *_walls(block),
        *_leds(block, led_ratio),
        _pressed_face(dielectric, skin),
    ]
    return "\n".join(['<scene version="3.0.0">', *parts, "</scene>\n"])


def _sensor(block: LightBlock, camera: MitsubaCamera) -> str:
    """Return an orthographic camera below the block; with this "up" its image shows x rightwards and y downwards."""
    a, pixels = block.half_width_mm, camera.pixels
    view = f'<scale value="{a:g}, {a:g}, 1"/><lookat origin="0, 0, -{block.camera_distance_mm:g}" '
    view += 'target="0, 0, 0" up="0, -1, 0"/>'
    size = "".join(f'<integer name="{side}" value="{pixels}"/>' for side in ("width", "height"))
    film = f'<film type="hdrfilm">{size}<string name="pixel_format" value="luminance"/><rfilter type="box"/></film>'
    return f'<sensor type="orthographic"><transform name="to_world">{view}</transform>{film}</sensor>'


Point = tuple[float, float, float]


def _rectangle(half_x: float, half_y: float, centre: Point, towards: Point, inside: str) -> str:
    """Return a rectangle about a centre whose normal points towards a direction."""
    place = _placed(f'<scale value="{half_x:g}, {half_y:g}, 1"/>', centre, towards)
    return f'<shape type="rectangle">{place}{inside}</shape>'


def _placed(scale: str, centre: Point, towards: Point) -> str:
    target = tuple(c + t for c, t in zip(centre, towards, strict=True))
    up = "0, 0, 1" if towards[2] == 0 else "0, 1, 0"
    look = f'<lookat origin="{_text(centre)}" target="{_text(target)}" up="{up}"/>'
    return f'<transform name="to_world">{scale}{look}</transform>'


def _text(vector: tuple[float, ...]) -> str:
    return ", ".join(f"{value:.9g}" for value in vector)


def _walls(block: LightBlock) -> list[str]:
    a, T = block.half_width_mm, block.thickness_mm
    wall = '<ref id="wall"/>'
    return [_rectangle(a, T / 2, (a * x, a * y, T / 2), (-x, -y, 0.0), wall) for x, y in SIDES]


def _leds(block: LightBlock, led_ratio: tuple[float, float, float, float]) -> list[str]:
    """Return the LEDs: a disc of flux F and radius a, Lambertian in the block, has the radiance F / (pi a)^2."""
    distance, radius = block.half_width_mm - LED_CLEARANCE_MM, block.led_radius_mm
    scale = f'<scale value="{radius:g}"/>'
    shapes = []
    for (x, y), ratio in zip(SIDES, led_ratio, strict=True):
        radiance = ratio / sum(led_ratio) / (np.pi * radius) ** 2
        place = _placed(scale, (distance * x, distance * y, block.led_height_mm), (-x, -y, 0.0))
        light = f'<emitter type="area"><rgb name="radiance" value="{radiance:.9g}"/></emitter>'
        shapes.append(f'<shape type="disk">{place}<ref id="wall"/>{light}</shape>')
    return shapes


def _pressed_face(dielectric: str, skin: Skin) -> str:
    wet = f'<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="{skin.albedo:g}"/></bsdf></bsdf>'
    weight = '<texture type="mesh_attribute" name="weight"><string name="name" value="vertex_phi"/></texture>'
    mixed = f'<bsdf type="blendbsdf">{weight}{dielectric}{wet}</bsdf>'
    file = f'<string name="filename" value="{FACE_FILE}"/>'
    return f'<shape type="ply">{file}<boolean name="face_normals" value="true"/>{mixed}</shape>'
