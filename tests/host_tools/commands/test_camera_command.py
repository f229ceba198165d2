"""`host_tools phantom --grid` to `host_tools probe camera`: a camera that is off records a grid, and is found again."""

import csv
import json
import shutil
import tomllib

import cv2
import pytest
from daemon_process import ROOT
from toolkit_process import run_toolkit

from device.config import CameraSection
from device.files.recording_file import read_recording, write_recording
from device.files.shipped import SIMULATED_PROBE
from device.files.toml_record import from_table
from device.measurement.recording.frame_light import TOUCHED_N
from host_tools.scenes.probe_file import NAME, read_probe
from host_tools.scores import camera_trial

WORLD = ROOT / "scenarios" / "worlds" / "world_16.toml"


@pytest.fixture(scope="module")
def grids(tmp_path_factory):
    """Two recordings of a grid by a camera whose axis is off; its cap has 0.01 mm of play."""
    out = tmp_path_factory.mktemp("grid")
    told = run_toolkit("phantom", "--grid", 2, "--scenario", WORLD, "--play-mm", 0.01, "--out", out)
    assert told.returncode == 0
    assert told.stderr.count("dots every 2 mm") == 2
    return [out / "grid1", out / "grid2"]


@pytest.fixture
def own(tmp_path):
    shutil.copy(SIMULATED_PROBE / NAME, tmp_path / NAME)
    return tmp_path / NAME


def true_camera():
    return tomllib.loads(WORLD.read_text())["world"]["camera"]


def test_the_camera_is_printed_with_its_deviations_as_lines_for_both_files(grids):
    told = run_toolkit("probe", "camera", *grids)
    assert told.returncode == 0
    rows = {line.split()[0]: line.split()[1:] for line in told.stdout.splitlines() if line.endswith(("mm", "%"))}
    assert float(rows["axis_x_mm"][0]) == pytest.approx(true_camera()["axis_x_mm"], abs=0.03)
    assert float(rows["axis_x_mm"][1]) == pytest.approx(0.02 / 2**0.5, rel=0.05)
    caps = [line for line in told.stdout.splitlines() if line.startswith("cap of ")]
    assert [line.split(":")[0] for line in caps] == [f"cap of {grid}" for grid in grids]
    settings, of_probe = told.stdout.split("\n[camera]\n")[1:]
    section = from_table(CameraSection, tomllib.loads(settings.split("\n#")[0]))
    assert section.rim_distortion_percent == pytest.approx(true_camera()["rim_distortion_percent"], abs=0.1)
    assert set(tomllib.loads(of_probe)) >= {"mm_per_px_y_tolerance", "distortion_ratio", "distortion_ratio_tolerance"}


def test_it_is_written_into_the_probes_file(grids, own):
    before = read_probe(own)
    found = json.loads(run_toolkit("probe", "camera", *grids, "--probe", own, "--write", "--json").stdout)
    written = read_probe(own)
    assert found["accepted"]
    assert ([one["recording"] for one in found["caps"]], found["caps_checked"]) == ([str(one) for one in grids], True)
    units = {"mm_per_px_x": "mm", "mm_per_px_y": "mm", "axis_x_mm": "mm", "axis_y_mm": "mm"}
    assert {name: one["unit"] for name, one in found["camera"].items()} == units | {"rim_distortion_percent": "%"}
    assert written.camera.axis_y_mm == pytest.approx(found["camera"]["axis_y_mm"]["value"], rel=1e-4)
    assert written.camera.mm_per_px_x == pytest.approx(0.03125 * true_camera()["scale_x_ratio"], rel=1e-3)
    assert written.camera.axis_y_mm_tolerance < 0.1 * before.camera.axis_y_mm_tolerance
    assert written.sha256 == before.sha256


def test_the_grid_of_a_bench_that_feels_no_cap_tells_the_same_camera(grids, own, tmp_path):
    """Frames and a table without force, as of a cell outside a probe whose caps rest on its rim."""
    imported = []
    for number, grid in enumerate(grids):
        bench = tmp_path / f"bench{number}"
        bench.mkdir()
        with (bench / "frames.csv").open("w", newline="") as file:
            table = csv.writer(file)
            table.writerow(("file", "role", "force_n", "t_s"))
            for place, frame in enumerate(read_recording(grid).frames):
                if frame.role != "reference" or frame.force_n > TOUCHED_N:
                    cv2.imwrite(str(bench / f"{place}.png"), frame.counts)
                    table.writerow((f"{place}.png", frame.role, 0.0, frame.t_s))
        how = ("--exposure-us", 4000, "--started-at", "2026-11-02T09:30:00+01:00")
        imported.append(tmp_path / f"grid{number}.zip")
        told = run_toolkit("import", bench, "--probe", own, *how, "--out", imported[-1])
        assert told.returncode == 0, told.stderr
    of_bench, of_probe = (
        json.loads(run_toolkit("probe", "camera", *recordings, "--probe", own, "--json").stdout)
        for recordings in (imported, grids)
    )
    assert of_bench["accepted"]
    assert of_bench["camera"] == of_probe["camera"]


@pytest.mark.parametrize(
    ("options", "named"),
    [(("--pitch-mm", 1.5), "distance of the grid's dots"), (("--pitch-mm", 2.1), "camera.mm_per_px_x")],
)
def test_another_pitch_is_named_and_nothing_written(grids, own, options, named):
    before = own.read_text()
    told = run_toolkit("probe", "camera", *grids, "--probe", own, "--write", *options)
    assert (told.returncode, told.stdout) == (1, "")
    assert named in told.stderr
    assert len(told.stderr.splitlines()) == 2
    as_json = run_toolkit("probe", "camera", *grids, "--probe", own, "--write", "--json", *options)
    assert (as_json.returncode, json.loads(as_json.stdout)["accepted"]) == (1, False)
    assert own.read_text() == before


def test_a_press_on_tissue_is_no_grid_and_each_recording_is_named(grids, own, tmp_path, tables):
    from device.measurement.quantities import Inclusion
    from host_tools.calibration.phantom import phantom_recording

    write_recording(phantom_recording(Inclusion(12.0, 6.0, 60.0), tables, seed=1), tmp_path / "press")
    told = run_toolkit("probe", "camera", grids[0], tmp_path / "press", "--probe", own, "--write")
    assert told.returncode == 1
    assert f"{tmp_path / 'press'}: dots of the grid is" in told.stderr
    assert read_probe(own).camera.axis_x_mm == 0.0


def test_to_write_takes_a_file(grids):
    told = run_toolkit("probe", "camera", *grids, "--write")
    assert told.returncode == 1
    assert "name the probe's file with --probe" in told.stderr


def test_a_grid_recorded_with_the_found_file_shows_its_camera(grids, own, tmp_path):
    """The simulator takes axis and distortion of a probe's file, and recordings carry them."""
    run_toolkit("probe", "camera", *grids, "--probe", own, "--write")
    told = run_toolkit("phantom", "--grid", 1, "--probe", own, "--play-mm", 0, "--out", tmp_path / "again")
    assert told.returncode == 0
    known = read_probe(own).geometry
    assert read_recording(tmp_path / "again" / "grid1").camera.geometry == known
    alone = json.loads(run_toolkit("probe", "camera", tmp_path / "again" / "grid1", "--json").stdout)
    again = alone["camera"]
    assert not alone["caps_checked"]
    assert "its cap was not checked" in run_toolkit("probe", "camera", tmp_path / "again" / "grid1").stdout
    assert again["axis_x_mm"]["value"] == pytest.approx(known.axis_x_mm, abs=2e-3)
    assert again["rim_distortion_percent"]["value"] == pytest.approx(known.rim_distortion_percent, abs=0.05)


@pytest.mark.long
def test_a_grid_tells_the_camera_and_a_press_gains_by_it():
    """What docs/own_probe.md claims, on one world: errors within what is wanted, rows ten times as near."""
    trial = run_toolkit("probe", "camera-trial", WORLD, "--grids", 2)
    assert trial.returncode == 0
    line = next(line for line in trial.stdout.splitlines() if line.startswith("| world_16"))
    _, _, dots, scale, axis_um, distortion, before, after, _ = (cell.strip() for cell in line.split("|"))
    assert int(dots) > 100
    assert max(abs(float(value)) for value in scale.split(",")) < 0.1
    assert max(abs(float(value)) for value in axis_um.split(",")) < 60
    assert abs(float(distortion)) < 0.2
    assert float(after) < 0.1 * float(before)


def test_a_trial_asks_for_grids():
    with pytest.raises(ValueError, match="grids is 0"):
        next(camera_trial.trial_table([WORLD], grids=0, play_mm=0.02, seed=1))
