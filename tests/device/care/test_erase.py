"""What an erasure takes is nowhere on the disk afterwards; what it leaves is said, and nothing goes by mistake."""

from __future__ import annotations

import fcntl
import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from cut_disk import CutDisk, can_cut
from probe_card import OWN_CARD, SERIAL, add_measurement, data_of, plug_in_stick, put, records, write_card
from written_exam import begin

from device.__main__ import main
from device.care.backup import write_backup
from device.care.erase import erase, plan_erasure
from device.errors import BusyError
from device.files import medium
from device.files.plain_settings import layer_files
from device.files.screen_choices import NAME, ScreenChoices, write_choices
from device.measurement.quantities import InvalidQuantity
from device.records.database import DATABASE
from device.records.saved import SAVED
from device.records.store import Store
from device.settings.layers import read_layers

HOSPITAL = '[webhook]\nurl = "https://notices.example.org/"\nsecret_file = "/etc/tsis/webhook.secret"\n'
CANARY = "canary-of-nobody"


@pytest.fixture(autouse=True)
def stick(monkeypatch: pytest.MonkeyPatch) -> None:
    plug_in_stick(monkeypatch)


@pytest.fixture
def card(tmp_path: Path) -> Path:
    return written(tmp_path / "card")


def written(root: Path) -> Path:
    """Write a card with an exam of a patient, keys, and what a restore and a kill have left."""
    data = write_card(root)
    put(root / "etc/tsis/config.d/60-hospital.toml", HOSPITAL)
    put(root / "etc/tsis/webhook.secret", f"whsec_{CANARY}")
    put(data / "tls/key.pem", f"{CANARY}\n" * 100)
    put(data / "before-restore/recordings/r-9.zip", f"{CANARY}\n" * 1000)
    put(data / "orphans/r-8.zip", f"{CANARY}\n" * 1000)
    store = Store(data)
    begin(store, patient_ref=CANARY)
    store.close()
    return root


def erased(root: Path, **options: object):
    layers = read_layers(layer_files(root))
    return erase(layers.config(), layers.values, root, serial=SERIAL, **options)  # type: ignore[arg-type]


def saved(root: Path, folder: Path) -> None:
    write_backup(read_layers(layer_files(root)).config(), folder / "a.backup", root)


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[CutDisk]:
    """A disk of its own: an erasure fills all of it."""
    if not can_cut():
        pytest.skip("root, loop devices and ext4 are needed for a disk of its own")
    made = CutDisk(tmp_path)
    yield made
    made.down()


def test_no_byte_of_patients_or_keys_is_on_the_disk_afterwards(disk: CutDisk) -> None:
    root, canary = written(disk.mount), CANARY.encode()
    gone = put(data_of(root) / "recordings/long-gone.zip", f"{CANARY}\n" * 50_000)
    disk.down()
    disk.up()  # all of it is on the disk
    gone.unlink()
    assert disk.image.read_bytes().count(canary) > 50_000
    found = list[int]()

    def looked(step: str) -> None:  # before the space is offered to the disk, which would hide what was left
        if step == "The free space was overwritten.":
            found.append(disk.image.read_bytes().count(canary))

    report = erased(root, also_unsaved=True, told=looked)
    disk.down()
    disk.up()
    assert found == [0]
    assert disk.image.read_bytes().count(canary) == 0
    assert report.overwritten_bytes > 30_000
    assert report.free_bytes > 10e6
    assert (report.trimmed, report.unreached_bytes) == (True, 0)


def test_the_probe_is_fresh_afterwards_and_keeps_what_is_of_its_own_parts(disk: CutDisk, tmp_path: Path) -> None:
    root = written(disk.mount)
    outside = put(disk.mount / "srv/kept", "by a link only\n")
    (data_of(root) / "link").symlink_to(outside)
    saved(root, tmp_path)
    report = erased(root)
    assert [path.name for path in data_of(root).iterdir() if path.name != "lock"] == ["calibrations"]
    assert (data_of(root) / "calibrations/c-1.json").read_text().startswith('{"id": "c-1"')
    assert not (root / "etc/tsis/webhook.secret").exists()
    assert outside.read_text() == "by a link only\n"
    assert report.left[:2] == ("the setting webhook.url", "the setting webhook.secret_file")
    assert report.left[2].startswith("calibration certificates in ")
    assert records(data_of(root)) == []  # as a first start finds it
    again = erased(root)
    assert (again.keys, again.serial) == (0, SERIAL)


def test_what_a_power_cut_left_is_erased_by_the_same_command(disk: CutDisk, tmp_path: Path) -> None:
    root = written(disk.mount)
    saved(root, tmp_path)

    def cut(step: str) -> None:
        if step.startswith("Filling"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        erased(root, told=cut)
    assert erased(root).free_bytes > 10e6


def contents(root: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in sorted(root.rglob("*")) if path.is_file() and path.name != "lock"}


@pytest.mark.parametrize("serial", ["", "TSIS-0043"])
def test_another_probes_serial_number_erases_nothing(card: Path, serial: str) -> None:
    before, layers = contents(card), read_layers(layer_files(card))
    with pytest.raises(InvalidQuantity, match=f"must be {SERIAL}, this probe's"):
        erase(layers.config(), layers.values, card, serial=serial, also_unsaved=True)
    assert contents(card) == before


def test_measurements_that_no_backup_holds_are_not_erased_by_mistake(card: Path, tmp_path: Path) -> None:
    before = contents(card)
    with pytest.raises(InvalidQuantity, match="measurements in no backup is 3, but must be 0: save them"):
        erased(card)
    assert contents(card) == before
    saved(card, tmp_path)
    store = Store(data_of(card))
    add_measurement(store, 4)
    store.close()
    with pytest.raises(InvalidQuantity, match="measurements in no backup is 1"):
        erased(card)


def test_folders_beside_the_data_folder_that_hold_patients_data_are_said(card: Path) -> None:
    beside = data_of(card).parent
    put(beside / "tsis.damaged" / DATABASE, CANARY)
    put(beside / "tsis.old/recordings/r-9.zip", CANARY)
    put(beside / "dbus/machine-id", "of no patient")
    layers = read_layers(layer_files(card))
    plan = plan_erasure(layers.config(), layers.values, card)
    assert [what for what in plan.left if what.startswith("measurements or recordings")] == [
        f"measurements or recordings in {beside / name}" for name in ("tsis.damaged", "tsis.old")
    ]
    assert not any("tsis.damaged" in str(path) for path in plan.files)


def test_a_backup_that_lies_on_the_card_itself_is_said_and_does_not_count(
    card: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    layers, left = read_layers(layer_files(card)), card / "home/a.backup"
    left.parent.mkdir()
    saved(card, tmp_path)  # on the stick: not on the card, and not named
    assert not [what for what in plan_erasure(layers.config(), layers.values, card).left if "a backup" in what]
    (data_of(card) / SAVED).unlink()
    monkeypatch.setattr(medium, "device_number", lambda path: OWN_CARD)
    write_backup(layers.config(), left, card, same_disk=True)
    plan = plan_erasure(layers.config(), layers.values, card)
    assert f"a backup with measurements, {left}" in plan.left
    assert (plan.unsaved, left in plan.files) == (3, False)
    broken_off = put(left.parent / f".tsis-backup-{SERIAL}-ab12cd_9/tsis.sqlite", CANARY).parent
    assert plan_erasure(layers.config(), layers.values, card).left[-1] == f"a backup with measurements, {broken_off}"
    shutil.rmtree(broken_off)
    left.unlink()
    assert not [what for what in plan_erasure(layers.config(), layers.values, card).left if "a backup" in what]


def test_a_data_folder_that_was_moved_away_and_not_restored_is_said(card: Path) -> None:
    data = data_of(card)
    data.rename(data.with_name("tsis.damaged"))
    layers = read_layers(layer_files(card))
    plan = plan_erasure(layers.config(), layers.values, card)
    assert f"measurements or recordings in {data.with_name('tsis.damaged')}" in plan.left


def test_a_database_that_cannot_be_read_is_not_taken_for_an_empty_one(card: Path) -> None:
    (data_of(card) / DATABASE).write_bytes(b"no database" * 1000)
    with pytest.raises(InvalidQuantity, match="measurements in no backup is an unknown number of"):
        erased(card)


def test_nothing_is_erased_under_a_daemon_that_runs(card: Path) -> None:
    with (data_of(card) / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        before = contents(card)
        with pytest.raises(BusyError, match="A daemon runs on"):
            erased(card, also_unsaved=True)
    assert contents(card) == before


def test_a_backup_of_the_database_before_this_one_holds_none_of_its_measurements(card: Path, tmp_path: Path) -> None:
    saved(card, tmp_path)
    layers = read_layers(layer_files(card))
    assert plan_erasure(layers.config(), layers.values, card).unsaved == 0
    note = data_of(card) / SAVED
    note.write_text(json.dumps(json.loads(note.read_text()) | {"newest_id": "of-the-one-before"}))
    assert plan_erasure(layers.config(), layers.values, card).unsaved == 3
    with pytest.raises(InvalidQuantity, match="measurements in no backup is '?3'?"):
        erased(card)


def test_a_plan_says_what_goes_and_what_is_left_and_takes_nothing(card: Path) -> None:
    before, layers = contents(card), read_layers(layer_files(card))
    plan = plan_erasure(layers.config(), layers.values, card)
    assert contents(card) == before
    assert (plan.measurements, plan.unsaved) == (3, 3)
    assert plan.files[0] == data_of(card) / DATABASE
    assert data_of(card) / "tls/key.pem" in plan.files
    assert plan.keys == (card / "etc/tsis/webhook.secret",)
    assert not [path for path in plan.files if "calibrations" in path.parts]


def test_the_command_shows_first_and_erases_when_the_serial_number_is_said(
    disk: CutDisk, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = written(disk.mount)
    assert main(["--root", str(root), "erase"]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert shown[1] == "measurements: 3, in no backup: 3"
    assert shown[-1] == f"Nothing was erased. To do it: python -m device erase --serial {SERIAL}"
    assert main(["erase", "--serial", SERIAL, "--root", str(root)]) == 1
    assert "measurements in no backup is 3" in capsys.readouterr().err
    saved(root, tmp_path)
    assert main(["erase", "--json", "--serial", SERIAL, "--root", str(root)]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["keys"] == 1
    assert captured.err.splitlines()[-1] == "The free space was overwritten."


def test_a_probe_that_is_given_away_forgets_what_was_chosen_at_its_screen(card: Path) -> None:
    write_choices(data_of(card), ScreenChoices("de", "dark", "off"))
    layers = read_layers(layer_files(card))
    assert data_of(card) / NAME in plan_erasure(layers.config(), layers.values, card).files
