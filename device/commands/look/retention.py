"""`python -m device retention`: which recordings the settings' rule deletes now. It deletes nothing: the daemon does.

Exit code 0.
"""

from __future__ import annotations

import argparse
import json
from contextlib import closing

from device.config import Config
from device.files.text_table import aligned
from device.instrument.watch.recordings_watch import retention_rule
from device.records.retention import RetentionPlan
from device.records.store import Store

EXAMPLES = """examples:
  python -m device retention                       what would be deleted, and why
  python -m device retention --json
The rule is in the settings: retention.keep_days, retention.free_mb, retention.saved_first. Without one nothing is ever
deleted. The daemon follows it once an hour; numbers and audit stay.
"""
COLUMNS = ("taken at", "recording", "MB", "why")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    parser.add_argument("--dry-run", action="store_true", help="only show it, which is what this does anyway")
    parser.add_argument("--json", action="store_true", help="as one JSON object")


def run(options: argparse.Namespace, config: Config) -> int:
    """Print the plan; return the exit code, or raise what keeps the store from being read."""
    with closing(Store(config.data, to_read=True)) as store:
        plan = store.retention.plan(retention_rule(config))
    if options.json:
        print(json.dumps(plan.as_record()))
        return 0
    rows = [(one.taken_at, one.recording_id, f"{one.size_bytes / 1e6:.1f}", one.why) for one in plan.removals]
    if rows:
        print("\n".join(aligned([COLUMNS, *rows])))
    print(_told(plan))
    return 0


def _told(plan: RetentionPlan) -> str:
    if not plan.rule.is_any:
        return "No rule: nothing is ever deleted. See retention in docs/settings.md."
    size_mb = sum(one.size_bytes for one in plan.removals) / 1e6
    saved = f"the last backup is of {plan.saved_at}" if plan.saved_at else "no backup is known"
    return f"{len(plan.removals)} recordings of {size_mb:.1f} MB go; {plan.held_back} wait for a backup; {saved}."
