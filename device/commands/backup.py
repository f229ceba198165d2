"""`python -m device backup`: all that this probe's card holds and no release brings back, to one file.

Exit codes: 0 ok, 1 nothing was written.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from device.care.backup import write_backup
from device.config import Config

EXAMPLES = """examples:
  mount -o umask=077 /dev/sda1 /media/stick                     first, as root: see docs/care.md
  python -m device backup /media/stick                          a new file there, while the daemon runs or not
  python -m device backup /media/stick/TSIS-0007.backup         the same by a name of your own
  python -m device --root /mnt/card backup TSIS-0007.backup     of the card of a probe that is dead
Patients' measurements are inside: keep it as you keep them. It is not encrypted.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    parser.add_argument("file", type=Path, metavar="FILE", help="the backup, a new file, or the folder of one")
    parser.add_argument(
        "--same-disk", action="store_true", help="also on the probe's own card: such a backup does not count as saved"
    )
    parser.add_argument("--json", action="store_true", help="as one JSON object")


def run(options: argparse.Namespace, config: Config) -> int:
    """Write the backup and say what is in it; return the exit code, or raise what kept it from being written."""

    def told(step: str) -> None:
        print(step, file=sys.stderr, flush=True)

    report = write_backup(config, options.file, options.root, same_disk=options.same_disk, told=told)
    if options.json:
        print(json.dumps(asdict(report)))
        return 0
    size_mb = report.size_bytes / 1e6
    print(
        f"{report.path}: {report.measurements} measurements of {report.serial}, {report.files} files, {size_mb:.1f} MB"
    )
    for one in report.missing:
        print(f"not in it: recording {one}, which is not on the disk any more")
    for one in report.damaged:
        print(f"damaged in it: recording {one}, which is not as it was kept")
    for one in report.left_out:
        print(f"not in it: {one}, a link")
    if report.unnoted:
        print(f"a rule that waits for a backup does not know of this one: {report.unnoted}; make it as root")
    print("Every file was read back. Patients' measurements are inside: keep it as you keep them.")
    if report.is_same_disk:
        print("It lies on the probe's own card, or in memory: it does not count as saved, and is lost with the card.")
        print("No rule deletes recordings for it. Mount another medium and make a backup there; then delete this one.")
    return 0
