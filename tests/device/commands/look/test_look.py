"""Verbs that look: what is kept, beside a daemon or without one, in any order of options, and read by `head`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from daemon_process import QUICK_HAND, ROOT, Daemon, wait_for
from fallback_process import Fallback, ProbeRoot
from free_port import free_port
from kept_measurements import keep
from probe_card import RECORDING

from device.__main__ import in_any_order, main
from device.errors import ConfigError
from device.files import medium
from device.files.start_note import write_note
from device.records.exams import ExamContent
from device.records.store import Store

slow = pytest.mark.long


@pytest.fixture(scope="module")
def probe(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data folder with two measurements of a simulated probe, one of them of an exam, and no daemon."""
    folder = tmp_path_factory.mktemp("probe")
    daemon = Daemon(folder, QUICK_HAND)
    try:
        exam = daemon.ask("/api/v1/exams", "POST", {"kind": "patient", "patient_ref": "A-17", "operator": "Ada"}).json
        assert daemon.press("quick")["state"] == "done"
        answer = daemon.ask("/api/v1/presses", "POST", {"mode": "quick", "exam_id": exam["id"]})
        assert daemon.ended(answer.headers["location"])["state"] == "done"
    finally:
        daemon.stop()
    (folder / "probe.toml").write_text('data = "var"\n[retention]\nkeep_days = 1\n')
    return folder


def device(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "device", *words]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(command, cwd=folder, env=environment, text=True, capture_output=True, check=False)


@slow
def test_the_exams_are_listed_with_how_many_measurements_they_have(probe: Path) -> None:
    done = device(probe, "exams", "--simulate")
    assert done.returncode == 0, done.stderr
    [line] = done.stdout.splitlines()[1:]
    assert " A-17 " in line
    assert line.split()[-1] == "1"
    [exam] = map(json.loads, device(probe, "--simulate", "exams", "--patient", "A-17", "--json").stdout.splitlines())
    assert exam["operator"] == "Ada"
    assert device(probe, "exams", "--kind", "phantom", "--json", "--simulate").stdout == ""
    for count in ("0", "-1", "99999999999999999999"):
        refused = device(probe, "exams", "--simulate", "--limit", count)
        assert (refused.returncode, "limit is" in refused.stderr, "Traceback" in refused.stderr) == (1, True, False)


@slow
def test_measurements_go_to_a_table_to_arrays_and_to_an_archive_that_are_never_written_over(probe: Path) -> None:
    table = device(probe, "export", "--simulate")
    assert len(table.stdout.splitlines()) == 3
    for name in ("all.csv", "all.npz", "all.nc", "all.zip"):
        assert device(probe, "export", "--out", name, "--simulate").returncode == 0
    assert (probe / "all.csv").read_text() == table.stdout.replace("\r\n", "\n")
    with np.load(probe / "all.npz", allow_pickle=False) as arrays:
        assert {len(arrays[name]) for name in arrays.files if arrays[name].ndim} >= {2}
    with zipfile.ZipFile(probe / "all.zip") as archive:
        assert sum(name.startswith("recordings/") for name in archive.namelist()) == 2
    again = device(probe, "export", "--out", "all.csv", "--simulate")
    assert (again.returncode, "a new file" in again.stderr) == (1, True)
    assert device(probe, "export", "--out", "all.txt", "--simulate").returncode == 1
    for wrong in (("--exam", "none"), ("--mode", "none")):
        refused = device(probe, "export", "--out", "none.csv", "--simulate", *wrong)
        assert (refused.returncode != 0, "none" in refused.stderr, (probe / "none.csv").exists()) == (True, True, False)


@slow
def test_what_a_rule_deletes_is_shown_and_nothing_is_deleted(probe: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = Store(probe / "var")
    kept = store.measurements(before_seq=99, limit=9)
    store._db.execute("UPDATE measurement SET record = json_set(record, '$.taken_at', '2020-01-01T00:00:00.000Z')")
    store._db.commit()
    store.close()
    shown = device(probe, "--config", "probe.toml", "retention")
    assert "0 recordings of 0.0 MB go; 2 wait for a backup; no backup is known." in shown.stdout
    monkeypatch.chdir(probe)
    monkeypatch.setattr(medium, "device_number", lambda path: f"no-disk:{path}")
    assert main(["backup", str(probe), "--config", "probe.toml"]) == 0
    plan = json.loads(device(probe, "retention", "--json", "--config", "probe.toml").stdout)
    assert [one["recording_id"] for one in plan["removals"]] == [one["recording_id"] for one in kept][::-1]
    assert {one["why"] for one in plan["removals"]} == {"older than 1 days"}
    assert len(list((probe / "var" / "recordings").iterdir())) == 2
    assert "nothing is ever deleted" in device(probe, "retention", "--simulate").stdout


@slow
def test_the_status_is_the_daemons_or_the_last_press_of_one_that_does_not_run(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path, QUICK_HAND)
    port = daemon.url.rsplit(":", 1)[1]
    try:
        wait_for(lambda: daemon.ask("/api/v1/status").json["step"], lambda step: step == "ready")
        asked = device(tmp_path, "status", "--port", port, "--simulate")
        assert (asked.returncode, "simulated probe SIM-0001" in asked.stdout) == (0, True), asked
        press = daemon.press("quick")
        told = json.loads(device(tmp_path, "--simulate", "status", "--json", f"--port={port}").stdout)
        assert told["press"]["id"] == press["id"]
    finally:
        daemon.stop()
    asked = device(tmp_path, "status", "--port", port, "--simulate")
    assert asked.returncode == 3
    assert "No daemon answers" in asked.stderr
    assert f"last press {press['id']}" in asked.stdout


def status(settings: Path, port: int, *words: str) -> int:
    return main(["--simulate", "--config", str(settings), "--port", str(port), "status", *words])


@pytest.fixture
def settings(tmp_path: Path) -> Path:
    """A settings file whose data folder holds nothing yet."""
    path = tmp_path / "probe.toml"
    path.write_text(f'data = "{tmp_path / "var"}"\n')
    return path


def test_where_a_page_stands_in_for_the_daemon_its_faults_and_the_last_press_are_said(
    tmp_path: Path, settings: Path, capsys
) -> None:
    store = Store(tmp_path / "var")
    store.save_press({"id": "p-1", "state": "done", "mode": "quick", "asked_at": "2026-11-22T10:00:00.000Z"})
    store.close()
    root, refused = ProbeRoot(tmp_path / "root"), ConfigError("press.target_n is 99.", "Correct it.")
    write_note(root.folder, [refused.as_record()])
    page = Fallback(root)
    try:
        assert status(settings, root.port) == 3
        told = capsys.readouterr()
        assert told.out.splitlines() == [
            "E001 Settings refused: press.target_n is 99. Correct it.",
            "last press p-1, quick, 2026-11-22T10:00:00.000Z: done",
        ]
        assert told.err == "No daemon runs; its page says why.\n"
        assert status(settings, root.port, "--json") == 3
        record = json.loads(capsys.readouterr().out)
        assert (record["press"]["id"], record["faults"], record["unread"]) == ("p-1", [refused.as_record()], None)
    finally:
        page.stop()


def test_a_store_that_cannot_be_read_is_not_told_as_no_press(tmp_path: Path, settings: Path, capsys) -> None:
    port = free_port()
    assert status(settings, port) == 3
    assert capsys.readouterr().out == "no press yet\n"
    (tmp_path / "var" / "tsis.sqlite").mkdir(parents=True)  # what nobody can open, not even root
    assert status(settings, port) == 3
    told = capsys.readouterr().out
    assert told.startswith("last press unknown: E601 The store")
    assert "run this as root or as the daemon's user" in told
    assert status(settings, port, "--json") == 3
    record = json.loads(capsys.readouterr().out)
    assert (record["press"], record["faults"], record["unread"]["code"]) == (None, [], "E601")


def test_exams_count_what_counts_and_say_how_many_are_void(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    store = Store(tmp_path / "var")
    for operator, numbers in (("Ada", (1, 2, 3)), ("Bea", (4, 5))):
        exam = store.exams.make(ExamContent(kind="patient", patient_ref="A-17", operator=operator))
        for number in numbers:
            keep(store, number, exam_id=exam["id"])
    store.exams.void("m-2", version=1, by="Ada", reason="Slipped")
    store.close()
    assert main(["exams", "--simulate"]) == 0
    of_bea, of_ada = capsys.readouterr().out.splitlines()[1:]
    assert of_bea.split()[-2:] == ["Bea", "2"]
    assert of_ada.endswith("2 (+1 void)")


def test_exams_of_one_number_say_their_issuer_and_are_narrowed_by_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    store = Store(tmp_path / "var")
    for issuer in ("HOSP-A", "HOSP-B", None):
        store.exams.make(ExamContent(kind="patient", patient_ref="4711", operator="Ada"), issuer=issuer)
    store.close()

    def issuers(*narrowed: str) -> list[str | None]:
        assert main(["exams", "--simulate", "--patient", "4711", "--json", *narrowed]) == 0
        return [json.loads(line)["patient_issuer"] for line in capsys.readouterr().out.splitlines()]

    assert issuers() == [None, "HOSP-B", "HOSP-A"]
    assert issuers("--issuer", "HOSP-A") == ["HOSP-A"]
    assert issuers("--issuer", "") == [None]
    assert main(["exams", "--simulate"]) == 0
    assert [line.split()[3] for line in capsys.readouterr().out.splitlines()[2:]] == ["HOSP-B", "HOSP-A"]


def test_a_reader_that_has_seen_enough_ends_a_verb_without_a_traceback(tmp_path: Path) -> None:
    store = Store(tmp_path / "var")
    for number in range(3000):
        with store._db:
            store._db.execute(
                "INSERT INTO exam (id, version, record) VALUES (?, 1, ?)",
                (f"e-{number}", json.dumps({"id": f"e-{number}", "kind": "phantom", "patient_ref": None})),
            )
    store.close()
    command = f"{sys.executable} -m device --simulate exams --kind phantom --limit 3000 --json | head -n 1"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        command, shell=True, cwd=tmp_path, env=environment, text=True, capture_output=True, check=True
    )
    assert json.loads(done.stdout)["kind"] == "phantom"
    assert done.stderr == ""


@pytest.mark.parametrize(
    ("given", "read"),
    [
        (["status", "--port", "7", "--json"], ["--port", "7", "status", "--json"]),
        (["exams", "--simulate", "--config=a.toml"], ["--simulate", "--config=a.toml", "exams"]),
        (["audit", "verify", "--config", "a.toml"], ["--config", "a.toml", "audit", "verify"]),
        (["analyse", "--", "--config", "x"], ["analyse", "--", "--config", "x"]),
        (["status", "--port"], ["--port", "status"]),
        (["--json", "status", "--port", "7"], ["--port", "7", "status", "--json"]),
        (["--exam", "ID", "export", "--long"], ["export", "--exam", "ID", "--long"]),
        (["--json", "support-bundle", "a.zip"], ["support-bundle", "--json", "a.zip"]),
        (["--help", "status"], ["--help", "status"]),
        (["--json", "--", "status"], ["--json", "--", "status"]),
    ],
)
def test_options_of_every_verb_may_stand_anywhere(given: list[str], read: list[str]) -> None:
    assert in_any_order(given) == read


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--lesions", "--out", "l.nc"], "--out of --lesions is l.nc, but must be a table, FILE.csv"),
        (["--long", "--out", "l.npz"], "--out of --long is l.npz"),
        (["--long", "--out", "l.zip"], "--out of --long is l.zip"),
        (["--lesions", "--with-void"], "what is void is in no lesion"),
    ],
)
def test_options_of_which_an_export_would_pass_one_over_are_refused(tmp_path, monkeypatch, capsys, words, said) -> None:
    monkeypatch.chdir(tmp_path)
    Store(tmp_path / "var").close()
    (tmp_path / "probe.toml").write_text(f'data = "{tmp_path / "var"}"\n')
    assert main(["export", "--config", str(tmp_path / "probe.toml"), *words]) == 1
    assert said in capsys.readouterr().err
    assert not list(tmp_path.glob("l.*"))


def test_a_store_that_is_only_read_takes_nothing_and_needs_a_database(tmp_path: Path, capsys) -> None:
    (tmp_path / "probe.toml").write_text(f'data = "{tmp_path / "none"}"\n')
    assert main(["exams", "--config", str(tmp_path / "probe.toml")]) == 1
    assert "E601" not in capsys.readouterr().out
    store = Store(tmp_path / "var")
    store.exams.make(ExamContent(kind="phantom", operator="Ada"))
    reader = Store(tmp_path / "var", to_read=True)
    assert len(reader.exams.exams(kind="phantom", before_seq=9, limit=9)) == 1
    with pytest.raises(Exception, match="readonly"):
        reader.exams.make(ExamContent(kind="phantom", operator="Bo"))
    with pytest.raises(Exception, match="readonly"):
        reader.add_measurement({"id": "m-1"}, RECORDING)
    reader.close()
    store.close()
