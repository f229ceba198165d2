"""`python -m device audit verify`: whether the audit is as it was written, also while a daemon writes it."""

from __future__ import annotations

import argparse
import json
import sqlite3
from contextlib import closing
from pathlib import Path

from device.config import Config
from device.errors import AuditChanged, StorageError
from device.records.audit import AuditHead, require_head, verify_chain

BUSY_S = 10.0
EXAMPLES = """examples:
  python -m device audit verify                         every entry; the first row that was changed is named
  python -m device audit verify --head 1204:9f2c...     also that the chain went through a hash kept elsewhere
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what may be asked of the audit."""
    parser.epilog = EXAMPLES
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    verify = actions.add_parser("verify", help="go through the chain of hashes from its first entry")
    verify.add_argument("--head", metavar="SEQ:HASH", help="what this command, or the journal, said before")
    verify.add_argument("--json", action="store_true", help="print a JSON object")


def run_audit_command(options: argparse.Namespace, config: Config) -> int:
    """Say how far the chain goes, or which row was changed; return 0, or 1 when one was."""
    try:
        head = verified(config.data, options.head)
    except AuditChanged as change:
        print(json.dumps({"whole": False, **change.as_record()}) if options.json else change)
        return 1
    if options.json:
        print(json.dumps({"whole": True, "entries": head.seq, "head": str(head)}))
    else:
        print(f"The audit is whole: {head.seq} entries.\nKeep its head elsewhere: {head}")
    return 0


def verified(folder: Path, head: str | None = None) -> AuditHead:
    """Return how far the chain of a data folder goes; raise `AuditChanged`, or `StorageError` without a database."""
    database = folder / "tsis.sqlite"
    try:
        with closing(sqlite3.connect(f"{database.resolve().as_uri()}?mode=ro", uri=True, timeout=BUSY_S)) as db:
            found = verify_chain(db)
            if head:
                require_head(db, head)
    except sqlite3.Error as error:
        remedy = "Name the data folder by the setting `data`; an older release's is chained by the next start."
        raise StorageError(f"The audit of {database} cannot be read: {error}.", remedy) from error
    return found
