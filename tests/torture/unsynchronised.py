"""`python -m device` that brings nothing to the disk by itself: the control of `daemon_cuts.py`."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from storing import without_synchronising

if __name__ == "__main__":
    without_synchronising()
    runpy.run_module("device", run_name="__main__", alter_sys=True)
