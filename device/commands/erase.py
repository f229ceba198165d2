"""`python -m device erase`: overwrite the measurements and the keys of a probe that is given away.

Exit codes: 0 shown or erased, 1 refused or failed.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from device.care.erase import ErasurePlan, ErasureReport, erase, plan_erasure
from device.config import Config

EXAMPLES = """examples:
  python -m device erase                                 what would be erased, and what would be left
  sudo systemctl stop tsis
  sudo /opt/tsis/current/bin/python -m device erase --serial TSIS-0007
Nothing brings back what is erased but a backup. What a program cannot reach on a card is in docs/care.md.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    parser.add_argument("--serial", metavar="SERIAL", help="erase this very probe; without it, only show what would go")
    parser.add_argument("--also-unsaved", action="store_true", help="also measurements that no backup holds")
    parser.add_argument("--json", action="store_true", help="as one JSON object")


def run_erase_command(options: argparse.Namespace, config: Config, stated: Mapping[str, Any]) -> int:
    """Show or erase; return the exit code, or raise what keeps it from it. `stated` is what the settings files say."""
    if options.serial is None:
        plan = plan_erasure(config, stated, options.root)
        _print(options, asdict(plan), _planned(plan))
        return 0

    def told(step: str) -> None:
        print(step, file=sys.stderr, flush=True)

    report = erase(config, stated, options.root, serial=options.serial, also_unsaved=options.also_unsaved, told=told)
    _print(options, asdict(report), _reported(report))
    return 0


def _print(options: argparse.Namespace, record: dict[str, Any], lines: list[str]) -> None:
    print(json.dumps(record, default=_text) if options.json else "\n".join(lines))


def _text(value: object) -> str:
    assert isinstance(value, Path)
    return str(value)


def _planned(plan: ErasurePlan) -> list[str]:
    unsaved = "unknown" if plan.unsaved is None else plan.unsaved
    return [
        f"{plan.data} of {plan.serial}: {len(plan.files)} files, {plan.size_bytes / 1e6:.1f} MB, would be erased",
        f"measurements: {'unknown' if plan.measurements is None else plan.measurements}, in no backup: {unsaved}",
        *(f"key: {path}" for path in plan.keys),
        *(f"left: {what}" for what in plan.left),
        f"Nothing was erased. To do it: python -m device erase --serial {plan.serial}",
    ]


def _reported(report: ErasureReport) -> list[str]:
    lines = [
        f"{report.serial}: {report.files} files and {report.keys} keys overwritten, "
        f"{report.overwritten_bytes / 1e6:.1f} MB, and {report.free_bytes / 1e6:.1f} MB of free space",
    ]
    if report.unreached_bytes:
        lines.append(f"not overwritten: {report.unreached_bytes / 1e6:.1f} MB of free space that the disk keeps back")
    lines.append(
        "The free space was offered to the card." if report.trimmed else "The card takes no offer of free space."
    )
    return [*lines, *(f"left: {what}" for what in report.left)]
