"""The same updater behind three doors: root's command, the ssh account's stream, the folder incoming."""

import os
import subprocess
import sys
from contextlib import contextmanager
from threading import Event, Thread

import pytest
from small_release import release_file, signer, small_files
from updated_probe import IMPATIENT, QUICK

from device.errors import BusyError, UnfitRelease, UpdateFailed
from device.update.follow import FollowLimits, follow, receive, request_roll_back
from device.update.incoming import Upload, clear_incoming, take_uploaded
from device.update.progress import UpdateProgress, read_progress


@contextmanager
def path_unit(probe):
    """What tsis-update.path does: start the updater when something lies in incoming."""
    ended = Event()

    def watch():
        while not ended.wait(0.02):
            if probe.layout.uploaded.exists() or probe.layout.roll_back_request.exists():
                probe.run("watch-incoming")

    thread = Thread(target=watch)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def received(probe, content):
    """Run the forced ssh command."""
    command = [sys.executable, "-S", "-m", "device.update", "--root", str(probe.root), *QUICK, "receive"]
    known = {"env": probe.environment, "capture_output": True, "timeout": 60, "cwd": probe.folder}
    return subprocess.run(command, input=content, **known)


def test_a_release_on_a_stream_is_installed_and_its_progress_told(probe):
    with path_unit(probe):
        done = received(probe, probe.write("1.0", 10).read_bytes())
    lines = done.stdout.decode().splitlines()
    assert (done.returncode, done.stderr) == (0, b"")
    assert lines[-1] == "100% 1.0+10 committed"
    assert probe.require_whole() == "1.0+10"
    assert list(probe.layout.incoming.iterdir()) == []
    assert not probe.layout.taken.exists()


@pytest.mark.parametrize(
    ("behaviour", "cut", "said"),
    [
        ({"dies_after": 1}, None, b"E013 1.1+11 was left: It was ready, and then"),
        ({}, 9000, b"E010 The release file ends"),
    ],
)
def test_what_is_refused_or_left_ends_the_stream_with_its_reason(probe, behaviour, cut, said):
    probe.install("1.0", 10)
    with path_unit(probe):
        done = received(probe, probe.write("1.1", 11, behaviour).read_bytes()[:cut])
    assert done.returncode == 1
    assert done.stderr.startswith(said)
    assert probe.require_whole() == "1.0+10"
    assert list(probe.layout.incoming.iterdir()) == []


def test_an_operator_goes_back_and_forth_between_two_releases(probe):
    probe.install("1.0", 10)
    probe.install("1.1", 11)
    for wanted, other in (("1.0+10", "1.1+11"), ("1.1+11", "1.0+10")):
        with path_unit(probe):
            follow(probe.layout, request_roll_back(probe.layout), lambda moment: None)
        assert probe.require_whole() == wanted == probe.layout.linked(probe.layout.updater)
        assert (probe.state.previous, probe.state.floor, probe.state.bad) == (other, 11, {})
        assert not probe.layout.roll_back_request.exists()


def test_without_a_previous_release_the_way_back_is_refused_and_the_wish_is_gone(probe):
    probe.install("1.0", 10)
    with path_unit(probe), pytest.raises(UnfitRelease, match="no previous release"):
        follow(probe.layout, request_roll_back(probe.layout), lambda moment: None)
    assert probe.require_whole() == "1.0+10"


def test_the_way_back_from_a_daemon_that_is_dead_asks_only_for_answers_and_store(probe):
    probe.install("1.0", 10, {"faults": {"camera": "E101", "force": "E304"}})
    probe.install("1.1", 11, {"faults": {"camera": "E101", "force": "E304"}})
    probe.stop()
    assert probe.run("roll-back").returncode == 0
    assert probe.require_whole() == "1.0+10"


def test_a_way_back_to_a_release_that_cannot_answer_comes_forth_again(probe):
    probe.install("1.0", 10)
    probe.install("1.1", 11)
    behaviour = next(probe.layout.release("1.0+10").glob("lib/*/site-packages/tsis_fake.json"))
    behaviour.write_text('{"faults": {"store": "E601"}}')
    done = probe.run(*IMPATIENT, "roll-back")
    assert (done.returncode, "store is not ready (E601)" in done.stderr) == (1, True)
    assert probe.current == "1.1+11"
    assert (probe.state.committed, probe.state.previous, probe.state.bad) == ("1.1+11", "1.0+10", {})
    assert probe.releases() == ["1.0+10", "1.1+11"]


def test_a_fault_from_before_is_not_held_against_a_release_and_another_one_is(probe):
    probe.install("1.0", 10, {"faults": {"camera": "E101"}})
    probe.install("1.1", 11, {"faults": {"camera": "E101"}})
    done = probe.run(*IMPATIENT, "install", probe.write("1.2", 12, {"faults": {"camera": "E104"}}))
    assert "camera is not ready (E104)" in done.stderr
    done = probe.run(*IMPATIENT, "install", probe.write("1.3", 13, {"faults": {"camera": "E101", "light": "E201"}}))
    assert "light is not ready (E201)" in done.stderr
    assert probe.require_whole() == "1.1+11"


@pytest.mark.parametrize("part", ["answers", "store"])
def test_answers_and_store_have_to_be_ready_though_they_were_not_before(probe, part):
    probe.install("1.0", 10)
    behaviour = next(probe.layout.release("1.0+10").glob("lib/*/site-packages/tsis_fake.json"))
    behaviour.write_text(f'{{"faults": {{"{part}": "E401"}}}}')
    probe.start_machine()
    done = probe.run(*IMPATIENT, "install", probe.write("1.1", 11, {"faults": {part: "E401"}}))
    assert f"{part} is not ready (E401)" in done.stderr


def test_the_same_release_again_changes_nothing_and_is_no_failure(probe):
    probe.install("1.0", 10)
    before = probe.snapshot()
    done = probe.run("install", probe.write("1.0", 10))
    assert done.returncode == 0, done.stderr
    assert probe.snapshot() == before


def test_a_committed_release_exchanges_the_keys_and_one_that_is_left_does_not(probe, keys):
    both = signer(keys["good"]) + signer(keys["next"])
    probe.install("1.0", 10, signers=both)
    assert probe.layout.signers.read_text() == both
    left = probe.keep(release_file(keys["next"], "1.1", 11, {"dies_after": 1}, signers=signer(keys["evil"])))
    assert probe.run("install", left).returncode == 1
    assert probe.layout.signers.read_text() == both
    last = probe.keep(release_file(keys["next"], "1.2", 12, signers=signer(keys["next"])))
    assert probe.run("install", last).returncode == 0
    old = probe.run("install", probe.write("1.3", 13))
    assert old.stderr.startswith("E010 The release is not signed by a key that this probe trusts")
    assert probe.run("roll-back").returncode == 0
    assert probe.layout.signers.read_text() == signer(keys["next"])


def test_a_first_release_that_fails_leaves_a_system_as_fresh_as_before(probe):
    done = probe.run("install", probe.write("1.0", 10, {"dies_after": 1}))
    assert done.returncode == 1
    assert (probe.current, probe.releases(), probe.state.committed, probe.state.bad) == (None, [], None, {})
    probe.install("1.0", 10)


def test_a_systemd_that_refuses_is_a_failed_step_and_not_the_releases_fault(probe):
    probe.install("1.0", 10)
    (probe.folder / "refused").write_text("stop")
    done = probe.run("install", probe.write("1.1", 11))
    assert done.stderr.startswith("E013 1.1+11 was left: A step failed: systemctl stop tsis.service failed: Failed")
    (probe.folder / "refused").unlink()
    assert (probe.require_whole(), probe.state.bad) == ("1.0+10", {})
    probe.install("1.1", 11)


def test_a_release_whose_data_the_present_one_could_not_read_is_refused(probe):
    probe.install("1.0", 10)
    writes_new = probe.write("1.1", 11, data_schemas={"store": {"writes": 2, "reads": [1, 2]}})
    done = probe.run("install", writes_new)
    assert "writes measurements of schema 2; 1.0+10, which would come back if it fails, reads 1" in done.stderr
    probe.install("1.2", 12, data_schemas={"store": {"writes": 1, "reads": [1, 2]}})
    probe.install("1.3", 13, data_schemas={"store": {"writes": 2, "reads": [1, 2]}})


def test_a_release_that_cannot_read_the_data_that_are_there_is_refused(probe):
    data = probe.root / "srv/probe"
    data.mkdir(parents=True)
    (probe.root / "etc/tsis/config.d").mkdir()
    (probe.root / "etc/tsis/config.d/data.toml").write_text('data = "/srv/probe"\n')
    (data / "tsis.sqlite").write_bytes(b"SQLite format 3\0" + bytes(44) + (3).to_bytes(4, "big") + bytes(36))
    done = probe.run("install", probe.write("1.0", 10))
    assert done.stderr.startswith("E011 The release reads measurements of schema 1, and this probe's have 3.")


def test_one_update_at_a_time(probe):
    with probe.layout.lock.open("w") as held:
        import fcntl

        fcntl.flock(held, fcntl.LOCK_EX)
        done = probe.run("install", probe.write("1.0", 10))
    assert done.stderr.startswith("E801 Another update is under way.")


def test_a_second_upload_is_refused_while_one_waits_and_leaves_nothing(probe):
    first, second = Upload(probe.layout), Upload(probe.layout)
    for upload in (first, second):
        upload.write(b"content")
    first.hand_over()
    with pytest.raises(BusyError):
        second.hand_over()
    with pytest.raises(BusyError):
        Upload(probe.layout)
    assert [path.name for path in probe.layout.incoming.iterdir()] == ["update.release"]


def test_an_upload_under_way_is_kept_and_one_whose_sender_is_gone_is_removed(probe):
    under_way = Upload(probe.layout)
    kept = list(probe.layout.incoming.iterdir())
    (probe.layout.incoming / ".upload-old").write_bytes(b"half")
    clear_incoming(probe.layout)
    assert list(probe.layout.incoming.iterdir()) == kept
    under_way.abandon()
    assert list(probe.layout.incoming.iterdir()) == []


def test_a_stream_that_does_not_fit_leaves_nothing(probe, monkeypatch):
    class Endless:
        def read(self, size):
            return bytes(size)

    monkeypatch.setattr("device.update.incoming.MOST_BYTES", 2**20)
    with pytest.raises(UpdateFailed, match="more than 1048576 bytes"):
        receive(probe.layout, Endless())
    assert list(probe.layout.incoming.iterdir()) == []


def test_what_nobody_takes_is_withdrawn_and_said(probe):
    limits = FollowLimits(taken_s=0.3)
    path = probe.write("1.0", 10)
    with path.open("rb") as file:
        name = receive(probe.layout, file)
    with pytest.raises(UpdateFailed, match="Nobody takes what was asked for"):
        follow(probe.layout, name, lambda moment: None, limits)
    with pytest.raises(UpdateFailed, match="Nobody takes what was asked for"):
        follow(probe.layout, request_roll_back(probe.layout), lambda moment: None, limits)
    assert list(probe.layout.incoming.iterdir()) == []


@pytest.mark.parametrize("kind", ["link", "folder", "pipe"])
def test_what_a_stranger_puts_into_incoming_is_refused_and_removed(probe, kind):
    probe.install("1.0", 10)
    path = probe.layout.uploaded
    {"link": lambda: path.symlink_to("/etc/shadow"), "folder": path.mkdir, "pipe": lambda: os.mkfifo(path)}[kind]()
    assert probe.run("watch-incoming").returncode == 0
    assert (probe.progress.state, probe.progress.code) == ("refused", "E010")
    assert list(probe.layout.incoming.iterdir()) == []
    assert not take_uploaded(probe.layout)


def test_a_file_whose_sender_changes_it_while_it_is_installed_is_refused(probe, monkeypatch):
    from device.errors import UntrustedRelease
    from device.update import install as steps
    from device.update.progress import ProgressReport
    from device.update.trial import Updater

    content = small_files("1.0") | {"systemd/large": os.urandom(100_000)}  # what is small stays in the reader's buffer
    path, checked = probe.write("1.0", 10, content=content), steps.require_space

    def change(layout, plan):
        checked(layout, plan)
        with path.open("r+b") as file:
            place = file.read()
            file.seek(place.rindex(b"systemd/large") + 1000)
            file.write(b"evil")

    monkeypatch.setattr(steps, "require_space", change)
    with pytest.raises(UntrustedRelease, match="is damaged: its SHA-256 is not the manifest's"):
        steps.install(Updater(probe.layout, ProgressReport(probe.layout)), path)
    assert probe.releases() == []


def test_the_progress_of_nothing_is_idle_and_a_moment_comes_back_as_it_was_told(probe):
    assert read_progress(probe.layout) == UpdateProgress()
    for broken in (b"", b"[]", b'{"schema": "other/1"}', b"\xff"):
        probe.layout.progress.write_bytes(broken)
        assert read_progress(probe.layout).state == "idle"


def test_the_status_tells_what_runs_and_whether_it_is_whole(probe):
    probe.install("1.0", 10)
    assert probe.run("status").stdout.startswith("current 1.0+10, committed 1.0+10, previous None, floor 10\n")
    said = probe.said()
    assert (said["schema"], said["current"], said["state"]["committed"]) == ("tsis.update_status/1", "1.0+10", "1.0+10")
    assert probe.run("status", "--verify").returncode == 0
    folder = probe.layout.release("1.0+10")
    (folder / "sbom.json").write_bytes(b"")
    (folder / "extra").write_bytes(b"")
    (folder / "pyvenv.cfg").unlink()
    done = probe.run("status", "--verify")
    assert done.returncode == 1
    for problem in ("sbom.json has changed", "extra is not listed", "pyvenv.cfg is missing"):
        assert problem in done.stdout


def test_the_daemons_modules_are_compiled_for_their_place_and_found_by_its_interpreter(probe):
    probe.install("1.0", 10)
    folder = probe.layout.release("1.0+10")
    assert os.readlink(folder / "bin/python") == "/usr/bin/python3"
    packages = next(folder.glob("lib/python3.*/site-packages"))
    assert (packages / "tsis_pure.py").is_file()
    assert not list(folder.rglob("scripts"))
    for module in packages.rglob("*.py"):
        compiled = next((module.parent / "__pycache__").glob(f"{module.stem}.*.pyc")).read_bytes()
        assert compiled[4:8] == b"\1\0\0\0", module  # by hash, unchecked
        assert str(folder).encode() in compiled, module
    assert {oct(path.stat().st_mode & 0o777) for path in packages.rglob("*.py")} == {"0o644"}


def test_root_is_asked_for_where_only_root_can(probe, monkeypatch, capsys):
    from device.update.__main__ import main

    monkeypatch.setattr(os, "access", lambda path, mode: False)
    assert main(["--root", str(probe.root), "resume"]) == 1
    assert "resume is root's" in capsys.readouterr().err


def test_whoever_is_not_root_hands_the_file_over(probe, monkeypatch, capsys):
    from device.update.__main__ import main

    path = probe.write("1.0", 10)
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with path_unit(probe):
        assert main(["--root", str(probe.root), "install", str(path)]) == 0
    assert capsys.readouterr().out.endswith("100% 1.0+10 committed\n")
    assert main(["--root", str(probe.root), "install", str(path) + "x"]) == 1
    assert "cannot be read" in capsys.readouterr().err


def test_a_way_back_that_is_asked_for_while_the_updater_goes_back_is_that_one_and_no_second(probe):
    """Whoever presses the button of a release that does not start means the one before it, not the one before that."""
    probe.install("1.0", 10)
    probe.install("1.1", 11)
    bad = probe.write("1.2", 12, {"faults": {"answers": None}})
    bad.rename(probe.layout.uploaded)
    with_request = {**probe.environment, "TSIS_FAKE_ON_START": f"touch {probe.layout.roll_back_request}"}
    done = probe.run(*IMPATIENT, "watch-incoming", env=with_request)
    assert done.returncode == 0, done.stderr
    assert probe.require_whole() == probe.state.committed == "1.1+11"
    assert not probe.layout.roll_back_request.exists()


def test_a_reader_that_is_gone_stops_no_update(probe):
    """As a terminal that was closed: what cannot be printed is not printed."""
    file = probe.write("1.0", 10)
    reading, writing = os.pipe()
    os.close(reading)
    try:
        probe.run("install", file, capture_output=False, stdout=writing, stderr=subprocess.DEVNULL)
    finally:
        os.close(writing)
    assert probe.require_whole() == probe.state.committed == "1.0+10"


def test_who_may_not_write_the_folder_is_told_who_may(probe, monkeypatch):
    def refused(path):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(type(probe.layout.uploaded), "exists", refused)
    with pytest.raises(UpdateFailed, match="Use sudo, or an account of the group tsis-update"):
        Upload(probe.layout)
