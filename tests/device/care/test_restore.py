"""A backup on a new card is the probe as it was; what does not fit is refused, and nothing that is there is lost."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import sqlite3
import stat
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from kept_measurements import keep
from probe_card import (
    OWN_CARD,
    SERIAL,
    add_measurement,
    data_of,
    kept_files,
    plug_in_stick,
    put,
    records,
    write_card,
    write_settings,
)

from device.care import restore as restore_module
from device.care.backup import write_backup
from device.care.restore import RestoreReport, check_backup, restore_backup
from device.errors import BusyError, DiskFullError, StorageError
from device.files import medium
from device.files.plain_settings import layer_files
from device.files.recording_file import read_recording
from device.files.screen_choices import ScreenChoices, read_choices, write_choices
from device.measurement.quantities import InvalidQuantity
from device.records.database import DATABASE
from device.records.saved import SAVED, SavedUntil, Unsaved, saved_until, unsaved
from device.records.schema import STORE_READS, STORE_WRITES
from device.records.store import Store
from device.settings.layers import read_layers
from device.web.streams.changes import ChangeFeed

PLACES = {"data": "/var/lib/tsis", "calibration": "/var/lib/tsis/calibrations", "models": {}}


@pytest.fixture(autouse=True)
def stick(monkeypatch: pytest.MonkeyPatch) -> None:
    plug_in_stick(monkeypatch)


@pytest.fixture
def card(tmp_path: Path) -> Path:
    write_card(tmp_path / "card")
    return tmp_path / "card"


@pytest.fixture
def backup(card: Path, tmp_path: Path) -> Path:
    write_backup(read_layers(layer_files(card)).config(), tmp_path / "a.backup", card)
    return tmp_path / "a.backup"


@pytest.fixture
def fresh(tmp_path: Path) -> Path:
    (tmp_path / "fresh/var/lib").mkdir(parents=True)
    return tmp_path / "fresh"


def restored(backup: Path, root: Path, *, records_only: bool = False) -> RestoreReport:
    return restore_backup(backup, own(root), root, records_only=records_only)


def own(root: Path) -> Mapping[str, Any]:
    return read_layers(layer_files(root)).values


def test_a_fresh_card_is_the_probe_again(card: Path, backup: Path, fresh: Path) -> None:
    report = restored(backup, fresh)
    assert (report.serial, report.measurements, report.kept_aside) == (SERIAL, 3, ())
    assert kept_files(fresh) == kept_files(card)
    assert records(data_of(fresh)) == records(data_of(card))
    assert stat.S_IMODE((data_of(fresh) / "calibrations/c-1.json").stat().st_mode) == 0o444
    store = Store(data_of(fresh))
    assert store.press("p-2")["state"] == "done"
    assert store.light_on_s == 12.5
    assert read_recording(store.recording_path("r-3")).serial == SERIAL
    assert add_measurement(store, 9)["seq"] == 4  # numbers go on where they were
    store.close()


def events_missed(store: Store, last_event_id: str | None = None) -> tuple[str, list[str]]:
    """Return the id with which a client's stream begins, and the ids of what it is told of then."""

    async def missed() -> tuple[str, list[str]]:
        feed = ChangeFeed(store, last_event_id)
        begun_at = await feed.begin()
        return begun_at, [json.loads(str(event.raw_data))["id"] async for event in feed.new()]

    return asyncio.run(missed())


def test_a_client_of_the_events_misses_nothing_after_a_restore_whatever_number_it_knows(
    card: Path, backup: Path, fresh: Path
) -> None:
    """More is measured after the restore than since the backup, so all numbers have been given again."""
    with closing(Store(data_of(card))) as store:
        in_backup = str(store.audit.newest())
        keep(store, 8)
        since_backup = str(store.audit.newest())
    restored(backup, fresh)
    with closing(Store(data_of(fresh))) as store:
        for number in (9, 10, 11):
            keep(store, number)
        assert store.audit.newest().seq > int(since_backup.partition(":")[0])
        begun_at, told = events_missed(store, since_backup)
        assert (begun_at, told) == (f"0:{'0' * 64}", ["m-9", "m-10", "m-11"])
        assert events_missed(store, in_backup) == (in_backup, ["m-9", "m-10", "m-11"])


def test_a_backup_of_the_restored_card_holds_the_same(backup: Path, fresh: Path, tmp_path: Path) -> None:
    restored(backup, fresh)
    again = write_backup(read_layers(layer_files(fresh)).config(), tmp_path / "b.backup", fresh)
    assert (again.measurements, again.missing) == (3, ())


def test_a_restored_card_says_what_the_backup_holds_and_since_when(card: Path, fresh: Path, tmp_path: Path) -> None:
    recordings = data_of(card) / "recordings"
    put(recordings / "r-1.zip", "damaged")
    (recordings / "r-2.zip").unlink()
    write_backup(read_layers(layer_files(card)).config(), tmp_path / "a.backup", card)
    made_at = check_backup(tmp_path / "a.backup")["made_at"]
    put(data_of(fresh) / SAVED, "{}")
    report = restored(tmp_path / "a.backup", fresh)
    said = SavedUntil(made_at, 3, "m-3", ("r-2", "r-1"), str(tmp_path / "a.backup"))
    with closing(sqlite3.connect(data_of(fresh) / DATABASE)) as db:
        assert saved_until(db, data_of(fresh)) == said
        assert unsaved(db, data_of(fresh), "2999") == Unsaved(0, None, made_at)
    assert report.kept_aside == (str(data_of(fresh) / "before-restore" / SAVED),)


def test_a_backup_that_would_be_lost_with_the_card_does_not_count_as_saved(
    backup: Path, fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(medium, "device_number", lambda path: OWN_CARD)
    restored(backup, fresh)
    assert not (data_of(fresh) / SAVED).exists()


def test_a_card_whose_daemon_has_run_without_a_press_is_fresh(card: Path, backup: Path, fresh: Path) -> None:
    write_settings(fresh, f'serial = "{SERIAL}"\n')
    Store(data_of(fresh)).close()
    put(data_of(fresh) / "config.last_good.toml", "other\n")
    report = restored(backup, fresh)
    assert len(records(data_of(fresh))) == 3
    aside = {Path(path).relative_to(fresh).as_posix() for path in report.kept_aside}
    assert aside == {
        "etc/tsis/config.toml.before-restore",
        "var/lib/tsis/before-restore/config.last_good.toml",
        "var/lib/tsis/before-restore/tsis.sqlite",
    }
    assert (data_of(fresh) / "before-restore/config.last_good.toml").read_text() == "other\n"
    assert (fresh / "etc/tsis/config.toml").read_bytes() == (card / "etc/tsis/config.toml").read_bytes()


def test_a_data_folder_with_measurements_is_refused_and_stays(backup: Path, fresh: Path) -> None:
    store = Store(data_of(fresh))
    kept = add_measurement(store, 7)
    store.close()
    before = kept_files(fresh)
    with pytest.raises(InvalidQuantity, match="empty, but it holds 1 measurements"):
        restored(backup, fresh)
    assert kept_files(fresh) == before
    assert records(data_of(fresh)) == [kept]


def test_a_recording_that_the_backup_does_not_have_is_not_lost(backup: Path, fresh: Path) -> None:
    put(data_of(fresh) / "recordings/mine/recording.json", "{}")
    with pytest.raises(InvalidQuantity, match="it holds recordings/mine/recording.json"):
        restored(backup, fresh)
    shutil.rmtree(data_of(fresh) / "recordings/mine")
    put(data_of(fresh) / "recordings/r-1/recording.json", "another")
    with pytest.raises(InvalidQuantity, match="it holds recordings/r-1/recording.json"):
        restored(backup, fresh)


def test_a_database_that_cannot_be_read_is_not_taken_for_an_empty_one(backup: Path, fresh: Path) -> None:
    put(data_of(fresh) / "tsis.sqlite", "no database at all, but somebody's measurements once" * 50)
    with pytest.raises(StorageError, match="Move it away first"):
        restored(backup, fresh)


def test_while_a_daemon_runs_nothing_is_restored(backup: Path, fresh: Path) -> None:
    running = Store(data_of(fresh))
    try:
        with pytest.raises(BusyError, match="systemctl stop tsis"):
            restored(backup, fresh)
    finally:
        running.close()


def test_the_settings_of_another_probe_are_refused_its_measurements_are_not(backup: Path, fresh: Path) -> None:
    write_settings(fresh, 'serial = "TSIS-0001"\n')
    put(data_of(fresh) / "calibrations/active", "mine\n")
    before = kept_files(fresh)
    with pytest.raises(InvalidQuantity, match="must be TSIS-0001, as this probe's settings say"):
        restored(backup, fresh)
    assert kept_files(fresh) == before
    restored(backup, fresh, records_only=True)
    assert {name for name in kept_files(fresh) if "/recordings/" not in name} == set(before)
    assert kept_files(fresh).items() >= before.items()
    assert len(records(data_of(fresh))) == 3


@pytest.mark.parametrize("records_only", [False, True])
def test_no_token_of_a_backup_holds_after_it(card: Path, fresh: Path, tmp_path: Path, records_only: bool) -> None:
    """One that was revoked after the backup would hold again, and another probe's here."""
    store = Store(data_of(card))
    made, secret = store.tokens.make("Stolen laptop", "admin", days=90)
    store.close()
    write_backup(read_layers(layer_files(card)).config(), tmp_path / "b.backup", card)
    restored(tmp_path / "b.backup", fresh, records_only=records_only)
    with closing(Store(data_of(fresh))) as again:
        assert again.tokens.of(secret) is None
        [revoked, *_] = again.audit.entries(subject=made.id, before_seq=99, limit=9)
        assert (revoked["what"], revoked["reason"]) == ("token_revoked", "restored from a backup: pair again")
        assert again.audit.warning() is None


def test_records_alone_go_to_this_probes_own_data_folder(backup: Path, fresh: Path) -> None:
    write_settings(fresh, 'serial = "TSIS-0001"\ndata = "/srv/elsewhere"\n')
    assert restored(backup, fresh, records_only=True).data == str(fresh / "srv/elsewhere")
    assert len(records(fresh / "srv/elsewhere")) == 3


def test_a_store_of_newer_software_is_refused(card: Path, fresh: Path, tmp_path: Path) -> None:
    db = sqlite3.connect(data_of(card) / "tsis.sqlite")
    db.execute(f"PRAGMA user_version = {STORE_WRITES + 1}")
    db.close()
    write_backup(read_layers(layer_files(card)).config(), tmp_path / "new.backup", card)
    known = ", ".join(map(str, STORE_READS))
    with pytest.raises(InvalidQuantity, match=f"but must be {known}, which this software reads"):
        restored(tmp_path / "new.backup", fresh)
    assert not data_of(fresh).exists()


def test_a_card_of_before_databases_had_a_number_is_restored(card: Path, fresh: Path, tmp_path: Path) -> None:
    db = sqlite3.connect(data_of(card) / "tsis.sqlite")
    db.execute("PRAGMA user_version = 0")
    db.close()
    write_backup(read_layers(layer_files(card)).config(), tmp_path / "old.backup", card)
    restored(tmp_path / "old.backup", fresh)
    assert len(records(data_of(fresh))) == 3


@pytest.mark.parametrize("name", ["release_signers", "deploy_keys", "config.d/../release_signers", "config.d/a.sh"])
def test_a_backup_brings_settings_and_no_keys(fresh: Path, name: str) -> None:
    """Else a file that nobody signs would say whose releases this probe trusts."""
    targets = restore_module._Targets({"places": PLACES}, {}, fresh, records_only=False)
    with pytest.raises(InvalidQuantity, match="a settings file of a probe"):
        targets.of(f"settings/{name}")
    assert targets.of("settings/config.toml") == fresh / "etc/tsis/config.toml"
    assert targets.of("settings/config.d/10-light.toml") == fresh / "etc/tsis/config.d/10-light.toml"


def test_root_follows_no_link_in_the_daemons_folder(backup: Path, fresh: Path, tmp_path: Path) -> None:
    victim = tmp_path / "victim"
    victim.write_text("kept")
    data_of(fresh).mkdir(parents=True)
    (data_of(fresh) / "lock").symlink_to(victim)
    with pytest.raises(OSError, match="symbolic links"):
        restored(backup, fresh)
    assert victim.read_text() == "kept"


def test_a_damaged_backup_changes_nothing(backup: Path, fresh: Path) -> None:
    content = bytearray(backup.read_bytes())
    content[len(content) // 2] ^= 1
    backup.write_bytes(content)
    with pytest.raises(InvalidQuantity, match="changed or damaged"):
        restored(backup, fresh)
    assert list((fresh / "var/lib").iterdir()) == []


@pytest.mark.parametrize("place", ["/etc", "/root/.ssh", "/var/lib", "/var/lib/../../etc", "/usr/lib/tsis"])
def test_a_backup_brings_nothing_to_where_a_program_keeps_no_data(
    place: str, fresh: Path, tmp_path: Path, card: Path
) -> None:
    """A file from elsewhere is not trusted with root's rights."""
    config = read_layers(layer_files(card)).config()
    forged = tmp_path / "forged"
    shutil.copytree(data_of(card), forged / place.removeprefix("/"))
    write_settings(forged, f'serial = "{SERIAL}"\ndata = "{place}"\n')
    (forged / place.removeprefix("/") / "tsis.sqlite").exists()
    config = read_layers(layer_files(forged)).config()
    write_backup(config, tmp_path / "forged.backup", forged, same_disk=True)
    with pytest.raises(InvalidQuantity, match="in this machine's settings first"):
        restored(tmp_path / "forged.backup", fresh)


def test_a_card_that_is_too_small_is_told_before_anything_is_written(
    backup: Path, fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Small:
        free = 1000

    monkeypatch.setattr(restore_module.shutil, "disk_usage", lambda path: Small)
    with pytest.raises(DiskFullError, match="a larger card"):
        restored(backup, fresh)
    assert {path.name for path in data_of(fresh).iterdir()} == {"lock"}


class PowerCut(BaseException):
    """Nothing of the program runs after it."""


def test_wherever_the_power_fails_no_measurement_is_shown_and_the_same_command_finishes(
    card: Path, backup: Path, fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every rename and every file that is staged is such a place."""
    steps, places = [0], 0
    kept = records(data_of(card))
    real_replace, real_stage = Path.replace, restore_module._stage

    def cut_after(real: Any, *arguments: Any) -> Any:
        steps[0] -= 1
        if steps[0] < 0:
            raise PowerCut
        return real(*arguments)

    monkeypatch.setattr(restore_module, "_stage", lambda *a: cut_after(real_stage, *a))
    monkeypatch.setattr(restore_module.shutil, "rmtree", lambda *a, **k: None if steps[0] < 0 else _rmtree(*a, **k))
    monkeypatch.setattr(Path, "replace", lambda self, to: cut_after(real_replace, self, to))
    while True:
        steps[0] = places
        try:
            restored(backup, fresh)
        except PowerCut:
            places += 1
            if (data_of(fresh) / "tsis.sqlite").exists():
                assert records(data_of(fresh)) == []
            else:
                Store(data_of(fresh)).close()  # the daemon starts in between, and shows an empty probe
            steps[0] = 10**6
            if places % 5:
                continue
            restored(backup, fresh)
            assert records(data_of(fresh)) == kept
            shutil.rmtree(fresh)
            (fresh / "var/lib").mkdir(parents=True)
        else:
            break
    assert places > len(kept_files(card)) + 1  # each file and the database are staged at a place of their own
    assert records(data_of(fresh)) == kept
    assert kept_files(card).items() <= kept_files(fresh).items()


_rmtree = shutil.rmtree


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file away")
def test_what_is_restored_belongs_to_the_owner_of_the_data_folder(backup: Path, fresh: Path) -> None:
    data_of(fresh).mkdir(parents=True)
    os.chown(data_of(fresh), 4711, 4712)
    restored(backup, fresh)
    owners = {(path.stat().st_uid, path.stat().st_gid) for path in [data_of(fresh), *data_of(fresh).rglob("*")]}
    assert owners == {(4711, 4712)}
    assert (fresh / "etc/tsis/config.toml").stat().st_uid == 0


def test_a_new_card_speaks_as_the_one_before(card: Path, fresh: Path, tmp_path: Path) -> None:
    chosen = ScreenChoices("de", "dark", "off")
    write_choices(data_of(card), chosen)
    write_backup(read_layers(layer_files(card)).config(), tmp_path / "a.backup", card)
    restored(tmp_path / "a.backup", fresh)
    assert read_choices(data_of(fresh)) == chosen
