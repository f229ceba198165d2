"""`python -m device faults` as typed: a table for people, JSON for programs, and the committed page."""

import json

import pytest
from daemon_process import ROOT

from device.__main__ import main
from device.fault_table import FAULTS


def test_the_committed_page_is_what_the_command_prints(capsys):
    """After a new fault: python -m device faults --markdown > docs/faults.md."""
    assert main(["faults", "--markdown"]) == 0
    assert capsys.readouterr().out == (ROOT / "docs" / "faults.md").read_text(encoding="utf-8")


def test_every_fault_is_a_line(capsys):
    assert main(["faults"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ["code", *(f.code for f in FAULTS)]


def test_every_fault_is_data_for_a_program(capsys):
    assert main(["faults", "--json"]) == 0
    rows = {row["code"]: row for row in json.loads(capsys.readouterr().out)}
    assert list(rows) == [fault.code for fault in FAULTS]
    assert rows["E602"] == {
        "code": "E602",
        "title": "Disk full",
        "part": "Storage",
        "meaning": "There is no space left for a measurement.",
        "severity": "fault",
        "is_lasting": False,
        "status": 507,
    }


def test_one_form_at_a_time():
    with pytest.raises(SystemExit) as usage:
        main(["faults", "--json", "--markdown"])
    assert usage.value.code == 2
