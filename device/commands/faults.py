"""`python -m device faults`: every fault code with its meaning, as a listing or as the page docs/faults.md.

Exit code 0.
"""

from __future__ import annotations

import argparse
import json
from itertools import groupby

from device.fault_table import FAULTS, FaultEntry
from device.files.text_table import aligned

PAGE = """# Faults

This page answers what a fault code means, and which part it names.
Written by `python -m device faults --markdown > docs/faults.md` from the classes of `device/errors.py`.

The first digit of a code is the part. The screen shows code and title with what was measured and what to do;
a program finds the code in the status, in a press, and in a problem document (RFC 9457), with the HTTP status below.
A fault keeps the probe from measuring, or ends a press.
A warning is kept with the press and its measurement,
but for those of certificates (E021, E022), archive and webhook (E030 to E032, E818).
A lasting one is shown until what it tells of is over, or the daemon is started again.
[The simulated probe](simulated_probe.md) says how a fault is provoked and how the device knows of it.
"""
HEADER = "| code | title | what it means | severity | status |\n|---|---|---|---|---|\n"


def markdown() -> str:
    """Return the page of all faults, docs/faults.md."""
    lines = [PAGE]
    for part, faults in groupby(FAULTS, key=lambda fault: fault.part):
        lines += [f"\n## {part}\n\n", HEADER, *map(_row, faults)]
    return "".join(lines)


def _row(fault: FaultEntry) -> str:
    severity = f"lasting {fault.severity}" if fault.is_lasting else fault.severity
    return f"| {fault.code} | {fault.title} | {fault.meaning} | {severity} | {fault.status} |\n"


EXAMPLES = """examples:
  python -m device faults                          every code with title and meaning
  python -m device faults --markdown               the page docs/faults.md
"""
COLUMNS = ("code", "part", "title", "severity", "meaning")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="as one JSON list")
    form.add_argument("--markdown", action="store_true", help="the page docs/faults.md")


def run(options: argparse.Namespace) -> int:
    """Print the table of faults; return the exit code."""
    if options.markdown:
        print(markdown(), end="")
    elif options.json:
        print(json.dumps([fault.as_record() for fault in FAULTS]))
    else:
        rows = [(fault.code, fault.part, fault.title, fault.severity, fault.meaning) for fault in FAULTS]
        print("\n".join(aligned([COLUMNS, *rows])))
    return 0
