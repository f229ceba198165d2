"""`python -m device calibration` as typed, on a folder of the simulated probe's certificates."""

import json
import shutil
from dataclasses import replace

import pytest
from daemon_process import ROOT
from small_certificate import small_certificate

from device.__main__ import main
from device.files.certificate_file import read_calibration
from device.measurement.calibration import Validity, certificate_id

OWN = read_calibration(ROOT / "models" / "simulated_probe" / "calibration.json")
FOREIGN = small_certificate()


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "calibrations"
    folder.mkdir()
    for certificate in (OWN, FOREIGN):
        (folder / f"{certificate.id}.json").write_text(certificate.to_json())
    (tmp_path / "probe.toml").write_text('serial = "SIM-0001"\ncalibration = "calibrations"\ndata = "var"\n')
    return folder


@pytest.fixture
def run(capsys, tmp_path, folder, monkeypatch):
    """Run `calibration ...` beside the folder; return its exit code and the lines of stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def run_line(*arguments):
        code = main(["--root", ".", "--config", "probe.toml", "calibration", *arguments])
        captured = capsys.readouterr()
        return code, captured.out.splitlines(), captured.err.splitlines()

    return run_line


def test_every_certificate_is_listed_and_none_is_active_at_first(run):
    code, lines, _ = run("list")
    assert code == 0
    assert sorted(lines) == sorted(
        [
            f"  {OWN.id}  SIM-0001, until {OWN.validity.expires_at}",
            f"  {FOREIGN.id}  TSIS-0007, until 2027-01-02T03:04:05Z",
        ]
    )


def test_an_activated_certificate_is_marked(run):
    assert run("activate", OWN.id) == (0, [f"{OWN.id} is active from the next start of the daemon on."], [])
    assert [line.split()[1] for line in run("list")[1] if line.startswith("*")] == [OWN.id]


def test_the_list_is_data_for_a_program(run, folder):
    run("activate", OWN.id)
    (folder / "torn.json").write_text("{")
    found = json.loads(run("list", "--json")[1][0])
    assert found["active"] == OWN.id
    listed = {one["id"]: one for one in found["calibrations"]}
    assert listed[OWN.id]["is_active"]
    assert not listed[FOREIGN.id]["is_active"]
    assert "readable certificate" in listed["torn"]["problem"]


def test_the_active_certificate_is_shown_without_its_thousand_scenes(run):
    run("activate", OWN.id)
    record = json.loads(run("show", "--json")[1][0])
    assert (record["id"], record["serial"]) == (OWN.id, "SIM-0001")
    assert "held_out" not in record
    assert any(line.split() == ["serial", "TSIS-0007"] for line in run("show", FOREIGN.id)[1])


def test_without_an_active_certificate_there_is_none_to_show(run):
    code, lines, [error] = run("show")
    assert (code, lines) == (1, [])
    assert "No certificate is active" in error


def test_a_certificate_of_another_probe_is_not_activated(run, folder):
    code, lines, [error] = run("activate", FOREIGN.id)
    assert (code, lines) == (1, [])
    assert "for probe TSIS-0007, but must be for probe SIM-0001" in error
    assert not (folder / "active").exists()


def test_an_expired_certificate_is_not_activated(run, folder):
    past = replace(OWN, validity=Validity("1970-01-01T00:00:00Z", "1971-01-01T00:00:00Z"))
    expired = replace(past, id=certificate_id(past))
    (folder / f"{expired.id}.json").write_text(expired.to_json())
    code, _, [error] = run("activate", expired.id)
    assert code == 1
    assert "has expired on 1971-01-01" in error
    assert not (folder / "active").exists()


def test_an_empty_folder_is_said_to_be_empty(run, folder):
    shutil.rmtree(folder)
    folder.mkdir()
    assert run("list") == (0, ["There is no certificate in calibrations."], [])


@pytest.mark.parametrize("arguments", [(), ("activate",), ("remove", "x")])
def test_wrong_usage_is_exit_code_2(run, arguments):
    with pytest.raises(SystemExit) as usage:
        run(*arguments)
    assert usage.value.code == 2
