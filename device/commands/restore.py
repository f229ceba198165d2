"""`python -m device restore`: a backup back to a new card, or only its measurements to another probe.

Exit codes: 0 ok, 1 refused or failed: then no measurement of the backup is there yet.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from device.care.restore import check_backup, restore_backup
from device.files.file_reader import daemon_reader
from device.files.plain_settings import layer_files
from device.settings.layers import read_layers
from device.settings.named_files import unreadable_files

EXAMPLES = """examples:
  python -m device restore --check TSIS-0007.backup     read every byte, and say what is inside
  sudo systemctl stop tsis
  sudo /opt/tsis/current/bin/python -m device restore TSIS-0007.backup
  python -m device restore --records-only OTHER.backup  the measurements of another probe, not its settings
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    parser.add_argument("file", type=Path, metavar="FILE", help="the backup")
    parser.add_argument("--check", action="store_true", help="only read it, and say what is inside")
    parser.add_argument(
        "--records-only", action="store_true", help="measurements and recordings, also of another probe"
    )
    parser.add_argument("--json", action="store_true", help="as one JSON object")


def run_restore_command(options: argparse.Namespace, own: Mapping[str, Any]) -> int:
    """Check or restore; return the exit code, or raise what is wrong. `own` is what this machine's settings say."""
    if options.check:
        facts = check_backup(options.file)
        told = "\n".join(f"{name:20} {value}" for name, value in facts.items())
        print(json.dumps(facts) if options.json else f"{told}\nEvery file in it is whole.")
        return 0
    report = restore_backup(options.file, own, options.root, records_only=options.records_only)
    reader, values = daemon_reader(), read_layers(layer_files(options.root, options.config)).values
    unreadable = unreadable_files(values, reader, options.root)
    if options.json:
        print(json.dumps({**asdict(report), "unreadable": [one.as_record() for one in unreadable]}))
        return 0
    print(f"{report.data}: {report.measurements} measurements of {report.serial}, as of {report.made_at}")
    for path in report.kept_aside:
        print(f"what stood in its place lies in {path}")
    if unreadable:
        print("No backup holds certificates, keys and secrets of the network. Bring these first:")
        print("\n".join([*map(str, unreadable), *([reader.note] if reader.note else [])]))
    print("Start the daemon: systemctl start tsis.")
    return 0
