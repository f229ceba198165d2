"""`python -m device dicom`: whether the hospital's archive and worklist are there.

Exit codes: 0 ok, 1 one of them does not answer, 2 usage, 3 none is set.
"""

from __future__ import annotations

import argparse
import json
import sys

from device.config import Config

EXAMPLES = """examples:
  python -m device dicom echo            does the archive answer, and the worklist
  python -m device dicom echo --json
What was sent, and what waits: GET /api/v1/dicom of the running daemon.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    echo = actions.add_parser("echo", help="ask archive and worklist whether they are there (C-ECHO)")
    echo.add_argument("--json", action="store_true", help="as one JSON object")


def run_dicom_command(options: argparse.Namespace, config: Config) -> int:
    """Ask every program that the settings name; return the exit code."""
    from device.dicom.association import archive_of, echo, worklist_of
    from device.errors import ArchiveUnreachable

    remotes = [one for one in (archive_of(config.dicom), worklist_of(config.dicom)) if one]
    if not remotes:
        print("No archive and no worklist is set: set dicom.archive_host or dicom.worklist_host.", file=sys.stderr)
        return 3
    answers: dict[str, dict[str, str] | None] = {}
    for remote in remotes:
        try:
            echo(remote, config.dicom)
        except ArchiveUnreachable as fault:
            answers[remote.what] = fault.as_record()
        else:
            answers[remote.what] = None
        if not options.json:
            fault_told = answers[remote.what]
            print(f"{remote}: {fault_told['cause'] if fault_told else 'answers'}")
    if options.json:
        print(json.dumps({what: {"answers": fault is None, "fault": fault} for what, fault in answers.items()}))
    return 1 if any(answers.values()) else 0
