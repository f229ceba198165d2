"""`dicom echo` says which of the hospital's programs answer, with an exit code that a script reads."""

import json

import pytest
from free_port import free_port
from orthanc import TITLE, Orthanc, needs_orthanc

from device.__main__ import main

UNCLOSED = pytest.mark.filterwarnings("ignore:.*<socket.socket:pytest.PytestUnraisableExceptionWarning")


@pytest.fixture
def stated(tmp_path):
    def settings(text):
        path = tmp_path / "settings.toml"
        path.write_text(f"[dicom]\n{text}")
        return ["--config", str(path), "dicom", "echo"]

    return settings


@needs_orthanc
@UNCLOSED
def test_each_program_is_asked_and_told_by_itself(tmp_path, stated, capsys):
    archive = Orthanc(tmp_path).start()
    try:
        there = f'archive_host = "127.0.0.1"\narchive_port = {archive.port}\narchive_title = "{TITLE}"\n'
        assert main(stated(there)) == 0
        assert capsys.readouterr().out == f"archive {TITLE} at 127.0.0.1:{archive.port}: answers\n"
        assert main(stated(f'{there}worklist_host = "127.0.0.1"\nworklist_port = {free_port()}\n')) == 1
        assert "worklist WORKLIST" in capsys.readouterr().out
        assert main([*stated(f'{there}own_title = "STRANGER"\n'), "--json"]) == 1
        told = json.loads(capsys.readouterr().out)["archive"]
        assert (told["answers"], told["fault"]["code"]) == (False, "E030")
        assert "rejects STRANGER" in told["fault"]["cause"]
    finally:
        archive.close()


def test_without_any_program_it_says_which_setting_is_missing(stated, capsys):
    assert main(stated("")) == 3
    assert "dicom.archive_host" in capsys.readouterr().err
