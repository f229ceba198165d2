"""The toolkit's commands as a researcher types them: output, exit codes, and one sentence for what cannot be done."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest
from daemon_process import ROOT
from toolkit_process import run_toolkit

from device.files.certificate_file import read_calibration
from device.files.recording_file import write_recording
from device.files.shipped import SIMULATED_PROBE
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.scenario import Scenario
from host_tools import __main__ as command_line
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.commands.output import require_writable, require_writable_folder
from host_tools.paper_network.export_refused import ExportRefused

SCENE = ["--size-mm", "10", "--depth-mm", "6", "--modulus-kpa", "80"]
PROBE_FILE = str(SIMULATED_PROBE / "probe.toml")
PRESS = [*SCENE, "--force-n", "0.5", "--strain", "small"]


def test_simulate_prints_the_contracts_fields_as_json():
    done = run_toolkit("simulate", *SCENE, "--indentation-mm", 1, "--strain", "small", "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert record["force_n"] == pytest.approx(0.2051, rel=5e-3)
    assert record["max_deformation_mm"] == pytest.approx(0.02162, rel=5e-3)
    assert len(record["r_mm"]) == len(record["w_mm"]) == len(record["w_baseline_mm"]) == len(record["p_kpa"])
    assert record["plan"]["symmetry"] == "axisymmetric"
    assert 0 < record["stated_error"]["max_deformation_mm"] < 0.005
    assert set(record["raw"]) >= {"max_deformation_mm", "total_deformation_mm3", "deformation_area_mm2"}


def test_simulate_writes_a_figure_and_a_frame(tmp_path):
    done = run_toolkit("simulate", *PRESS, "--plot", tmp_path / "w.png", "--frame", tmp_path / "frame.png")
    assert done.returncode == 0, done.stderr
    frame = cv2.imread(str(tmp_path / "frame.png"), cv2.IMREAD_UNCHANGED)
    assert frame.shape == (492, 768)
    assert frame.dtype == np.uint8
    assert 20 < frame[246, 384] < 250
    assert frame[246, 5] < frame[246, 384] / 8  # beyond the face only stray light is left
    assert (tmp_path / "w.png").stat().st_size > 10_000


def test_a_long_exposure_saturates_the_frame(tmp_path):
    run_toolkit("simulate", *PRESS, "--frame", tmp_path / "frame.png", "--exposure-us", 40_000)
    assert cv2.imread(str(tmp_path / "frame.png"), cv2.IMREAD_UNCHANGED)[246, 384] == 255


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["simulate", "--size-mm", "15", "--depth-mm", "20", "--modulus-kpa", "80"], "depth_mm + size_mm is 35"),
        (["simulate", "--size-mm", "10", "--depth-mm", "6", "--modulus-kpa", "-3"], "youngs_modulus_kpa is -3"),
        (["simulate", *SCENE, "--indentation-mm", "1", "--force-n", "1"], "exactly one"),
        (["simulate", *SCENE, "--frame", "frame.foo"], "frame.foo"),
        (["simulate", *SCENE, "--plot", "nowhere/w.png"], "nowhere"),
        (["simulate", *SCENE, "--frame", "f.png", "--exposure-us", "-5"], "exposure_us is -5"),
        (["sweep", "--jobs", "0", "--out", "s.nc"], "jobs is 0"),
        (["train", "--data", "missing.nc", "--out", "m"], "missing.nc"),
        (["evaluate", "--model", "missing"], "missing"),
        (["calibrate", "missing", "--out", "c.json"], "recording.json"),
        (["sweep", "--scenes", "0", "--out", "s.nc"], "scenes is 0"),
        (["sweep", "--out", "."], "out is ., but must be a file"),
        (["phantom", "--offset-mm", "500", "--out", "p"], "offset_mm is 500.0, but must be at least -40"),
        (["calibrate", "missing", "--force-n", "nan", "--out", "c.json"], "force_n is nan, but must be above 0"),
        (["evaluate", "--scenes", "0"], "scenes is 0, but must be at least 1"),
        (["evaluate", "missing", "--scenes", "5"], "scenes is 5, but must be left out with recordings"),
        (["sweep", "--within-s", "3", "--out", "s.nc"], "within_s is 3.0, but must be left out without --tolerance"),
        (["phantom", "--scenes", "3", "--out", "p"], "scenes is 3, but must be left out but with --set random"),
        (["phantom", "--grid", "1", "--set", "random", "--out", "p"], "phantoms is --grid and --set"),
        (["phantom", "--grid", "1", "--ramp", "--out", "p"], "a grid is taken as it is"),
        (["phantom", "--pitch-mm", "3", "--out", "p"], "pitch_mm is 3.0, but must be left out without --grid"),
        (["phantom", "--play-mm", "0", "--out", "p"], "play_mm is 0.0, but must be left out without --grid"),
        (["phantom", "--grid", "1", "--camera-of", PROBE_FILE, "--out", "p"], "a grid is taken as it is"),
    ],
)
def test_what_cannot_be_done_is_one_sentence_and_exit_code_1(arguments, words, tmp_path):
    done = run_toolkit(*arguments, cwd=tmp_path)
    assert done.returncode == 1
    assert words in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_refused_export_is_one_sentence_and_exit_code_1(monkeypatch, capsys):
    def refused():
        raise ExportRefused("spread of the exported network differs: train anew.")

    monkeypatch.setattr(command_line, "app", refused)
    with pytest.raises(SystemExit) as ended:
        command_line.main()
    assert ended.value.code == 1
    assert capsys.readouterr().err == "spread of the exported network differs: train anew.\n"


HELP = """
import sys
sys.argv = ["host_tools", "--help"]
from host_tools.__main__ import main
try:
    main()
finally:
    print("loaded:", *{"numpy", "cv2", "ngsolve", "onnxruntime", "joblib", "xarray"} & set(sys.modules))
"""


def test_help_loads_nothing_that_computes():
    done = subprocess.run([sys.executable, "-c", HELP], check=True, capture_output=True, text=True)
    assert "simulate" in done.stdout
    assert done.stdout.splitlines()[-1] == "loaded:"


@pytest.mark.parametrize(
    "arguments", [["simulate", "--size-cm", "1"], ["phantom", "--set", "random", "--seed", "-1", "--out", "p"]]
)
def test_a_wrong_option_is_a_usage_error(arguments, tmp_path):
    assert run_toolkit(*arguments, cwd=tmp_path).returncode == 2


@pytest.mark.parametrize("verb", ["simulate", "sweep", "train", "evaluate", "calibrate", "phantom", "table"])
def test_every_verb_has_help_with_an_example(verb):
    done = run_toolkit(verb, "--help")
    assert done.returncode == 0
    assert f"Example: host_tools {verb}" in done.stdout


@pytest.mark.long
def test_train_from_a_sweep_gives_a_bundle_the_device_accepts(tmp_path):
    """The whole way from scenes to ONNX, small: 70 scenes, 2 networks."""
    assert run_toolkit("sweep", "--scenes", 75, "--seed", 2, "--out", tmp_path / "s.nc").returncode == 0
    done = run_toolkit("train", "--data", tmp_path / "s.nc", "--out", tmp_path / "small", "--trials", 2)
    assert done.returncode == 0, done.stderr
    assert "size_mm" in done.stdout
    # Not those of the small model: nine at random need not pass the gates of a calibration.
    phantoms = run_toolkit("phantom", "--out", tmp_path / "phantoms")
    assert phantoms.returncode == 0, phantoms.stderr
    recordings = sorted((tmp_path / "phantoms").iterdir())
    assert len(recordings) == 9
    out = tmp_path / "calibration.json"
    calibrated = run_toolkit("calibrate", *recordings, "--model", tmp_path / "small", "--out", out)
    assert calibrated.returncode == 0, calibrated.stderr
    assert "R2" in calibrated.stdout
    assert read_calibration(out).validity.expires_at == "2069-12-07T00:00:00Z"
    written = out.read_bytes()
    again = run_toolkit("calibrate", *recordings, "--model", tmp_path / "small", "--out", out)
    assert (again.returncode, out.read_bytes()) == (1, written)
    assert "a certificate is written once" in again.stderr


def test_calibrate_says_which_probe_and_tissue_it_assumes_of_recordings_that_are_not_simulated(recording, tmp_path):
    for is_simulated in (True, False):
        write_recording(replace(recording, simulated=is_simulated), tmp_path / f"{is_simulated}")
        done = run_toolkit("calibrate", tmp_path / f"{is_simulated}", "--out", tmp_path / "c.json")
        assert done.returncode == 1  # one phantom is too few
        assert ("the waveguide of SIM-0001 (--probe)" in done.stderr) != is_simulated
        assert ("tissue of 5 kPa (--phantoms)" in done.stderr) != is_simulated


@pytest.mark.long
def test_calibrate_names_a_certificate_by_its_id_or_prints_all_that_speaks_against_it(tables, tmp_path):
    recordings = []
    for i, (d, h, E) in enumerate([(14, 4.5, 110), (12, 7, 60), (9, 5, 80), (11, 9, 100), (6, 6, 50), (8, 4.5, 90)]):
        one = phantom_recording(
            Inclusion(d, h, E), tables, seed=i, protocol=PhantomProtocol(frames=1), scenario=Scenario(light="linear")
        )
        recordings.append(tmp_path / f"phantom{i}")
        write_recording(one, recordings[-1])
    out = tmp_path / "calibrations"
    done = run_toolkit("calibrate", *recordings, "--out", out, "--operator", "N. N.", "--valid-days", 36000, "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    [path] = out.iterdir()
    assert (record["accepted"], path.name) == (True, f"{record['id']}.json")
    assert all(gate["passes"] for gate in record["gates"])
    assert (read_calibration(path).id, read_calibration(path).operator) == (record["id"], "N. N.")

    rejected = run_toolkit("calibrate", *recordings[:3], "--force-n", 0.6, "--out", tmp_path / "no", "--json")
    assert rejected.returncode == 1
    record = json.loads(rejected.stdout)
    assert [one["quantity"].split(" of ")[0] for one in record["problems"]] == [
        *["mean force"] * 3,
        "calibration's force_n",
        "phantoms",
    ]
    assert record["problems"][-1]["action"] == "record more phantoms"
    assert not (tmp_path / "no").exists()


def test_phantom_records_over_nothing(tmp_path):
    (tmp_path / "phantom3").mkdir()
    done = run_toolkit("phantom", "--out", tmp_path)
    assert done.returncode == 1
    assert "phantom3, but must be a new folder" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["phantom3"]
    (tmp_path / "a file").touch()


@pytest.mark.parametrize(
    "words",
    [("phantom",), ("train", "--mode", "quick"), ("table",), ("optics", "build"), ("calibrate", "x"),
     ("commission", "x", "--probe", "p.toml", "--phantoms", "q.toml")],
    ids=lambda words: words[0],
)  # fmt: skip
def test_a_folder_that_cannot_be_written_is_refused_before_the_work(tmp_path, words):
    (tmp_path / "a file").touch()
    done = run_toolkit(*words, "--out", tmp_path / "a file" / "within")
    assert (done.returncode, done.stdout) == (1, "")
    assert "a file, but must be a folder" in done.stderr


def test_a_page_that_may_not_be_written_is_refused_before_the_work(tmp_path, monkeypatch):
    """Whoever is root may write everywhere: the system's word is put in. A page is renamed into its folder, with
    results beside it; a picture is written over."""
    for name in ("mine", "others", "results"):
        (tmp_path / name / "results").mkdir(parents=True)
    (tmp_path / "mine" / "known.png").touch()
    barred = {tmp_path / "others", tmp_path / "results" / "results", tmp_path / "mine" / "known.png"}
    monkeypatch.setattr(os, "access", lambda path, mode: path not in barred)
    require_writable(tmp_path / "mine" / "new.md", (".md",))
    require_writable_folder(tmp_path / "folder" / "within")
    for path in ("others/page.md", "results/page.md", "mine/known.png"):
        with pytest.raises(InvalidQuantity, match="but must be writable"):
            require_writable(tmp_path / path, (".md", ".png"))


def test_the_first_solve_waits_for_nothing_that_it_does_not_need():
    """What is loaded until a scene is meshed: NumPy and NGSolve, and none of what takes as long as they do."""
    code = (
        "import sys, host_tools.__main__, host_tools.forward.ladder; "
        "print([m for m in ('scipy', 'cv2', 'pydantic', 'xarray', 'matplotlib', 'pandas') if m in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def _interrupted(arguments, loaded):
    """Start a verb and interrupt it as soon as it has loaded a module; return it ended, with what else it told."""
    command = [sys.executable, "-X", "importtime", "-m", "host_tools", *arguments]
    told = []
    with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True, preexec_fn=hear_interrupts) as running:
        for line in running.stderr:
            told.append(line)
            if line.rpartition("|")[2].strip() == loaded:
                running.send_signal(signal.SIGINT)
    return running.returncode, "".join(line for line in told if not line.startswith("import time:"))


def hear_interrupts():
    """A shell's background job ignores SIGINT, and so would all that it starts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.parametrize("loaded", ["rich.console", "numpy.exceptions", "ngsolve.ngslib"])
def test_an_interrupt_while_modules_are_loaded_leaves_no_traceback(loaded):
    """The first second of a verb is imports; 130 is a shell's word for -2, the interrupt itself."""
    code, told = _interrupted(["simulate", *map(str, SCENE)], loaded)
    assert code in (-signal.SIGINT, 130, 1)
    assert "Traceback" not in told
    assert len(told.split()) < 5  # "Aborted." at most
