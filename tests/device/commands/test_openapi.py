"""The verb prints the document and says when a file is another."""

import json

from daemon_process import ROOT

from device.__main__ import main


def test_the_document_is_printed_and_is_the_committed_one(capsys, tmp_path):
    assert main(["openapi"]) == 0
    printed = capsys.readouterr().out
    assert json.loads(printed)["info"]["title"] == "TSIS probe"
    (tmp_path / "openapi.json").write_text(printed)
    assert main(["openapi", "--check", str(tmp_path / "openapi.json")]) == 0
    assert main(["openapi", "--check", str(ROOT / "docs" / "openapi.json")]) == 0


def test_a_file_that_is_another_is_named_with_what_to_do(capsys, tmp_path):
    (tmp_path / "openapi.json").write_text("{}\n")
    assert main(["openapi", "--check", str(tmp_path / "openapi.json")]) == 1
    said = capsys.readouterr()
    assert f"python -m device openapi > {tmp_path / 'openapi.json'}" in said.err
    assert said.out == ""
    assert main(["openapi", "--check", str(tmp_path / "none.json")]) == 1
