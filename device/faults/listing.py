"""`python -m device faults`: every fault code with its meaning. Exit code 0."""

from __future__ import annotations

import argparse
import json
from typing import Any

from device.faults.page import markdown
from device.faults.table import FAULTS
from device.text_table import aligned

EXAMPLES = """examples:
  python -m device faults                          every code with title and meaning
  python -m device faults --markdown               the page docs/faults.md
"""
COLUMNS = ("code", "part", "title", "severity", "meaning")


def add_faults_command(commands: Any) -> None:
    """Add `faults` to the daemon's commands."""
    faults = commands.add_parser(
        "faults", help="list the fault codes", epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    form = faults.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="as one JSON list")
    form.add_argument("--markdown", action="store_true", help="the page docs/faults.md")


def run_faults_command(options: argparse.Namespace) -> int:
    """Print the table of faults; return the exit code."""
    if options.markdown:
        print(markdown(), end="")
    elif options.json:
        print(json.dumps([fault.as_record() for fault in FAULTS]))
    else:
        rows = [(fault.code, fault.part, fault.title, fault.severity, fault.meaning) for fault in FAULTS]
        print("\n".join(aligned([COLUMNS, *rows])))
    return 0
