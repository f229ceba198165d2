"""The table of faults as the page docs/faults.md."""

from __future__ import annotations

from itertools import groupby

from device.faults.table import FAULTS, Fault

PAGE = """# Faults

Written by `python -m device faults --markdown > docs/faults.md` from the classes of `device/errors.py`.

The first digit of a code is the part. The screen shows code and title with what was measured and what to do;
a program finds the code in the status, in a press, and in a problem document (RFC 9457), with the HTTP status below.
A fault keeps the probe from measuring, or ends a press; a warning is kept with the press and its measurement,
and a lasting one is shown until the daemon is started again.
[The simulated probe](simulated_probe.md) says how a fault is provoked and how the device knows of it.
"""
HEADER = "| code | title | what it means | severity | status |\n|---|---|---|---|---|\n"


def markdown() -> str:
    """Return the page of all faults, docs/faults.md."""
    lines = [PAGE]
    for part, faults in groupby(FAULTS, key=lambda fault: fault.part):
        lines += [f"\n## {part}\n\n", HEADER, *map(_row, faults)]
    return "".join(lines)


def _row(fault: Fault) -> str:
    severity = f"lasting {fault.severity}" if fault.is_lasting else fault.severity
    return f"| {fault.code} | {fault.title} | {fault.meaning} | {severity} | {fault.status} |\n"
