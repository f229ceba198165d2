"""`python -m device backup` and `restore` as typed, on a card below a folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from probe_card import SERIAL, SETTINGS, data_of, plug_in_stick, records, write_card, write_settings

from device.__main__ import main
from device.records.schema import STORE_WRITES

Run = Callable[..., tuple[int, list[str], list[str]]]


@pytest.fixture(autouse=True)
def stick(monkeypatch: pytest.MonkeyPatch) -> None:
    plug_in_stick(monkeypatch)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def run_line(root: Path, *arguments: object) -> tuple[int, list[str], list[str]]:
        code = main(["--root", str(root), *map(str, arguments)])
        captured = capsys.readouterr()
        return code, captured.out.splitlines(), captured.err.splitlines()

    return run_line


@pytest.fixture
def card(tmp_path: Path) -> Path:
    write_card(tmp_path / "card")
    return tmp_path / "card"


def test_a_backup_is_made_checked_and_restored(run: Run, card: Path, tmp_path: Path) -> None:
    file, fresh = tmp_path / "a.backup", tmp_path / "fresh"
    code, [first, last], _ = run(card, "backup", file)
    assert code == 0
    assert first.startswith(f"{file}: 3 measurements of {SERIAL}, 10 files")
    assert "keep it as you keep them" in last
    code, lines, _ = run(fresh, "restore", "--check", file)
    assert (code, lines[-1]) == (0, "Every file in it is whole.")
    assert not fresh.exists()
    code, lines, _ = run(fresh, "restore", file)
    assert code == 0
    assert lines[0].startswith(f"{data_of(fresh)}: 3 measurements of {SERIAL}")
    assert records(data_of(fresh)) == records(data_of(card))


def test_a_restore_says_which_files_it_did_not_bring(run: Run, card: Path, tmp_path: Path) -> None:
    """A start without them serves no other machine, and sends nothing where TLS is asked for."""
    named = '[server]\ncertificate = "/etc/tsis/probe.pem"\ncertificate_key = "/etc/tsis/probe.key"\n'
    write_settings(card, SETTINGS + named)
    (card / "etc/tsis/probe.pem").write_text("certificate")
    (card / "etc/tsis/probe.key").write_text("key")
    file, fresh = tmp_path / "a.backup", tmp_path / "fresh"
    run(card, "backup", file)
    code, lines, _ = run(fresh, "restore", file)
    assert code == 0
    assert "server.certificate_key names /etc/tsis/probe.key: it is not there." in lines
    assert lines[-1] == "Start the daemon: systemctl start tsis."
    told = json.loads(run(tmp_path / "again", "restore", "--json", file)[1][0])["unreadable"]
    assert [one["setting"] for one in told] == ["server.certificate", "server.certificate_key"]


def test_both_are_data_for_a_program(run: Run, card: Path, tmp_path: Path) -> None:
    file = tmp_path / "a.backup"
    assert json.loads(run(card, "backup", "--json", file)[1][0])["measurements"] == 3
    checked = json.loads(run(tmp_path, "restore", "--check", "--json", file)[1][0])
    assert (checked["schema"], checked["serial"], checked["store_schema"]) == ("tsis.backup/1", SERIAL, STORE_WRITES)
    assert json.loads(run(tmp_path / "fresh", "restore", "--json", file)[1][0])["presses"] == 3


def test_what_is_refused_is_said_in_one_sentence_with_exit_code_1(run: Run, card: Path, tmp_path: Path) -> None:
    file = tmp_path / "a.backup"
    run(card, "backup", file)
    code, lines, [error] = run(card, "backup", file)
    assert (code, lines) == (1, [])
    assert "choose another name" in error
    code, lines, [error] = run(card, "restore", file)
    assert (code, lines) == (1, [])
    assert "it holds 3 measurements" in error
    other = tmp_path / "other"
    write_settings(other, 'serial = "TSIS-0001"\n')
    code, _, [error] = run(other, "restore", file)
    assert (code, "add --records-only" in error) == (1, True)
    assert run(other, "restore", "--records-only", file)[0] == 0
    assert len(records(data_of(other))) == 3


@pytest.mark.parametrize("arguments", [("backup",), ("restore",), ("restore", "--all", "x")])
def test_wrong_usage_is_exit_code_2(run: Run, tmp_path: Path, arguments: tuple[str, ...]) -> None:
    with pytest.raises(SystemExit) as usage:
        run(tmp_path, *arguments)
    assert usage.value.code == 2
