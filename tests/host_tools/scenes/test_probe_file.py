"""`probe.toml`: the simulated probe's file says the defaults of the code, and a wrong one is told whole."""

import re
import tomllib
from dataclasses import replace

import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

from device.config import CameraSection
from device.files.shipped import SIMULATED_PROBE
from device.files.toml_record import InvalidRecord, read_table
from device.measurement.quantities import InvalidQuantity
from device.simulation.physics.lens import Lens
from device.simulation.physics.sensor import Sensor
from device.simulation.scenario import CellSettings, Scenario
from device.simulation.virtual_probe import SIMULATED_PROBE_SHA256
from host_tools.scenes.light_block import LightBlock
from host_tools.scenes.probe import Probe, misfits
from host_tools.scenes.probe_file import (
    NAME,
    probe_of,
    probe_text,
    read_probe,
    simulated_probe,
    write_camera,
    write_new_probe,
)
from host_tools.scenes.scene import Waveguide
from host_tools.scenes.stated import stated_problems

PROBE = simulated_probe()
TEXT = (SIMULATED_PROBE / NAME).read_text(encoding="utf-8")


def test_the_file_of_the_simulated_probe_says_the_defaults_of_finite_elements_and_light():
    assert PROBE.waveguide == Waveguide()
    assert PROBE.light_block == LightBlock()
    assert PROBE.sha256 == SIMULATED_PROBE_SHA256


def test_the_file_of_the_simulated_probe_says_the_defaults_of_camera_and_load_cell():
    camera, daemon = PROBE.camera, CameraSection()
    assert (camera.blur_px, camera.lens_distance_mm, camera.bits) == (Lens().blur_px, Lens().distance_mm, Sensor().bits)
    assert (camera.width_px, camera.height_px) == (daemon.width_px, daemon.height_px)
    assert (camera.mm_per_px_x, camera.mm_per_px_y) == (daemon.mm_per_px_x, daemon.mm_per_px_y)
    assert PROBE.cell.counts_per_n == CellSettings().counts_per_n
    assert PROBE.serial == Scenario().serial
    assert {camera.axis_x_mm, camera.axis_y_mm, camera.distortion_ratio, *PROBE.leds.imbalance_ratio} == {0.0}
    assert PROBE.leds.distance_mm == LightBlock().half_width_mm


def test_the_file_of_the_simulated_probe_is_written_as_it_reads(tmp_path):
    assert probe_text(PROBE) == TEXT
    other = replace(PROBE, serial="TSIS-0007", cell=replace(PROBE.cell, counts_per_n=87_654.321))
    (tmp_path / "probe.toml").write_text(probe_text(other))
    assert read_probe(tmp_path / "probe.toml") == probe_of(tmp_path / "probe.toml") == other
    assert probe_of(None) == PROBE


MEASURED = {"mm_per_px_x": 0.0316, "mm_per_px_x_tolerance": 1.6e-05, "axis_y_mm": -0.25, "distortion_ratio": -0.012}


def test_a_measured_camera_is_written_between_what_the_builder_wrote(tmp_path):
    """Comments stay, also those of other keys of the same names; a file that is laid out otherwise is written anew."""
    own = TEXT.replace("mm_per_px_x = 0.03125\n", "mm_per_px_x = 0.03125   # by eye\n") + "# the builder's last word\n"
    dotted = tomli_w.dumps(tomllib.loads(TEXT)).replace("[camera]\n", "[ camera ]\n")
    for text in (own, dotted):
        file = tmp_path / "probe.toml"
        file.write_text(text)
        written = write_camera(file, MEASURED)
        assert read_probe(file) == written
        assert {name: getattr(written.camera, name) for name in MEASURED} == MEASURED
        assert replace(written, camera=PROBE.camera) == PROBE
    file.write_text(own)
    write_camera(file, MEASURED)
    before, after = own.splitlines(), file.read_text().splitlines()
    changed = [new for old, new in zip(before, after, strict=True) if old != new]
    assert changed[:2] == ["mm_per_px_x = 0.0316   # by eye", "mm_per_px_x_tolerance = 1.6e-05"]
    assert len(changed) == len(MEASURED)


def test_a_camera_that_no_probe_can_have_is_not_written(tmp_path):
    file = tmp_path / "probe.toml"
    file.write_text(TEXT)
    with pytest.raises(InvalidRecord, match="shorter side of the camera's window"):
        write_camera(file, {"axis_y_mm": 1.9})
    assert file.read_text() == TEXT


WRONG = (
    ('serial = "SIM-0001"', 'serial = ""'),
    ("thickness_mm_tolerance = 0.05", "thickness_mm_tolerance = 0"),
    ("youngs_modulus_kpa_tolerance = 4.0", "youngs_modulus_kpa_tolerance = 40.0"),
    ("thickness_mm = 5.0\n", "thickness_mm = 7.0\n"),
    ('shape = "round"', 'shape = "oval"'),
    ("dome_mm_tolerance = 0.02", "dome_mm_tolerance = -0.02"),
    ("half_width_mm = 12.0", "half_width_cm = 1.2"),
    ("half_width_mm_tolerance = 0.05\n", ""),
    ("height_mm = 5.0", "height_mm = 9.9"),
    ("mm_per_px_x = 0.03125", "mm_per_px_x = 0.02"),
    ("counts_per_n = 100000.0", 'counts_per_n = "many"'),
)


def test_everything_that_is_wrong_in_a_file_is_told_at_once(tmp_path):
    text = TEXT
    for right, wrong in WRONG:
        assert right in text
        text = text.replace(right, wrong, 1)
    (tmp_path / "probe.toml").write_text(text)
    with pytest.raises(InvalidRecord) as refused:
        read_probe(tmp_path / "probe.toml")
    assert {problem.quantity for problem in refused.value.problems} == {
        "serial",
        "layers[0].thickness_mm_tolerance",
        "layers[1].youngs_modulus_kpa_tolerance",
        "sum of layers thickness_mm",
        "face.shape",
        "face.dome_mm_tolerance",
        "block.half_width_cm",
        "block.half_width_mm_tolerance",
        "leds.height_mm",
        "longer side of the camera's window",
        "shorter side of the camera's window",
        "cell.counts_per_n",
    }
    told = str(refused.value)
    assert "block.half_width_cm is 1.2" in told
    assert "did you mean block.half_width_mm" in told
    assert "layers[0].thickness_mm_tolerance is 0, but must be above 0: state one standard deviation" in told


def test_a_new_file_asks_for_every_tolerance_and_for_the_serial_number_alone(tmp_path):
    path = tmp_path / "probe.toml"
    write_new_probe(path, None)
    with pytest.raises(InvalidRecord) as refused:
        read_probe(path)
    asked = {problem.quantity for problem in refused.value.problems}
    tolerances = sum(line.split(" ")[0].endswith("_tolerance") for line in TEXT.splitlines())
    assert len(asked) == len(refused.value.problems) == tolerances + 1
    assert {name for name in asked if not name.endswith("_tolerance")} == {"serial"}
    assert all(problem.value == "missing" for problem in refused.value.problems)


def test_a_new_file_that_is_filled_in_is_a_probe(tmp_path):
    path = tmp_path / "probe.toml"
    write_new_probe(path, "TSIS-0007")
    filled = re.sub(r"^# (\w+) = \?$", r"\1 = 0.01", path.read_text(), flags=re.MULTILINE)
    path.write_text(filled)
    assert read_probe(path).serial == tomllib.loads(filled)["serial"] == "TSIS-0007"


def test_a_file_that_exists_is_not_written_over(tmp_path):
    path = tmp_path / "probe.toml"
    path.write_text("mine")
    with pytest.raises(InvalidQuantity, match="must be a new file"):
        write_new_probe(path, None)
    assert path.read_text() == "mine"


LEAVES = [line.split(" ")[0] for line in TEXT.splitlines() if re.match(r"\w+ = ", line)]


@given(
    key=st.sampled_from(LEAVES),
    value=st.one_of(st.floats(allow_nan=False, allow_infinity=False), st.text(max_size=3), st.booleans(), st.just([])),
)
@settings(max_examples=60, deadline=None)
def test_whatever_a_file_says_it_is_read_or_refused_by_name(tmp_path_factory, key, value):
    """Any value for any key: no other error ever comes out."""
    written = tomli_w.dumps({key: value})
    path = tmp_path_factory.mktemp("probe") / "probe.toml"
    path.write_text(re.sub(rf"^{key} = (\[[^\]]*\]|.*)\n", lambda _: written, TEXT, count=1, flags=re.MULTILINE))
    problems = stated_problems(Probe, read_table(path), misfits)
    assert all(one.quantity and one.bound and one.action for one in problems)
    assert problems or read_probe(path).waveguide.radius_mm > 0


def test_a_whole_number_is_a_number(tmp_path):
    path = tmp_path / "probe.toml"
    path.write_text(
        TEXT.replace("radius_mm = 11.0", "radius_mm = 11").replace("thickness_mm = 2.0", "thickness_mm = 2")
    )
    assert read_probe(path).sha256 == PROBE.sha256
