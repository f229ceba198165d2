"""`audit verify`: whole or which row, also beside a store that is open."""

import json
import os
import sqlite3
from contextlib import closing, contextmanager

import pytest

from device.__main__ import main
from device.commands.look.audit import verified
from device.errors import StorageError
from device.records.store import Store

NOBODY = 65534


@pytest.fixture
def kept(tmp_path):
    """A store that is open, with two entries, and its settings."""
    store = Store(tmp_path / "var")
    store.save_press({"id": "p-1", "state": "waiting"})
    store.save_press({"id": "p-1", "state": "cancelled"})
    settings = tmp_path / "probe.toml"
    settings.write_text(f'data = "{store.folder}"\n')
    yield store, ["--simulate", "--config", str(settings), "audit", "verify"]
    store.close()


def changed(store):
    with closing(sqlite3.connect(store.folder / "tsis.sqlite")) as db:
        db.executescript("DROP TRIGGER audit_is_never_changed; UPDATE audit SET record = '{}' WHERE seq = 2")


def test_a_whole_audit_has_its_head_said(kept, capsys):
    store, command = kept
    assert main(command) == 0
    head = str(store.audit.verify())
    assert capsys.readouterr().out.split()[-1] == head
    assert main([*command, "--head", head, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"whole": True, "entries": 2, "head": head}


def test_a_changed_row_is_named(kept, capsys):
    store, command = kept
    changed(store)
    assert main(command) == 1
    assert "Row 2 of the audit is not as it was written" in capsys.readouterr().out
    assert main([*command, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["code"] == "E020"


def test_another_head_is_refused(kept, capsys):
    _, command = kept
    assert main([*command, "--head", f"2:{'0' * 64}"]) == 1
    assert "Row 2 of the audit has not the hash" in capsys.readouterr().out


def test_a_folder_without_a_database_is_said(tmp_path, capsys):
    settings = tmp_path / "probe.toml"
    settings.write_text(f'data = "{tmp_path}/none"\n')
    assert main(["--simulate", "--config", str(settings), "audit", "verify"]) == 1
    told = capsys.readouterr().err
    assert "cannot be read" in told
    assert "Name the data folder by the setting `data`." in told


@contextmanager
def another_user(database):
    """Be a user to whom a database does not belong."""
    database.chmod(0o600 if os.geteuid() == 0 else 0)
    if os.geteuid():
        yield
        return
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)


def test_a_database_that_may_not_be_opened_names_who_may(kept):
    store, _ = kept
    with another_user(store.folder / "tsis.sqlite"), pytest.raises(StorageError) as refused:
        verified(store.folder)
    assert refused.value.remedy == "Run this as root or as the daemon's user, to whom the database belongs."


def test_what_was_done_is_listed_newest_first_beside_a_daemon(kept, capsys):
    _, command = kept
    listing = [*command[:-1], "list"]
    assert main([*listing, "--subject", "p-1", "--json"]) == 0
    entries = list(map(json.loads, capsys.readouterr().out.splitlines()))
    assert [entry["what"] for entry in entries] == ["press_ended", "press_begun"]
    assert main([*listing, "--limit", "1"]) == 0
    header, row = capsys.readouterr().out.splitlines()
    assert header.split()[:2] == ["row", "at"]
    assert row.split()[0] == "2"


def test_what_was_done_is_listed_of_a_time(kept, capsys):
    _, command = kept
    listing = [*command[:-1], "list", "--json"]
    assert main(listing) == 0
    entries = list(map(json.loads, capsys.readouterr().out.splitlines()))
    for options, found in (
        (["--from", "2000-01-01T00:00:00+01:00"], entries),
        (["--to", entries[-1]["at"]], []),
        (["--from", "9998-12-31T00:00:00Z"], []),
        (["--from", entries[-1]["at"], "--to", "9998-12-31T00:00:00Z"], entries),
    ):
        assert main([*listing, *options]) == 0
        assert [json.loads(line) for line in capsys.readouterr().out.splitlines() if line] == found


@pytest.mark.parametrize("moment", ["yesterday", "2026-11-23T08:00:00", "1700000000"])
def test_a_time_that_is_none_or_has_no_offset_is_refused(kept, capsys, moment):
    _, command = kept
    with pytest.raises(SystemExit):
        main([*command[:-1], "list", "--from", moment])
    assert "invalid" in capsys.readouterr().err
