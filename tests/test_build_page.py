"""docs/build.md says the figures of the code: geometry, pins, sides, addresses; and its commands are commands."""

from __future__ import annotations

import re
import shlex
import tomllib
import xml.etree.ElementTree as ElementTree

import pytest
from daemon_process import ROOT

from device.__main__ import _parser
from device.config import CellSection, Config, PressSection
from device.config_chips import CHIP_ADDRESSES
from device.files.toml_record import from_table
from device.hardware.pca9685 import IDENTITY as PCA9685_IDENTITY
from device.hardware.pca9685 import Pca9685Register
from device.hardware.tlc59116 import IDENTITY as TLC59116_IDENTITY
from device.measurement.recording.led_sides import SIDES
from host_tools.scenes.light_block import LightBlock
from host_tools.scenes.scene import Waveguide

PAGE = (ROOT / "docs" / "build.md").read_text(encoding="utf-8")
FIGURES = ROOT / "docs" / "figures"
WAVEGUIDE, BLOCK, CONFIG = Waveguide(), LightBlock(), Config()


def table(first: str) -> list[list[str]]:
    """Return the cells of the table whose header begins with some words."""
    [text] = re.findall(rf"^(\| {re.escape(first)} \|.*?)\n\n", PAGE, re.MULTILINE | re.DOTALL)
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines()[2:]]


def listed(values: tuple[float, ...], unit: str) -> str:
    return ", ".join(f"{value:g} {unit}" for value in values)


def geometry() -> dict[str, str]:
    """Return every figure of the code that the page states."""
    camera, glass = CONFIG.camera, f"{BLOCK.glass_thickness_mm:g} mm"
    across = f"{camera.width_px * camera.mm_per_px_x:.1f} x {camera.height_px * camera.mm_per_px_y:.1f} mm"
    return {
        "face": f"{WAVEGUIDE.face}, radius {WAVEGUIDE.radius_mm:g} mm, {'domed' if WAVEGUIDE.dome_mm else 'flat'}",
        "layers, from the tissue": listed(WAVEGUIDE.layer_thicknesses_mm, "mm"),
        "their Young's moduli": listed(WAVEGUIDE.layer_moduli_kpa, "kPa"),
        "Poisson's ratio": f"{WAVEGUIDE.poisson_ratio:g}",
        "central window": f"radius {WAVEGUIDE.central_radius_mm:g} mm",
        "block": f"square, {2 * BLOCK.half_width_mm:g} mm across, {BLOCK.thickness_mm:g} mm thick",
        "its refractive index": f"{BLOCK.refractive_index:g}",
        "LEDs": f"middle of each side, {BLOCK.led_height_mm:g} mm above the glass, "
        f"discs of {2 * BLOCK.led_radius_mm:g} mm",
        "between LED and block": {"air": "air and a flat window", "embedded": "nothing"}[BLOCK.led_coupling],
        "reflectance of the other walls": f"{BLOCK.wall_reflectance:g}",
        "glass": f"{glass}, refractive index {BLOCK.glass_refractive_index:g}",
        "camera": f"{BLOCK.camera_distance_mm:g} mm below the upper side of the glass, "
        f"aperture {2 * BLOCK.aperture_radius_mm:g} mm across, or less",
        "frame": f"{across} on the face, {camera.width_px} x {camera.height_px} pixels",
        "press": f"{PressSection().target_n:g} N, at most {PressSection().overload_n:g} N; "
        f"the cell bears {CellSection().max_load_n:g} N",
    }


def test_the_geometry_is_that_of_the_code() -> None:
    assert {what: value for what, value, _ in table("what")} == geometry()


def test_the_lens_shows_the_frame_on_the_sensor_by_the_thin_lens() -> None:
    """1 / f = 1 / distance + 1 / image distance; a slab of index n looks n times as thin."""
    [row] = [row for row in table("part") if row[0] == "lens"]
    air_mm = BLOCK.camera_distance_mm - BLOCK.glass_thickness_mm
    glass_mm = BLOCK.glass_thickness_mm / BLOCK.glass_refractive_index
    distance_mm = air_mm + glass_mm + BLOCK.thickness_mm / BLOCK.refractive_index
    across_mm = CONFIG.camera.width_px * CONFIG.camera.mm_per_px_x
    magnification = 1070 * 0.003 / across_mm
    focal_mm = distance_mm * magnification / (1 + magnification)
    assert row[1].startswith(f"some {focal_mm:.1f} mm of focal length, M12, sharp at some {distance_mm:.0f} mm")
    assert f"look like {distance_mm:.1f} mm.\nThere {across_mm:.1f} mm fill 1070 pixels of 3 um" in PAGE


def test_mechanics_and_light_mean_one_thickness() -> None:
    assert sum(WAVEGUIDE.layer_thicknesses_mm) == BLOCK.thickness_mm


def drawn(name: str) -> list[str]:
    root = ElementTree.parse(FIGURES / name).getroot()
    return [(element.text or "").strip() for element in root.iter("{http://www.w3.org/2000/svg}text")]


def test_the_section_shows_the_lengths_of_the_code() -> None:
    texts = drawn("probe_section.svg")
    layers = [text for text in texts if re.match(r"\d mm, \d\d kPa", text)]
    pairs = zip(WAVEGUIDE.layer_thicknesses_mm, WAVEGUIDE.layer_moduli_kpa, strict=True)
    assert [text.partition(":")[0] for text in layers] == [f"{mm:g} mm, {kpa:g} kPa" for mm, kpa in pairs]
    assert f"face: {2 * WAVEGUIDE.radius_mm:g} mm across (radius {WAVEGUIDE.radius_mm:g} mm)" in texts
    assert f"central window: radius {WAVEGUIDE.central_radius_mm:g} mm" in texts
    assert f"block: {2 * BLOCK.half_width_mm:g} mm across" in texts
    assert f"{BLOCK.camera_distance_mm:g} mm to the upper" in texts
    lengths = (BLOCK.led_height_mm, BLOCK.thickness_mm, BLOCK.glass_thickness_mm, 2 * BLOCK.aperture_radius_mm)
    assert {f"{length:g} mm" for length in lengths} <= set(texts)
    assert f"{2 * BLOCK.led_radius_mm:g} mm across" in texts


def test_the_pins_of_the_drawing_are_those_of_the_table() -> None:
    texts = drawn("wiring.svg")
    for pin, name, *_ in table("header pin"):
        assert texts[texts.index(name) + 1] == pin


def test_the_sides_are_on_the_outputs_that_the_drivers_write() -> None:
    """Both write the four sides to outputs 0-3, in the order of `SIDES`."""
    assert table("side") == [[side, f"OUT{n}", f"LED{n}"] for n, side in enumerate(SIDES)]
    texts = drawn("wiring.svg")
    assert [text for text in texts if text in SIDES] == list(SIDES)
    assert [text for text in texts if re.fullmatch(r"OUT\d", text)] == [f"OUT{n}" for n in range(len(SIDES))]
    assert Pca9685Register.LED0_ON_L == 0x06


def test_the_addresses_are_those_at_which_the_chips_are_asked() -> None:
    """An all-call address is half of its register, which has the bit for reading beside it."""
    tlc, pca = CHIP_ADDRESSES["tlc59116"].default, CHIP_ADDRESSES["pca9685"].default
    assert (f"{tlc:x}", f"{TLC59116_IDENTITY[-1] >> 1:x}") == ("60", "68")
    assert (f"{pca:x}", f"{PCA9685_IDENTITY[-1] >> 1:x}") == ("40", "70")
    assert "A TLC59116 answers at 60, and fresh from its supply at 68" in PAGE
    assert "a PCA9685 at 40 and 70" in PAGE


def test_the_settings_of_step_6_are_settings() -> None:
    [text] = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    config = from_table(Config, tomllib.loads(re.sub(r"^ +", "", text, flags=re.MULTILINE)))
    assert config.camera.raw_mode.crop_px == (1070, 800)
    [line] = [row for row in table("header pin") if "RESET" in row[2]]
    assert line[1] == f"BCM{config.light.enable_line}"


def test_there_are_ten_steps_each_with_a_command() -> None:
    steps = re.split(
        r"^\d+\. \*\*", PAGE.split("## Bring it up in ten steps")[1].split("\n## ")[0], flags=re.MULTILINE
    )[1:]
    assert len(steps) == 10
    assert all(re.search(r"```console\n +[$#] ", step) for step in steps)


@pytest.mark.parametrize("line", re.findall(r"^ +[$#] python -m device (.*)$", PAGE, re.MULTILINE))
def test_every_command_of_the_daemon_is_one(line: str) -> None:
    assert _parser().parse_args(shlex.split(line)).command
