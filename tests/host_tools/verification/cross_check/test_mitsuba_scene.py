"""Mitsuba's scene says what the block says: LEDs by flux, contact mixed into the face, normals out of the block."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.simulation.physics.skin import Skin
from host_tools.optics.traced import TracedFace
from host_tools.scenes.light_block import LightBlock
from host_tools.verification.cross_check.mitsuba_scene import MitsubaCamera, write_mitsuba_scene

BLOCK = LightBlock(led_coupling="embedded", glass_refractive_index=1.41, glass_thickness_mm=0.0)
SKIN = Skin(refractive_index=1.41, albedo=0.4, spread_mm=0.0)
GRID_MM = np.array([-12.0, 0.0, 12.0])
POINTS = 9


def face(**changes: object) -> TracedFace:
    w_mm, contact = np.zeros((3, 3)), np.zeros((3, 3))
    w_mm[0, 2], contact[2, 0] = 0.5, 0.75
    return replace(TracedFace(GRID_MM, GRID_MM, w_mm, contact, skin_behind=False), **changes)


def written(folder: Path, led_ratio: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)) -> ElementTree.Element:
    path = write_mitsuba_scene(folder, BLOCK, face(), SKIN, led_ratio=led_ratio, camera=MitsubaCamera(pixels=32))
    return ElementTree.parse(path).getroot()


def mesh(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return points (x, y, z, phi) and triangles of the file."""
    content = (folder / "face.ply").read_bytes()
    body = content[content.index(b"end_header\n") + len(b"end_header\n") :]
    points = np.frombuffer(body, "<f4", 4 * POINTS).reshape(-1, 4)
    rows = np.frombuffer(body[16 * POINTS :], np.dtype([("n", "u1"), ("vertex", "<i4", 3)]))
    assert set(rows["n"]) == {3}
    return points, rows["vertex"]


def test_the_leds_share_one_unit_of_light_by_their_ratio(tmp_path: Path) -> None:
    lights = written(tmp_path, (1.0, 1.0, 1.0, 0.5)).findall("shape/emitter/rgb")
    flux = [float(light.get("value", "")) * (math.pi * BLOCK.led_radius_mm) ** 2 for light in lights]
    assert flux == pytest.approx([2 / 7, 2 / 7, 2 / 7, 1 / 7])


def test_the_leds_stand_just_inside_their_walls_in_the_order_of_the_sides(tmp_path: Path) -> None:
    discs = [shape for shape in written(tmp_path).findall("shape") if shape.get("type") == "disk"]
    origins = [str(disc.find("transform/lookat").get("origin")) for disc in discs]  # type: ignore[union-attr]
    places = [[float(v) for v in origin.split(",")] for origin in origins]
    assert places == [[11.999, 0, 5], [0, 11.999, 5], [-11.999, 0, 5], [0, -11.999, 5]]


def test_contact_mixes_the_dry_interface_with_a_diffuse_reflector_of_the_skins_albedo(tmp_path: Path) -> None:
    mixed = written(tmp_path).find("shape/bsdf[@type='blendbsdf']")
    assert mixed is not None
    assert [part.get("type") for part in mixed] == ["mesh_attribute", "dielectric", "twosided"]
    assert mixed.find("bsdf/bsdf/rgb").get("value") == "0.4"  # type: ignore[union-attr]
    assert [index.get("value") for index in mixed.findall("bsdf[@type='dielectric']/float")] == ["1.41", "1"]


def test_the_mesh_carries_height_and_contact_of_every_grid_point(tmp_path: Path) -> None:
    written(tmp_path)
    points, _ = mesh(tmp_path)
    heights = {(float(x), float(y)): (float(z), float(phi)) for x, y, z, phi in points}
    assert heights[12.0, -12.0] == (9.5, 0.0)
    assert heights[-12.0, 12.0] == (10.0, 0.75)
    assert heights[0.0, 0.0] == (10.0, 0.0)


def test_the_mesh_covers_the_face_once_with_normals_out_of_the_block(tmp_path: Path) -> None:
    written(tmp_path)
    points, triangles = mesh(tmp_path)
    a, b, c = (points[triangles[:, k], :2].astype(float) for k in range(3))
    u, v = b - a, c - a
    doubled = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    assert (doubled > 0).all()
    assert doubled.sum() / 2 == pytest.approx(24.0**2)


@pytest.mark.parametrize(
    ("block", "changed_face", "skin", "sentence"),
    [
        (replace(BLOCK, led_coupling="air"), {}, SKIN, "led_coupling is air"),
        (replace(BLOCK, haze_per_mm=0.01), {}, SKIN, "haze_per_mm is 0.01"),
        (replace(BLOCK, glass_thickness_mm=1.0), {}, SKIN, "glass_thickness_mm is 1"),
        (BLOCK, {"skin_behind": True}, SKIN, "skin_behind is True"),
        (BLOCK, {"x_mm": GRID_MM / 2}, SKIN, "x_mm is -6 to 6"),
        (BLOCK, {}, replace(SKIN, spread_mm=1.0), "spread_mm is 1"),
        (BLOCK, {}, replace(SKIN, refractive_index=1.38), "skin refractive_index is 1.38"),
    ],
)
def test_what_the_scene_cannot_hold_is_refused(
    block: LightBlock, changed_face: dict[str, object], skin: Skin, sentence: str, tmp_path: Path
) -> None:
    with pytest.raises(InvalidQuantity, match=sentence):
        write_mitsuba_scene(tmp_path, block, face(**changed_face), skin)
    assert list(tmp_path.iterdir()) == []
