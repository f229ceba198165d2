"""`--probe FILE`: verbs whose defaults are the simulated probe's take another one's."""

import json
from dataclasses import replace

import cv2
import pytest
from toolkit_process import run_toolkit

from device.files.certificate_file import read_calibration
from device.files.recording_file import read_recording
from device.files.shipped import SIMULATED_PROBE
from device.instrument.press.frame_choice import ramp_targets_n
from device.measurement.mode import FRAMES
from device.measurement.quantities import Inclusion
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.data.dataset import read_dataset
from host_tools.optics.build_lookup import write_light_table
from host_tools.scenes.probe_file import NAME, probe_text, simulated_probe
from host_tools.scenes.scene_file import read_scene

OWN = simulated_probe()
FIRST = replace(OWN.layers[0], youngs_modulus_kpa=90.0)
OTHER = replace(
    OWN,
    serial="TSIS-0007",
    layers=(FIRST, *OWN.layers[1:]),
    block=replace(OWN.block, refractive_index=1.45),
    camera=replace(OWN.camera, width_px=400, height_px=300, mm_per_px_x=0.06, mm_per_px_y=0.06),
)
SCENE = ("--size-mm", 10, "--depth-mm", 6, "--modulus-kpa", 80)


@pytest.fixture
def other(tmp_path):
    path = tmp_path / "probe.toml"
    path.write_text(probe_text(OTHER))
    return path


def solved(*options):
    done = run_toolkit("simulate", *SCENE, "--strain", "small", "--json", *options)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_scene_is_solved_under_the_probe_of_a_file(other, tmp_path):
    saved = tmp_path / "scene.toml"
    default, own, stiffer = (
        solved(),
        solved("--probe", SIMULATED_PROBE / NAME),
        solved("--probe", other, "--save-scene", saved),
    )
    assert own["w_mm"] == default["w_mm"]
    assert stiffer["force_n"] > 1.005 * own["force_n"]
    assert read_scene(saved).waveguide == OTHER.waveguide


def test_options_change_the_probe_of_the_file(other, tmp_path):
    saved = tmp_path / "scene.toml"
    solved("--probe", other, "--poisson", 0.48, "--save-scene", saved)
    assert read_scene(saved).waveguide == replace(OTHER.waveguide, poisson_ratio=0.48)


def test_a_frame_is_of_the_probes_camera_and_of_its_own_light(other, tmp_path):
    frame = tmp_path / "frame.png"
    refused = run_toolkit("simulate", *SCENE, "--probe", other, "--frame", frame)
    assert refused.returncode == 1
    assert "light table's refractive_index is 1.41, but must be 1.45 as of TSIS-0007" in refused.stderr
    assert not frame.exists()
    write_light_table(tmp_path, rays=4_000, probe=OTHER)
    done = run_toolkit("simulate", *SCENE, "--probe", other, "--light", tmp_path, "--frame", frame)
    assert done.returncode == 0, done.stderr
    assert cv2.imread(str(frame), cv2.IMREAD_UNCHANGED).shape == (300, 400)


def test_a_sweep_says_the_probe_that_it_was_solved_for(other, tmp_path):
    out = tmp_path / "sweep.nc"
    assert run_toolkit("sweep", "--scenes", 1, "--jobs", 1, "--probe", other, "--out", out).returncode == 0
    surroundings = json.loads(read_dataset(out).attrs["origin"])["scene_defaults"]
    assert surroundings["waveguide"]["layer_moduli_kpa"] == [90.0, 40.0, 20.0]


@pytest.mark.long
def test_a_bound_is_of_the_probe_that_presses(other, tmp_path):
    protocol = tmp_path / "protocol.toml"
    protocol.write_text('forces_n = [0.5]\nstrain = "small"\nobservable = "displacement"\nsystematic_ratio = 0.002\n')
    options = ("limits", *SCENE, "--protocol", protocol, "--json")
    default, stiffer = (json.loads(run_toolkit(*options, *more).stdout) for more in ((), ("--probe", other)))
    assert default["std_percent"]["size_mm"] != pytest.approx(stiffer["std_percent"]["size_mm"], rel=1e-3)


@pytest.mark.parametrize("verb", [("simulate", *SCENE), ("sweep", "--out", "s.nc"), ("limits", *SCENE)])
def test_a_wrong_file_is_told_whole_and_nothing_is_computed(verb, other, tmp_path):
    other.write_text(probe_text(OTHER).replace("dome_mm = 0.0", "dome_mm = 1.5").replace("bits = 8", "bits = 9"))
    done = run_toolkit(*verb, "--probe", other, cwd=tmp_path)
    assert done.returncode == 1
    assert "camera.bits is 9" in done.stderr
    assert "face.dome_mm is 1.5" in done.stderr
    assert list(tmp_path.iterdir()) == [other]


@pytest.mark.long
def test_the_phantoms_of_a_file_are_recorded_and_calibrate_the_probe_of_a_file(tmp_path):
    """The whole way with the files of the simulated probe; bare blocks are recorded, and told to be left out."""
    files = ("--probe", SIMULATED_PROBE / NAME, "--phantoms", SIMULATED_PROBE / "phantoms.toml")
    recorded = run_toolkit("phantom", *files, "--out", tmp_path)
    assert recorded.returncode == 0, recorded.stderr
    made = sorted(tmp_path.iterdir())
    assert [one.name for one in made] == [*(f"block{i}" for i in (1, 2, 3)), *(f"phantom{i}" for i in range(1, 10))]
    block, first = read_recording(made[0]), read_recording(made[3])
    assert (block.truth, first.serial, first.phantom_serial) == (None, "SIM-0001", "SIM-PHANTOMS")
    refused = run_toolkit("calibrate", *made, *files, "--out", tmp_path / "c.json")
    assert refused.returncode == 1
    assert refused.stderr.count("is a bare block, but must be one with an inclusion") == 3
    assert not (tmp_path / "c.json").exists()
    done = run_toolkit("calibrate", *made[3:], *files, "--out", tmp_path / "c.json")
    assert done.returncode == 0, done.stderr
    assert read_calibration(tmp_path / "c.json").phantom_serial == "SIM-PHANTOMS"


def test_the_ramp_of_mode_standard_is_recorded_and_states_the_camera_that_a_grid_told(tmp_path):
    told = replace(OWN, camera=replace(OWN.camera, axis_x_mm=0.3))
    (tmp_path / "probe.toml").write_text(probe_text(told))
    asked = ("phantom", "--set", "random", "--scenes", 1, "--ramp", "--camera-of", tmp_path / "probe.toml")
    done = run_toolkit(*asked, "--out", tmp_path / "ramps")
    assert done.returncode == 0, done.stderr
    recording = read_recording(tmp_path / "ramps/random001")
    assert recording.camera.geometry == told.geometry
    press = [frame.force_n for frame in recording.with_role("press")]
    assert press == pytest.approx(ramp_targets_n(FRAMES["standard"].count, "press"), abs=0.03)
    both = run_toolkit(*asked, "--force-n", 0.4, "--out", tmp_path / "both")
    assert both.returncode == 1
    assert "not given with --ramp" in both.stderr


def test_a_probes_recording_is_of_its_camera_load_cell_and_leds(tables):
    probe = replace(
        OWN,
        serial="TSIS-0007",
        camera=replace(OWN.camera, width_px=400, height_px=300, mm_per_px_x=0.06, mm_per_px_y=0.06),
        cell=replace(OWN.cell, counts_per_n=87_000.0),
        leds=replace(OWN.leds, imbalance_ratio=(0.3, 0.0, -0.3, 0.0)),
    )
    made = phantom_recording(
        Inclusion(10.0, 6.0, 80.0), tables, seed=1, protocol=PhantomProtocol(frames=1), probe=probe
    )
    assert (made.serial, made.cell.counts_per_n) == ("TSIS-0007", 87_000.0)
    assert (made.camera.width_px, made.camera.mm_per_px_y) == (400, 0.06)
    pressed = made.with_role("press")[0]
    assert len(set(pressed.led_ratio)) == 1  # what the chip was told
    right, left = (pressed.counts[100:200, columns].mean() for columns in (slice(250, 350), slice(50, 150)))
    assert right > 1.05 * left  # brighter at +x


def test_a_certificate_needs_the_table_of_the_probe_that_it_is_for(other, tmp_path):
    done = run_toolkit("calibrate", "missing", "--probe", other, "--out", tmp_path / "c.json")
    assert done.returncode == 1
    assert f"surface table's probe is efd4d351ec5f, but must be {OTHER.sha256[:12]} of TSIS-0007" in done.stderr
    assert list(tmp_path.iterdir()) == [other]
