"""Which files that settings name the daemon's user can read, as whoever checks the machine asks for that user."""

import os
import pwd
import tempfile
from pathlib import Path

import pytest

from device.files.file_reader import DAEMON_USER, FileReader, daemon_reader
from device.settings.catalogue import SETTINGS
from device.settings.named_files import NAMED_FILES, unreadable_files

FOLDERS = ("paper_model", "quick_model", "standard_model", "calibration", "data", "updates")
KEY = Path("etc/tsis/tls/probe.key")
STATED = {"server.certificate_key": f"/{KEY}"}
only_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can ask for another user")


@pytest.fixture
def root():
    """A folder that stands for /, which other users may enter."""
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        (Path(folder) / KEY.parent).mkdir(parents=True)
        yield Path(folder)


@pytest.fixture
def put(root):
    """Put the key there with mode bits."""

    def write(mode):
        (root / KEY).write_text("key")
        (root / KEY).chmod(mode)

    return write


@pytest.fixture
def daemon(monkeypatch):
    """The daemon's user, with the account of nobody."""
    nobody = pwd.getpwnam("nobody")
    monkeypatch.setattr("device.files.file_reader.pwd.getpwnam", lambda name: nobody)
    return daemon_reader()


def problems(values, reader, root):
    return [str(one) for one in unreadable_files(values, reader, root)]


def test_every_setting_that_names_a_file_is_looked_at():
    named = {name for name, known in SETTINGS.items() if "Path" in str(known.kind)} - {*FOLDERS}
    assert named < set(NAMED_FILES) < set(SETTINGS)
    assert {name for name in NAMED_FILES if name not in named} == {
        name for name in SETTINGS if name.startswith("server.c")
    }


def test_what_is_not_there_or_a_folder_is_told_with_its_setting(root):
    reader = FileReader("ward")
    assert problems(STATED, reader, root) == [f"server.certificate_key names /{KEY}: it is not there."]
    (root / KEY).mkdir()
    assert problems(STATED, reader, root) == [f"server.certificate_key names /{KEY}: it is a folder."]
    assert problems({"server.certificate": ""}, reader, root) == []


@only_root
def test_root_is_told_what_the_daemons_user_cannot_read(root, put, daemon):
    put(0o600)
    assert (daemon.name, daemon.note) == (DAEMON_USER, "")
    told = f"server.certificate_key names /{KEY}: the user tsis cannot read it."
    assert problems(STATED, daemon, root) == [told]
    put(0o644)
    assert problems(STATED, daemon, root) == []
    (root / KEY.parent).chmod(0o700)
    assert problems(STATED, daemon, root) == [told]


@only_root
def test_a_group_that_the_daemons_user_is_in_lets_it_read(root, put, daemon):
    put(0o640)
    os.chown(root / KEY, 0, pwd.getpwnam("nobody").pw_gid)
    assert problems(STATED, daemon, root) == []


def test_a_folder_that_the_service_does_not_see_is_told(root):
    [told] = problems({"dicom.tls_key": "/home/ada/probe.key"}, FileReader(DAEMON_USER), root)
    assert told.endswith("the daemon's service does not see that folder; keep it in /etc/tsis.")


def test_where_there_is_no_such_user_it_is_said_who_has_read(monkeypatch):
    def unknown(name):
        raise KeyError(name)

    monkeypatch.setattr("device.files.file_reader.pwd.getpwnam", unknown)
    reader = daemon_reader()
    assert reader.note.startswith(f"This machine has no user tsis: read as {reader.name}")


def test_another_user_is_told_to_ask_as_root(monkeypatch):
    other = pwd.getpwnam("nobody")
    monkeypatch.setattr("device.files.file_reader.pwd.getpwnam", lambda name: other)
    monkeypatch.setattr("device.files.file_reader.os.geteuid", lambda: 12345)
    reader = daemon_reader()
    assert reader == FileReader("12345", note=reader.note)
    assert "the daemon runs as tsis: run this with sudo" in reader.note
