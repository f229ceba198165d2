"""An interrupt while a module is loaded that swallows whatever is raised, and one while none is."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
INTERRUPT = "import os, signal\ntry:\n    os.kill(os.getpid(), signal.SIGINT)\nexcept:\n    pass\n"


@pytest.mark.parametrize(("begins", "code"), [("import swallows", -signal.SIGINT), (INTERRUPT, 0)])
def test_no_module_that_is_being_loaded_swallows_an_interrupt(begins, code, tmp_path):
    """What swallows one that comes later may have its reasons: there it is raised as ever."""
    (tmp_path / "swallows.py").write_text(INTERRUPT)
    words = [sys.executable, "-c", f"from host_tools import interrupts\n{begins}\nprint('goes on')"]
    ended = subprocess.run(
        words,
        env={"PYTHONPATH": f"{ROOT}:{tmp_path}"},
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert (ended.returncode, ended.stderr) == (code, "")
    assert ("goes on" in ended.stdout) == (code == 0)
