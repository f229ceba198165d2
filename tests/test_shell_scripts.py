"""Every shell script of the project, as shellcheck reads it, and that what it starts begins in its environment."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from daemon_process import ROOT

FOLDERS = (".ci", "tests", "systemd")
SCRIPTS = sorted(
    path
    for folder in FOLDERS
    for path in (ROOT / folder).rglob("*")
    if path.is_file() and path.read_bytes()[:2] == b"#!" and b"sh" in path.read_bytes().split(b"\n", 1)[0]
)


@pytest.mark.skipif(
    not shutil.which("shellcheck") and "TSIS_REQUIRE_PEERS" not in os.environ,  # there its absence is a failure
    reason="shellcheck is not installed",
)
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_shellcheck_has_no_complaint(script: Path) -> None:
    checked = subprocess.run(["shellcheck", str(script)], capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stdout


def test_the_scripts_are_found() -> None:
    assert {".ci/run", "tests/systemd/run.sh"} <= {str(path.relative_to(ROOT)) for path in SCRIPTS}


def test_the_stories_of_a_deployment_begin_without_a_word() -> None:
    """In the environment of tests/deploy/run.sh; a PYTHONPATH to the units' sitecustomize.py made Python complain."""
    call = re.search(r'^PYTHONPATH="(.+)" .* -m stories', (ROOT / "tests/deploy/run.sh").read_text(), re.MULTILINE)
    assert call
    path = call[1].replace("$here", str(ROOT / "tests/deploy")).replace("$project", str(ROOT))
    begun = [sys.executable, "-c", "import stories; stories.Claim"]
    said = subprocess.run(
        begun, cwd=ROOT, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=False
    )
    assert (said.returncode, said.stdout, said.stderr) == (0, "", "")
