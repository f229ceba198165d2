"""`python -m device record` of the virtual probe, as typed, without certificate or model: a folder that calibrates."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from daemon_process import QUICK_HAND, ROOT
from simulated_time_probe import simulate_time

from device.__main__ import main
from device.files.recording_file import read_recording
from device.instrument.press.frame_choice import ramp_targets_n
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.radial_profile import press_profiles
from device.measurement.recording.recording import RecordedCell
from host_tools.calibration.camera_fit import GridPrint, camera_of
from host_tools.calibration.gates import unusable, zero_gates

PHANTOM = ("--size-mm", "10", "--depth-mm", "6", "--modulus-kpa", "80")
OUT = Path("phantoms/1")
NEW_PROBE = 'serial = "SIM-0001"\ncalibration = "calibrations"\npaper_model = "none"\ndata = "var"\n'


@pytest.fixture(autouse=True)
def new_probe(tmp_path, monkeypatch):
    """Settings whose folder of certificates is empty and whose model is not there, in the current folder."""
    (tmp_path / "calibrations").mkdir()
    (tmp_path / "probe.toml").write_text(NEW_PROBE)
    monkeypatch.chdir(tmp_path)


def command(*arguments, scene=""):
    Path("scene.toml").write_text(QUICK_HAND + scene)
    return ["--config", "probe.toml", "record", "--simulate", "--scene", "scene.toml", *arguments]


@pytest.fixture
def run(capsys, monkeypatch):
    """Run a command line in simulated time; return its exit code and the lines of stdout and stderr."""
    simulate_time(monkeypatch)

    def run_line(arguments):
        try:
            code = main(arguments)
        except SystemExit as usage:
            code = usage.code
        captured = capsys.readouterr()
        return code, captured.out.splitlines(), captured.err.splitlines()

    return run_line


def test_a_probe_that_was_never_calibrated_records_a_phantom_once(run):
    arguments = command(*PHANTOM, "--phantom-serial", "PH-3", "--out", str(OUT))
    code, out, told = run(arguments)
    assert (code, out) == (0, [str(OUT)]), told
    steps = ["Keep the probe free", "Press beside the lesion", "Lift the probe", "Press on the lesion", "Done"]
    assert [line for line in told if line in steps] == steps

    recording = read_recording(OUT)
    assert unusable([recording], force_n=0.5) == []
    assert [gate.problem for gate in zero_gates(recording)] == [None, None]
    assert (recording.truth, recording.phantom_serial) == (Inclusion(10.0, 6.0, 80.0), "PH-3")
    assert (recording.serial, recording.simulated, recording.calibration_id) == ("SIM-0001", True, None)
    assert recording.cell == RecordedCell(100_000.0, 8_200.0)
    assert [len(recording.with_role(role)) for role in ("dark", "reference", "press")] == [4, 4 + 10, 10]
    assert list(OUT.parent.iterdir()) == [OUT]

    before = (OUT / "recording.json").stat().st_mtime_ns
    code, out, [refusal] = run(arguments)  # nobody is told to keep the probe free: nothing is opened
    assert (code, out) == (1, [])
    assert refusal == f"out is {OUT}, but must be a new folder: a recording is never replaced: give another name."
    assert (OUT / "recording.json").stat().st_mtime_ns == before


def test_a_grid_target_is_recorded_in_oil_and_tells_the_camera(run):
    """No light comes with the force there, which on skin is refused as gel."""
    camera = "\n[world.camera]\nscale_x_ratio = 1.008\naxis_x_mm = 0.3\nrim_distortion_percent = -1.5\n"
    code, out, told = run(command("--grid", "--out", str(OUT), scene=camera))
    assert (code, out) == (0, [str(OUT)]), told
    recording = read_recording(OUT)
    assert (recording.truth, recording.simulated) == (None, True)
    found = camera_of({"grid": recording}, GridPrint(play_mm=1e-4)).geometry
    assert found.scale.mm_per_px_x == pytest.approx(1.008 * 0.03125, rel=1e-3)
    assert (found.axis_x_mm, found.axis_y_mm) == pytest.approx((0.3, 0.0), abs=2e-3)
    assert found.rim_distortion_percent == pytest.approx(-1.5, abs=0.05)


def test_a_block_without_an_inclusion_is_recorded_without_truth(run):
    code, _, told = run(command("--bare", "--phantom-serial", "PH-3", "--out", str(OUT)))
    assert code == 0, told
    recording = read_recording(OUT)
    assert (recording.truth, recording.phantom_serial) == (None, "PH-3")
    assert [len(recording.with_role(role)) for role in ("dark", "reference", "press")] == [4, 4 + 10, 10]


def tissue(modulus_kpa=5.5, thickness_mm=32.0):
    return f"tissue_modulus_kpa = {modulus_kpa}\ntissue_thickness_mm = {thickness_mm}\n"


def write_phantoms(inclusion="size_mm = 10.0\ndepth_mm = 6\nyoungs_modulus_kpa = 80.0\n"):
    block = f'[[phantoms]]\nname = "B1"\n{tissue()}'
    Path("phantoms.toml").write_text(f'serial = "PH-7"\n[[phantoms]]\nname = "A1"\n{tissue()}{inclusion}{block}')


OF_FILE = ("--phantoms", "phantoms.toml")


@pytest.mark.parametrize(("name", "truth"), [("A1", Inclusion(10.0, 6.0, 80.0)), ("B1", None)])
def test_a_phantom_of_a_file_is_recorded_under_its_name_by_the_ramp_that_commissioning_reads(run, name, truth):
    write_phantoms()
    code, out, told = run(command(*OF_FILE, "--name", name))
    assert (code, out) == (0, [f"ramps/{name}"]), told
    assert told[0].startswith(f"Phantom {name} of PH-7: ")
    recording = read_recording(Path("ramps") / name)
    assert (recording.truth, recording.phantom_serial) == (truth, "PH-7")
    [profile] = press_profiles(recording)
    assert profile.contrast[:, 0].max() > 0.05 or truth is None
    forces_n = [frame.force_n for frame in recording.with_role("press")]
    assert forces_n == pytest.approx(ramp_targets_n(10, "press"), abs=0.04)


@pytest.mark.parametrize(
    ("stated", "refusal"),
    [
        (tissue(39.0), "tissue_modulus_kpa of B3 is 39.0, but must be at least 2 and at most 30 kPa: "),
        (tissue(5.0, 3.2), "tissue_thickness_mm of B3 is 3.2, but must be at least 15 and at most 60 mm: "),
        (
            tissue() + "size_mm = 0.5784\ndepth_mm = 6\nyoungs_modulus_kpa = 80.0\n",
            "size_mm of B3 is 0.5784, but must be at least 2 and at most 15 mm: look for a digit or a unit",
        ),
    ],
)
def test_a_phantom_beyond_what_commissioning_knows_is_refused_before_it_is_pressed(run, stated, refusal):
    """As by a wrong unit: corrected after the press, file and recording contradict each other."""
    Path("phantoms.toml").write_text(f'serial = "PH-7"\n[[phantoms]]\nname = "B3"\n{stated}')
    code, out, told = run(command(*OF_FILE, "--name", "B3"))
    assert (code, out) == (1, [])
    assert told[-1].startswith(refusal)
    assert not Path("var").exists()


@pytest.mark.parametrize(
    ("inclusion", "arguments", "refusal"),
    [
        ("", ("--name", "C4"), "name is 'C4', but must be a phantom of phantoms.toml: A1, B1: name one of these"),
        ("", ("--name", "../A1"), "name is '../A1', but must be a folder's name: without"),
        ("size_mm = 9.0\n", ("--name", "A1"), "depth_mm of A1 is missing"),
        ("", ("--name", "A1", "--out", "ramps/1"), "out is ramps/1, but must be a folder named A1"),
    ],
)
def test_a_phantom_that_the_file_does_not_tell_is_refused_before_anything_is_opened(run, inclusion, arguments, refusal):
    write_phantoms(inclusion)
    code, out, told = run(command(*OF_FILE, *arguments))
    assert (code, out) == (1, [])
    assert told[-1].startswith(refusal)
    assert not Path("var").exists()


@pytest.mark.parametrize(
    ("arguments", "refusal"),
    [
        (PHANTOM[:4], "give --size-mm, --depth-mm and --modulus-kpa, or --bare, or --grid"),
        (("--phantoms", "phantoms.toml"), "give --phantoms and --name together"),
        (("--phantoms", "phantoms.toml", "--name", "A1", "--bare"), "give nothing else of it"),
        ((*PHANTOM, "--name", "A1"), "give nothing else of it"),
        ((*PHANTOM, "--bare"), "with --bare or --grid there is no --size-mm"),
        (("--grid", "--size-mm", "10"), "with --bare or --grid there is no --size-mm"),
        (("--grid", "--bare"), "not allowed with argument"),
    ],
)
def test_what_is_pressed_is_told_whole_before_anything_is_opened(run, arguments, refusal):
    code, out, told = run(command(*arguments, "--out", str(OUT)))
    assert (code, out) == (2, [])
    assert refusal in told[-1]


def test_a_fault_ends_the_press_with_its_code_and_leaves_nothing(run):
    dead = '[[faults]]\nkind = "led_dead"\nside = "+x"\nfrom_press = 1\n'
    code, out, told = run(command(*PHANTOM, "--out", str(OUT), scene=dead))
    assert (code, out) == (1, [])
    assert told[-2] == "The probe has a fault"
    assert told[-1].startswith("E203 ")
    assert list(OUT.parent.iterdir()) == []


def test_ctrl_c_cancels_the_press_and_leaves_nothing():
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    arguments = command(*PHANTOM, "--out", str(OUT))
    with subprocess.Popen(
        [sys.executable, "-m", "device", *arguments], env=environment, stderr=subprocess.PIPE, text=True
    ) as process:
        told = []
        for line in process.stderr:
            told.append(line.rstrip())
            if told[-1] == "Press beside the lesion":
                process.send_signal(signal.SIGINT)
    assert process.returncode == 1
    assert told[-2:] == ["Press rejected", "Cancelled by the operator."]
    assert list(OUT.parent.iterdir()) == []


def test_a_real_probe_lists_every_part_that_failed_and_asks_for_no_model(run, tmp_path):
    parts = f'[light]\nbus = 97\n[camera]\nindex = 97\n[cell]\ndevice = "{tmp_path}/none"\n'
    Path("probe.toml").write_text(NEW_PROBE + parts)
    code, out, told = run(["--root", ".", "--config", "probe.toml", "record", *PHANTOM, "--out", str(OUT)])
    assert (code, out) == (1, [])
    assert sorted(line.split()[0] for line in told if line.startswith("E")) == ["E101", "E201", "E304"]


def test_a_phantom_that_cannot_be_is_refused_before_anything_is_opened(run):
    code, out, [refusal] = run(command(*PHANTOM, "--size-mm", "-1", "--out", str(OUT)))
    assert (code, out) == (1, [])
    assert refusal.startswith("size_mm is -1")
    assert not Path("var").exists()


def test_a_folder_that_cannot_be_made_is_refused_before_anything_is_opened(run):
    code, out, [refusal] = run(command(*PHANTOM, "--out", "scene.toml/1"))
    assert (code, out) == (1, [])
    assert refusal.startswith("E601 scene.toml cannot be made")
    assert not Path("var").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["record", *PHANTOM],
        ["record", *PHANTOM[:4], "--out", "1"],
        ["record", *PHANTOM, "--out", "1", "--mode", "slow"],
        ["record", *PHANTOM, "--out", "1", "--scene", "scene.toml"],
    ],
)
def test_wrong_usage_is_exit_code_2(run, arguments):
    code, out, told = run(arguments)
    assert (code, out) == (2, [])
    assert told[0].startswith("usage: python -m device")


def test_a_supply_that_is_too_low_is_told_and_the_recording_stands(run, caplog):
    """A certificate that is made of it would be of a weak supply."""
    low = '[[faults]]\nkind = "undervoltage"\nfrom_press = 1\n'
    code, out, _ = run(command(*PHANTOM, "--out", str(OUT), scene=low))
    assert (code, out) == (0, [str(OUT)])
    assert [record for record in caplog.messages if record.startswith("E015 ")]
