"""`python -m device support` as typed."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import pytest
from probe_card import write_card

from device.__main__ import main
from device.care.support_sections import SECTIONS
from device.commands.support import main as support_main


@pytest.mark.parametrize("verb", ["support", "support-bundle"])
def test_every_section_is_named_with_what_became_of_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    write_card(tmp_path / "card")
    file = tmp_path / "a.zip"
    assert main(["--root", str(tmp_path / "card"), verb, str(file)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[:-1]] == list(SECTIONS)
    assert "Look into it before you send it" in lines[-1]
    assert "summary.json" in zipfile.ZipFile(file).namelist()


def test_the_module_of_its_own_does_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_card(tmp_path / "card")
    file = tmp_path / "a.zip"
    assert support_main([str(file), "--root", str(tmp_path / "card"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["sections"]["measurements"] == "ok"
    assert file.is_file()


def test_a_file_that_cannot_be_written_is_exit_code_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--root", str(tmp_path), "support", str(tmp_path / "none/a.zip")]) == 1
    assert "cannot be written: No such file or directory" in capsys.readouterr().err
