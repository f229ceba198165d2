"""What a daemon that does not start leaves behind for those who say so."""

import json
import os

import pytest

from device.errors import CameraError, ConfigError
from device.files.start_note import NOTE, clear_note, read_note, write_note

REFUSED = ConfigError("a is 3.", "Correct it."), CameraError("No camera.", "Plug it in.")
FAULTS = [fault.as_record() for fault in REFUSED]


@pytest.fixture
def root(tmp_path):
    (tmp_path / NOTE).parent.mkdir(parents=True)
    (tmp_path / "opt/tsis").mkdir(parents=True)
    (tmp_path / "opt/tsis/current").symlink_to("releases/0.2.0+7")
    return tmp_path


def test_every_fault_is_there_with_the_process_and_its_release(root):
    write_note(root, FAULTS)
    note = read_note(root)
    assert (note.pid, note.release) == (os.getpid(), "0.2.0+7")
    assert note.faults == tuple(FAULTS)


def test_a_start_that_succeeds_leaves_none(root):
    write_note(root, FAULTS)
    clear_note(root)
    assert read_note(root) is None
    clear_note(root)


def test_where_there_is_no_folder_nothing_is_written(tmp_path):
    write_note(tmp_path, FAULTS)
    clear_note(tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "null",
        '{"schema": "tsis.start/2"}',
        json.dumps({"schema": "tsis.start/1", "pid": 1, "release": "", "faults": []}),
        json.dumps({"schema": "tsis.start/1", "pid": 1, "release": "", "faults": [{"code": "E001"}]}),
        json.dumps({"schema": "tsis.start/1", "pid": "x", "release": "", "faults": [FAULTS[0]]}),
    ],
)
def test_a_note_that_cannot_be_read_is_none(root, text):
    (root / NOTE).write_text(text)
    assert read_note(root) is None
