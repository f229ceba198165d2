"""What a program needs, told apart from what the machine keeps it waiting for."""

from __future__ import annotations

import os
import subprocess
from typing import Any


def ended_cpu_s(process: subprocess.Popen[Any]) -> float:
    """Wait for a child; return the processor's time (s) that it and its own children took, and set its exit code."""
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime
