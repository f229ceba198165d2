"""`python -m device dicom`: whether the hospital's archive and worklist are there, and what is ordered.

Exit codes: 0 ok, 1 one of them does not answer, 2 usage, 3 none is set.
"""

from __future__ import annotations

import argparse
import json
import sys
from datetime import date

from device.config import Config

EXAMPLES = """examples:
  python -m device dicom echo            does the archive answer, and the worklist
  python -m device dicom worklist --day 2026-11-23
What was sent, and what waits: GET /api/v1/dicom of the running daemon.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    echo = actions.add_parser("echo", help="ask archive and worklist whether they are there (C-ECHO)")
    worklist = actions.add_parser("worklist", help="print what is ordered, patients' names included")
    worklist.add_argument("--day", type=date.fromisoformat, metavar="YYYY-MM-DD", help="of this day alone")
    for action in (echo, worklist):
        action.add_argument("--json", action="store_true", help="as JSON")


def run(options: argparse.Namespace, config: Config) -> int:
    """Ask what the settings name; return the exit code, or raise `ArchiveUnreachable` when the worklist is silent."""
    return _worklist(options, config) if options.action == "worklist" else _echo(options, config)


def _worklist(options: argparse.Namespace, config: Config) -> int:
    from device.dicom.association import worklist_of
    from device.dicom.worklist import WorklistQuery, scheduled_steps

    remote = worklist_of(config.dicom)
    if remote is None:
        print("No worklist is set: set dicom.worklist_host.", file=sys.stderr)
        return 3
    steps = [one.as_record() for one in scheduled_steps(remote, config.dicom, WorklistQuery(options.day))]
    if options.json:
        print(json.dumps(steps))
        return 0
    for one in steps:
        patient = ("patient_ref", "patient_issuer", "patient_name")
        told = (one[name] for name in ("scheduled_at", *patient, "order_number", "description"))
        print("  ".join(told))
    print(f"{len(steps)} steps")
    return 0


def _echo(options: argparse.Namespace, config: Config) -> int:
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
            print(f"{remote}: {'{code} {cause} {remedy}'.format(**fault_told) if fault_told else 'answers'}")
    if options.json:
        print(json.dumps({what: {"answers": fault is None, "fault": fault} for what, fault in answers.items()}))
    return 1 if any(answers.values()) else 0
