"""The support file says what a maintainer needs, has no patients' data wherever they may stand, and always comes."""

from __future__ import annotations

import json
import os
import shutil
import stat
import subprocess
import sys
import threading
import time
import zipfile
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest
from daemon_process import ROOT
from probe_card import SERIAL, data_of, put, write_card, write_settings

from device.care import support as support_module
from device.care import support_sections
from device.care.support import write_support
from device.care.support_sections import SECTIONS, SupportContext
from device.records.store import Store

PATIENT = ("Mustermann", "Erika", "1964-08-12", "00471108", "3f0c2d1e-9a7b-4c55-8e21-1c1c1c1c1c1c", "Frauenklinik")
NAME, FIRST, BIRTH, NUMBER, ID, WARD = PATIENT
STORY = f"{FIRST} {NAME} *{BIRTH} ({NUMBER}, {WARD}) press {ID}"


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A card whose machine has no systemd: whoever needs one writes its commands."""
    commands = tmp_path / "bin"
    commands.mkdir()
    monkeypatch.setenv("PATH", str(commands))
    write_card(tmp_path / "card")
    return tmp_path / "card"


def command(root: Path, name: str, script: str) -> None:
    path = put(root.parent / "bin" / name, f"#!{sys.executable}\n{script}\n")
    path.chmod(0o755)


def support(root: Path, *, stated: Path | None = None) -> dict[str, Any]:
    """Return every section that is in the file, and under `summary` what is not."""
    file = root.parent / "probe.zip"
    write_support(file, SupportContext(root, stated))
    with zipfile.ZipFile(file) as archive:
        return {name.removesuffix(".json"): json.loads(archive.read(name)) for name in archive.namelist()}


def journal(root: Path, *messages: str) -> None:
    lines = [
        json.dumps(
            {
                "MESSAGE": one,
                "__REALTIME_TIMESTAMP": "1763800000000000",
                "_SYSTEMD_UNIT": "tsis.service",
                "PRIORITY": "3",
            }
        )
        for one in messages
    ]
    put(root.parent / "bin/lines", "\n".join(lines))
    command(root, "journalctl", f"print(open({str(root.parent / 'bin/lines')!r}).read())")


class AnsweringDaemon:
    """Answers as the daemon does, on a port of its own."""

    def __init__(self, answers: dict[str, Any]) -> None:
        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                answer = answers.get(self.path.removeprefix("/api/v1/"))
                self.send_response(404 if answer is None else 200)
                self.end_headers()
                self.wfile.write(json.dumps(answer).encode())

            def log_message(self, format: str, *args: object) -> None:
                pass

        self._server = HTTPServer(("127.0.0.1", 0), Handler)
        self.port = self._server.server_port
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


def status(text: str) -> dict[str, Any]:
    fault = {"code": "E101", "title": "No camera image", "severity": "fault", "cause": text, "remedy": text}
    measured = {"patient": text, "press": {"id": ID}, "measurement_id": ID, "force_n": 0.1234567}
    return {"step": "fault", "press_state": "idle", "faults": [fault], "serial": SERIAL, **measured}


def self_test_report(text: str) -> dict[str, Any]:
    check = {"part": "Camera", "check": "noise", "verdict": "passed", "value": 0.49, "unit": "counts"}
    result = {**check, "bound": "up to 1.5 counts", "code": None, "cause": text, "remedy": text, "note": text}
    facts = {"started_at": "2026-11-22T10:00:00Z", "state": "done", "verdict": "passed", "on_block": False}
    return {**facts, "id": ID, "results": [result]}


def test_it_says_what_a_maintainer_needs(root: Path) -> None:
    put(root / "etc/os-release", 'PRETTY_NAME="Debian"\nID=debian\nVERSION_ID="12"\n')
    put(root / "proc/device-tree/model", "Raspberry Pi 4 Model B Rev 1.4\0")
    put(root / "var/lib/tsis-update/state.json", '{"committed": "0.2.0+412", "pending": null, "bad": {}}')
    put(root / "var/lib/tsis-update/progress.json", '{"state": "rolled_back", "reason": "The camera is not ready."}')
    put(root / "sys/class/hwmon/hwmon0/name", "rpi_volt")
    put(root / "sys/class/hwmon/hwmon0/in0_lcrit_alarm", "1")
    journal(root, "ERROR device.instrument.procedure: E101 No frame came within 1 s.")
    command(root, "systemctl", "print('ActiveState=failed\\nNRestarts=7\\nDescription=x')")
    daemon = AnsweringDaemon(
        {
            "status": status("No frame came within 1 s."),
            "health/parts": {"parts": {"camera": {"ready": False, "code": "E101"}}},
            "self-test": self_test_report(""),
        }
    )
    write_settings(root, f'serial = "{SERIAL}"\n[server]\nport = {daemon.port}\n')
    try:
        found = support(root)
    finally:
        daemon.close()
    assert set(found["summary"]["sections"].values()) == {"ok"}
    assert found["summary"]["schema"] == "tsis.support/1"
    assert found["versions"]["board"] == "Raspberry Pi 4 Model B Rev 1.4"
    assert found["release"]["state"]["committed"] == "0.2.0+412"
    assert found["release"]["progress"] == {"state": "rolled_back", "reason": "The camera is not ready."}
    assert found["settings"]["set"] == {"serial": SERIAL, "server.port": daemon.port, "press.target_n": 0.6}
    assert found["settings"]["in_use"]["press.contact_n"] == 0.05  # which no file says
    assert found["services"]["tsis"] == {"ActiveState": "failed", "NRestarts": "7"}
    assert found["daemon"]["faults"][0]["code"] == "E101"
    assert found["daemon"]["parts"]["parts"]["camera"] == {"ready": False, "code": "E101"}
    assert found["self_test"]["results"][0]["value"] == 0.49
    assert found["measurements"]["measurements"] == 3
    assert found["measurements"]["presses_by_state"] == {"done": 3}
    assert found["measurements"]["warnings"] == {"E206": 3}
    assert found["models"]["certificates"][0]["is_active"]
    assert found["computer"]["is_supply_low"]
    assert found["log"]["lines"][0]["text"] == "ERROR device.instrument.procedure: E101 No frame came within 1 s."


def everything_but_images(file: Path) -> bytes:
    with zipfile.ZipFile(file) as archive:
        return b"\n".join([*(name.encode() for name in archive.namelist()), *map(archive.read, archive.namelist())])


def test_no_patients_data_are_in_it_wherever_they_stand(root: Path) -> None:
    data = data_of(root)
    store = Store(data)
    store.save_press({"id": ID, "mode": NAME, "state": "rejected", "reason": STORY, "code": NUMBER, "warnings": []})
    store.close()
    for number in (1, 2):
        path = data / f"recordings/r-{number}.zip"
        with zipfile.ZipFile(path, "a") as archive:
            archive.writestr("patient.json", json.dumps({"patient": STORY, "phantom_serial": NAME}))
    (data / "recordings/r-1.zip").rename(data / "recordings" / STORY.replace("/", "-"))
    put(data / f"{STORY}.txt", STORY)
    put(data / "restart.json", json.dumps({"cause": STORY, "times": 1}))
    certificate = {"id": ID, "operator": STORY, "serial": NAME, "validity": {"expires_at": STORY}}
    put(data / f"calibrations/{NAME}.json", json.dumps(certificate))
    put(data / "calibrations/active", NAME)
    put(root / "srv/models/quick" / f"{NAME}.npz", STORY)
    put(root / "srv/models/quick/model.json", json.dumps({"note": STORY}))
    put(root / "etc/os-release", f"ID=debian\nPRETTY_NAME={STORY}\n")
    put(root / "proc/device-tree/model", STORY)
    put(root / "var/lib/tsis-update/state.json", json.dumps({"committed": STORY, STORY: STORY, "history": [STORY]}))
    put(root / "var/lib/tsis-update/progress.json", json.dumps({"reason": STORY}))
    put(root / f"etc/tsis/config.d/60-{NAME}.toml", f'# {STORY}\n[cell]\ndevice = "/dev/{NAME}"\n')
    journal(root, STORY, f"E602 The disk of /var/lib/{NAME} has 3 MB left.", f"ValueError: {STORY}", f"GET /{ID}")
    command(root, "systemctl", f"print('ActiveState={STORY}\\nResult={NAME}')")
    daemon = AnsweringDaemon(
        {
            "status": status(STORY) | {"step": STORY, "press_state": STORY},
            "health/parts": {STORY: STORY},
            "self-test": self_test_report(STORY) | {"verdict": STORY},
        }
    )
    texts = f'calibration = "/var/lib/tsis/calibrations"\nstandard_model = "/srv/{NAME}"\n'
    write_settings(root, f'# {STORY}\nserial = "{NAME}"\n{texts}[server]\nport = {daemon.port}\n')
    try:
        found = support(root)
    finally:
        daemon.close()
    assert set(found["summary"]["sections"].values()) == {"ok"}  # or nothing would be proved
    content = everything_but_images(root.parent / "probe.zip").decode().lower()
    assert [one for one in PATIENT if one.lower() in content] == []
    assert "0.1234567" not in content  # a force that was measured


def test_bad_settings_that_name_a_patient_do_not_stand_in_it_and_their_problem_does(root: Path) -> None:
    write_settings(root, f'serial = "{SERIAL}"\n{NAME} = "{STORY}"\n[press]\ntarget_n = 99\n')
    (root / "var/lib/tsis/config.last_good.toml").unlink()
    found = support(root)
    assert found["settings"]["set"] == {"serial": SERIAL, "press.target_n": 0.6}  # by the drop-in
    assert _problem(found, "press.target_n")["bound"] == "at least 0.1 and at most 20 N"
    assert found["settings"]["in_use"] is None
    assert found["settings"]["why_none"].startswith("ConfigError")
    content = everything_but_images(root.parent / "probe.zip").decode().lower()
    assert [one for one in PATIENT if one.lower() in content] == []


def _problem(found: dict[str, Any], setting: str) -> dict[str, str]:
    [problem] = [one for one in found["settings"]["problems"] if one["setting"] == setting]
    return dict(problem)


def test_each_section_that_cannot_be_had_says_why_and_the_others_are_there(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(support_sections, "PORT", 9)  # whatever else runs on this machine, nothing answers there
    content = bytearray((data_of(root) / "tsis.sqlite").read_bytes())
    content[:100] = bytes(100)
    (data_of(root) / "tsis.sqlite").write_bytes(content)
    write_settings(root, "serial = 7\n[nonsense")
    shutil.rmtree(data_of(root) / "calibrations")
    put(root / "var/lib/tsis-update/state.json", "{")
    found = support(root)
    told = found["summary"]["sections"]
    assert "file is not a database" in told["measurements"]
    assert told["daemon"].startswith("URLError")
    assert told["log"].startswith("FileNotFoundError")
    assert told["release"].startswith("JSONDecodeError")
    assert {name for name in SECTIONS if told[name] != "ok"} == set(SECTIONS) - (set(found) - {"summary"})
    assert found["storage"]["recordings"] == 3
    assert found["computer"]["processors"] >= 1


def test_a_section_that_never_comes_back_costs_only_its_time(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    let_go = threading.Event()
    monkeypatch.setitem(SECTIONS, "storage", lambda context: {"late": let_go.wait()})
    monkeypatch.setitem(SECTIONS, "models", lambda context: {"late": let_go.wait()})
    monkeypatch.setattr(support_module, "WITHIN_S", 3.0)
    begun_s = time.monotonic()
    told = support(root)["summary"]["sections"]
    let_go.set()
    assert told["storage"] == told["models"] == "It did not come within 3 s."
    assert told["versions"] == "ok"
    assert time.monotonic() - begun_s < 60.0


def test_it_is_its_owners_alone_and_replaces_an_older_one(root: Path) -> None:
    file = root.parent / "probe.zip"
    put(file, "older")
    support(root)
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert not (root.parent / "probe.zip.tmp").exists()
    with pytest.raises(OSError, match="No such file or directory"):
        write_support(root.parent / "nowhere/probe.zip", SupportContext(root))


def test_it_is_written_by_a_python_that_has_nothing_but_itself(root: Path) -> None:
    """As where the libraries of a release are broken: -S leaves out all that was installed, -I the environment."""
    program = root.parent / "program"
    shutil.copytree(ROOT / "device", program / "device", ignore=shutil.ignore_patterns("__pycache__", "static"))
    code = (
        f"import sys; sys.path.insert(0, {str(program)!r});"
        "from device.commands.support import main; sys.exit(main(sys.argv[1:]))"
    )
    file = root.parent / "alone.zip"
    command_line = [sys.executable, "-S", "-I", "-c", code, str(file), "--root", str(root), "--json"]
    done = subprocess.run(command_line, capture_output=True, text=True, env={"PATH": os.environ["PATH"]}, check=False)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)["sections"]
    assert "ModuleNotFoundError" in told["settings"]
    assert told["measurements"] == "ok"
    assert told["storage"] == "ok"
