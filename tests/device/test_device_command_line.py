"""`python -m device` as typed: exit codes, one line a fault on stderr, and JSON on stdout."""

import dataclasses
import json
import shutil
import socket
import subprocess
import sys

import pytest
from daemon_process import ROOT

from device import __version__
from device.__main__ import VERBS, main
from device.commands import analyse
from device.commands import serve as serving
from device.files.plain_settings import LAST_GOOD
from device.files.recording_file import write_recording
from device.measurement.paper_mode.estimate import estimate_paper
from device.web.events import snapshot


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """Run a command line in an empty folder; return its exit code and the lines of stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def run_line(*arguments):
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as usage:
            code = usage.code
        captured = capsys.readouterr()
        return code, captured.out.splitlines(), captured.err.splitlines()

    return run_line


@pytest.fixture
def models(tmp_path):
    """A configuration that points at a copy of the committed models."""
    shutil.copytree(ROOT / "models", tmp_path / "models")
    (tmp_path / "probe.toml").write_text(
        'serial = "SIM-0001"\npaper_model = "models/paper"\ncalibration = "models/simulated_probe/calibration.json"\n'
        'data = "var"\n'
    )
    return tmp_path / "models"


@pytest.fixture
def started(monkeypatch):
    """Statuses of the daemons that have started; each ends where it would begin to serve."""
    statuses = []
    monkeypatch.setattr(serving, "_run_server", lambda procedure, *_: statuses.append(snapshot(procedure)))
    return statuses


@pytest.fixture
def folder(recording, tmp_path):
    write_recording(recording, tmp_path / "press")
    return tmp_path / "press"


@pytest.mark.parametrize(
    "line", ["faults", "config show", "config check", "led-off", "--help", "backup --help", "led-off --help"]
)
def test_what_needs_no_measuring_loads_nothing_that_measures(line, tmp_path):
    """Libraries are nine tenths of the time of a short verb, and of how long a probe stays lit after `led-off`."""
    program = (
        "import sys; from device.__main__ import main\n"
        "try: main(sys.argv[1:])\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'cv2', 'onnxruntime', 'scipy', 'fastapi', 'uvicorn', 'starlette'} & set(sys.modules)\n"
        "sys.exit(' '.join(heavy) or 0)"
    )
    command = [sys.executable, "-c", program, "--root", str(tmp_path), *line.split()]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout or line == "led-off"


def test_a_library_computes_on_one_thread_also_in_the_cameras_process(run, monkeypatch):
    for name in ("OPENCV_FOR_THREADS_NUM", "OPENBLAS_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    run("faults")
    program = "import cv2; print(cv2.getNumThreads())"
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert told.split() == ["1"]


def test_an_unknown_verb_is_refused_with_those_there_are(run):
    code, _, errors = run("fautls")
    assert code == 2
    assert " faults," in errors[-1].replace("'", "")  # with quotes until Python 3.12


def test_a_port_in_use_is_one_sentence_with_the_port_before_anything_is_opened(run, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        code, _, errors = run("--simulate", "--port", port)
    assert code == 1
    [line] = errors
    assert f"Port {port} of 127.0.0.1 cannot be used" in line
    assert "--port" in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (None, "scene.toml, but must be readable"),
        ("[inclusion]\nsize_cm = 1.0\n", "did you mean inclusion.size_mm"),
        ("[inclusion]\nsize_mm = -1\ndepth_mm = 5\nyoungs_modulus_kpa = 80\n", "size_mm is -1"),
        ("[inclusion]\nsize_mm = 1\ndepth_mm = 5\n", "inclusion.youngs_modulus_kpa is missing"),
    ],
)
def test_a_scene_that_cannot_be_used_is_one_sentence(run, tmp_path, scene, words):
    if scene:
        (tmp_path / "scene.toml").write_text(scene)
    code, _, errors = run("--simulate", "--port", 0, "--scene", "scene.toml")
    assert code == 1
    [line] = errors
    assert words in line


def test_a_port_that_cannot_be_is_one_sentence(run):
    code, _, [line] = run("--simulate", "--port", 65_536)
    assert code == 1
    assert line.startswith("server.port is 65536, but must be at least 0 and at most 65535")


def test_an_inclusion_outside_the_table_is_one_sentence(run, tmp_path):
    (tmp_path / "scene.toml").write_text("[inclusion]\nsize_mm = 50\ndepth_mm = 5\nyoungs_modulus_kpa = 80\n")
    code, _, errors = run("--simulate", "--port", 0, "--scene", "scene.toml")
    assert code == 1
    [line] = errors
    assert "size_mm is 50" in line


def test_a_setting_out_of_its_bound_is_one_sentence_with_file_and_setting(run, tmp_path):
    (tmp_path / "probe.toml").write_text("[press]\ntarget_n = 99\n")
    code, _, errors = run("--root", ".", "--config", "probe.toml")
    assert code == 1
    [line] = errors
    assert line.startswith("probe.toml: press.target_n is 99")


def test_a_tampered_model_keeps_the_simulated_probe_from_starting(run, models):
    with (models / "paper" / "model.onnx").open("ab") as network:
        network.write(b"!")
    code, _, errors = run("--simulate", "--port", 0, "--config", "probe.toml")
    assert code == 1
    [line] = errors
    assert line.startswith("E401 ")
    assert "sha256 of model.onnx" in line


def test_a_certificate_of_another_probe_keeps_the_probe_from_starting(run, models, tmp_path):
    settings = (tmp_path / "probe.toml").read_text().replace("calibration.json", "calibration_linear.json")
    (tmp_path / "probe.toml").write_text(settings)
    code, _, errors = run("--simulate", "--port", 0, "--config", "probe.toml")
    assert code == 1
    [line] = errors
    assert line.startswith("E403 ")
    assert "for probe SIM-LINEAR, but must be for probe SIM-0001" in line


def test_the_settings_of_a_scene_lie_over_the_probes_own_and_below_the_command_line(run, models, started, tmp_path):
    (tmp_path / "scene.toml").write_text("[settings.press]\ntarget_n = 0.51\n[settings.server]\nport = 1\n")
    assert run("--simulate", "--port", 0, "--config", "probe.toml", "--scene", "scene.toml")[0] == 0
    assert [status["target_n"] for status in started] == [0.51]


def test_a_scene_with_a_setting_that_there_is_not_is_refused(run, tmp_path):
    (tmp_path / "scene.toml").write_text("[settings.light]\nmax_on = 1.0\n")
    code, _, [line] = run("--simulate", "--port", 0, "--scene", "scene.toml")
    assert code == 1
    assert "did you mean light.max_on_s" in line


def test_the_settings_of_another_probe_are_refused_for_the_simulated_one(run, models, tmp_path):
    settings = (tmp_path / "probe.toml").read_text().replace("SIM-0001", "SIM-0002")
    (tmp_path / "probe.toml").write_text(settings)
    code, _, errors = run("--simulate", "--port", 0, "--config", "probe.toml")
    assert code == 1
    assert errors == [
        "E001 serial is SIM-0002, but the simulated probe with physical light is SIM-0001. "
        "Correct the setting, and its calibration with it."
    ]


def test_a_real_probe_lists_every_part_that_failed_at_once(run, models, tmp_path):
    """No camera, no LED chip, no load cell on this machine, and the model is gone, too."""
    (models / "paper" / "model.json").unlink()
    (tmp_path / "probe.toml").write_text(
        (tmp_path / "probe.toml").read_text()
        + f'[light]\nbus = 97\n[camera]\nindex = 97\n[cell]\ndevice = "{tmp_path}/none"\n'
    )
    code, _, errors = run("--root", ".", "--config", "probe.toml", "--port", 0)
    assert code == 1
    assert sorted(line.split()[0] for line in errors) == ["E101", "E201", "E304", "E401"]
    assert any("bus 97" in line for line in errors)
    assert any(f"{tmp_path}/none" in line for line in errors)


def made_by(recording):
    told = {"serial": recording.serial, "taken_at": recording.started_at, "software": recording.software}
    return told | {"recording_id": recording.id, "answered_by": __version__, "certificate_held": True}


def test_analyse_prints_each_estimate_as_one_line_of_json(run, folder, recording, bundle, calibration):
    code, out, errors = run("analyse", folder, folder)
    assert (code, errors) == (0, [])
    expected = json.loads(json.dumps(estimate_paper(recording, bundle, calibration).as_record())) | made_by(recording)
    assert [json.loads(line) for line in out] == [{"recording": str(folder), **expected}] * 2


def test_analyse_tells_which_recording_is_refused_and_answers_the_others(run, folder, tmp_path):
    code, out, errors = run("analyse", tmp_path / "none.zip", folder)
    assert [json.loads(line)["recording"] for line in out] == [str(folder)]
    assert (code, len(errors)) == (1, 1)
    assert errors[0].startswith(f"{tmp_path / 'none.zip'}: recording is")


def test_analyse_reads_a_zip_as_it_reads_a_folder(run, folder, tmp_path):
    shutil.make_archive(str(tmp_path / "press"), "zip", tmp_path, "press")
    _, [from_folder], _ = run("analyse", folder)
    _, [from_zip], _ = run("analyse", tmp_path / "press.zip")
    assert json.loads(from_zip)["size_mm"] == json.loads(from_folder)["size_mm"]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda folder: shutil.rmtree(folder), "recording is"),
        (lambda folder: (folder / "frames/000.png").unlink(), "frames[0].file is"),
    ],
)
def test_analyse_says_in_one_sentence_what_is_wrong_with_a_recording(run, folder, spoil, words):
    spoil(folder)
    code, out, errors = run("analyse", folder)
    assert (code, out) == (1, [])
    [line] = errors
    assert words in line


def test_analyse_refuses_a_tampered_model(run, folder, models):
    with (models / "paper" / "model.onnx").open("ab") as network:
        network.write(b"!")
    code, out, errors = run("--config", "probe.toml", "analyse", folder)
    assert (code, out) == (1, [])
    assert "sha256 of model.onnx" in errors[0]


@pytest.mark.parametrize("setting", ["standard_model", "quick_model"])
def test_analyse_refuses_a_model_that_is_named_and_not_there_once_and_by_its_setting(run, folder, models, setting):
    with (models.parent / "probe.toml").open("a") as settings:
        settings.write(f'{setting} = "models/typo"\n')
    code, out, errors = run("--config", "probe.toml", "analyse", folder, folder)
    assert (code, out) == (1, [])
    [line] = errors
    assert line.startswith(f"{setting} is models/typo, but must be a folder with a model of mode ")


@pytest.mark.parametrize(
    "arguments",
    [("--nonsense",), ("analyse",), ("--port", "eight"), ("--scene", "scene.toml"), ("measure", "press")],
)
def test_wrong_usage_is_exit_code_2_with_the_usage(run, arguments):
    code, out, errors = run(*arguments)
    assert (code, out) == (2, [])
    assert errors[0].startswith("usage: python -m device")


def test_help_has_an_example(run):
    code, out, _ = run("--help")
    assert code == 0
    assert any("python -m device --simulate --port 8000" in line for line in out)


def test_a_target_force_that_the_certificate_is_not_for_keeps_the_probe_from_starting(run, models, tmp_path):
    with (tmp_path / "probe.toml").open("a") as settings:
        settings.write("[press]\ntarget_n = 0.7\n")
    code, _, errors = run("--simulate", "--port", 0, "--config", "probe.toml")
    assert code == 1
    [line] = errors
    assert line.startswith("E403 press.target_n is 0.7, but must be 0.5 N as calibrated")


def test_a_camera_of_other_bits_than_the_settings_say_is_refused(run, models, tmp_path):
    (tmp_path / "scene.toml").write_text("[sensor]\nbits = 10\n")
    code, _, errors = run("--simulate", "--port", 0, "--config", "probe.toml", "--scene", "scene.toml")
    assert code == 1
    assert errors == ["E001 The scene's sensor.bits is 10, but camera.raw_format is R8. Correct one of them."]


def test_with_bad_settings_the_probe_starts_on_its_last_good_ones_and_warns(run, models, started, tmp_path):
    good = (tmp_path / "probe.toml").read_text() + "[press]\ntarget_n = 0.51\n"
    for settings in (good, good.replace("0.51", "99"), good):
        (tmp_path / "probe.toml").write_text(settings)
        assert run("--simulate", "--port", 0, "--config", "probe.toml")[0] == 0
    assert [[fault["code"] for fault in status["faults"]] for status in started] == [[], ["E002"], []]
    assert [status["target_n"] for status in started] == [0.51] * 3
    assert started[1]["faults"][0]["severity"] == "warning"
    assert "press.target_n in probe.toml" in started[1]["faults"][0]["cause"]


def test_settings_with_which_the_probe_did_not_start_are_not_kept_as_good(run, models, started, tmp_path):
    (models / "paper" / "model.json").unlink()
    assert run("--simulate", "--port", 0, "--config", "probe.toml")[0] == 1
    assert not (tmp_path / "var" / LAST_GOOD).exists()


def test_a_probe_without_its_load_cell_is_served_at_fault_and_its_settings_are_not_kept_as_good(
    run, models, started, tmp_path
):
    """`cell.device` may be what is wrong."""
    (tmp_path / "scene.toml").write_text('[[faults]]\nkind = "cell_unplugged"\n')
    assert run("--simulate", "--port", 0, "--config", "probe.toml", "--scene", "scene.toml")[0] == 0
    assert [[fault["code"] for fault in status["faults"]] for status in started] == [["E304"]]
    assert not (tmp_path / "var" / LAST_GOOD).exists()


def test_without_a_settings_file_the_simulated_probe_keeps_none(run, started, tmp_path):
    assert run("--simulate", "--port", 0)[0] == 0
    assert not (tmp_path / "var" / LAST_GOOD).exists()


def test_a_probe_that_was_never_calibrated_starts(run, models, started, tmp_path):
    (tmp_path / "calibrations").mkdir()
    settings = (tmp_path / "probe.toml").read_text().replace(
        "models/simulated_probe/calibration.json", "calibrations"
    )  # fmt: skip
    (tmp_path / "probe.toml").write_text(settings)
    assert run("--simulate", "--port", 0, "--config", "probe.toml")[0] == 0
    assert len(started) == 1


def test_an_unknown_certificate_is_refused_at_the_start_beside_all_else(run, models, tmp_path):
    (models / "quick" / "model.json").write_text("{")
    settings = (tmp_path / "probe.toml").read_text().replace("calibration.json", "none.json")
    settings += 'quick_model = "models/quick"\n'
    (tmp_path / "probe.toml").write_text(settings + "[cell]\ncommissioned_tare_counts = 0\ntare_drift_n = 0.01\n")
    code, _, errors = run("--simulate", "--port", 0, "--config", "probe.toml")
    assert code == 1
    assert sorted(line.split()[0] for line in errors) == ["E306", "E401", "E402"]
    assert any("none.json" in line for line in errors)


def test_analyse_refuses_a_recording_from_after_the_certificate(run, recording, tmp_path):
    write_recording(dataclasses.replace(recording, started_at="2070-01-01T00:00:00Z"), tmp_path / "late")
    code, out, errors = run("analyse", tmp_path / "late")
    assert (code, out) == (1, [])
    assert "2070-01-01T00:00:00Z, but must be not after 2069-12-07T" in errors[0]
    assert (
        "name certificate and models of that time in --config FILE (calibration, standard_model, quick_model)"
        in errors[0]
    )


def test_analyse_names_both_times_of_a_recording_from_before_the_certificate(run, recording, tmp_path):
    """A clock that is set now helps no recording, and both may be of one day."""
    write_recording(dataclasses.replace(recording, started_at="1969-12-31T09:24:31Z"), tmp_path / "early")
    code, out, errors = run("analyse", tmp_path / "early")
    assert (code, out) == (1, [])
    assert "1969-12-31T09:24:31Z, but must be not before 1970-01-01T" in errors[0]
    assert "measured_at of certificate" in errors[0]
    assert "clock" not in errors[0]


def test_analyse_answers_outside_the_certificates_time_where_it_is_told_to_and_says_so(
    run, recording, folder, tmp_path
):
    write_recording(dataclasses.replace(recording, started_at="1969-12-31T09:24:31Z"), tmp_path / "early")
    code, out, errors = run("analyse", "--any-time", tmp_path / "early", folder)
    assert (code, errors) == (0, [])
    early, within = (json.loads(line) for line in out)
    assert [early["certificate_held"], within["certificate_held"]] == [False, True]
    assert early["size_mm"] == within["size_mm"]


def test_analyse_refuses_a_recording_of_another_probe_than_the_certificates(run, recording, models, tmp_path):
    write_recording(dataclasses.replace(recording, serial="TSIS-0007"), tmp_path / "foreign")
    code, out, errors = run("--config", "probe.toml", "analyse", tmp_path / "foreign")
    assert (code, out) == (1, [])
    assert "for probe SIM-0001, but must be for probe TSIS-0007" in errors[0]


def written_settings(root, serial, certificate):
    """Write the two layers of a probe's settings below a root."""
    (root / "etc/tsis/config.d").mkdir(parents=True)
    (root / "etc/tsis/config.toml").write_text(f'serial = "{serial}"\ncalibration = "/srv/none.json"\n')
    (root / "etc/tsis/config.d/own.toml").write_text(f'calibration = "{certificate}"\n')


def test_analyse_reads_the_settings_of_the_probe_that_made_the_recording(run, recording, calibration, bundle, tmp_path):
    own = dataclasses.replace(recording, serial="TSIS-0007", simulated=False)
    write_recording(own, tmp_path / "own")
    certificate = dataclasses.replace(calibration, id="own", serial="TSIS-0007")
    (tmp_path / "own.json").write_text(certificate.to_json())
    written_settings(tmp_path, "TSIS-0007", tmp_path / "own.json")
    code, [line], errors = run("--root", tmp_path, "analyse", tmp_path / "own")
    assert (code, errors) == (0, [])
    expected = json.loads(json.dumps(estimate_paper(own, bundle, certificate).as_record())) | made_by(own)
    assert json.loads(line) == {"recording": str(tmp_path / "own"), **expected}


def test_analyse_asks_once_whether_what_a_file_names_is_there(run, folder, models, monkeypatch):
    asked = []
    monkeypatch.setattr(analyse, "require_named_folders", asked.append)
    assert run("--config", "probe.toml", "analyse", folder, folder)[0] == 0
    assert [config.serial for config in asked] == ["SIM-0001"]


def test_analyse_refuses_a_model_that_the_machines_settings_name_and_is_not_there(run, recording, tmp_path):
    write_recording(dataclasses.replace(recording, serial="TSIS-0007", simulated=False), tmp_path / "own")
    written_settings(tmp_path, "TSIS-0007", tmp_path / "own.json")
    (tmp_path / "etc/tsis/config.d/model.toml").write_text('quick_model = "/srv/typo"\n')
    code, out, [line] = run("--root", tmp_path, "analyse", tmp_path / "own")
    assert (code, out) == (1, [])
    assert "quick_model is /srv/typo, but must be a folder with a model of mode quick" in line


@pytest.mark.parametrize(
    ("settings_of", "words"),
    [
        (None, "serial of the recording is TSIS-0007, but must be SIM-0001 or SIM-LINEAR where no settings"),
        ("TSIS-0008", "serial of the recording is TSIS-0007, but must be TSIS-0008 as in this machine's settings"),
    ],
)
def test_analyse_without_the_probes_settings_asks_for_them(run, recording, tmp_path, settings_of, words):
    write_recording(dataclasses.replace(recording, serial="TSIS-0007", simulated=False), tmp_path / "foreign")
    if settings_of:
        written_settings(tmp_path, settings_of, "/srv/calibration.json")
    code, out, errors = run("--root", tmp_path, "analyse", tmp_path / "foreign")
    assert (code, out) == (1, [])
    assert words in errors[0]
    assert "--config FILE" in errors[0]


def test_analyse_tells_what_is_wrong_with_the_probes_settings(run, recording, tmp_path):
    write_recording(dataclasses.replace(recording, serial="TSIS-0007", simulated=False), tmp_path / "own")
    written_settings(tmp_path, "TSIS-0007", tmp_path / "own.json")
    (tmp_path / "etc/tsis/config.d/own.toml").write_text("[press]\nmode = 3\n")
    code, out, errors = run("--root", tmp_path, "analyse", tmp_path / "own")
    assert (code, out) == (1, [])
    assert any("own.toml: press.mode is 3" in line for line in errors)


def test_every_verb_stands_in_the_help_and_has_its_own(run):
    code, out, _ = run("--help")
    assert code == 0
    listed = {line.split()[0] for line in out if line.startswith("    ") and line.split()}
    assert set(VERBS) <= listed
    for verb in VERBS:
        code, out, _ = run(verb, "--help")
        assert code == 0
        assert out[0].startswith(f"usage: python -m device {verb}")
