"""The toolkit's command line in a process of its own, as a researcher types it."""

import os
import subprocess
import sys

from daemon_process import ROOT


def run_toolkit(*arguments: object, cwd=ROOT) -> subprocess.CompletedProcess[str]:
    """Run `host_tools` with arguments in a wide terminal."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}
    command = [sys.executable, "-m", "host_tools", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=240)
