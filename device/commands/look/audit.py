"""`python -m device audit`: whether the audit is as it was written, and what is in it, also beside a daemon."""

from __future__ import annotations

import argparse
import json
import sqlite3
from contextlib import closing
from datetime import datetime
from pathlib import Path

from device.config import Config
from device.errors import AuditChanged, StorageError
from device.files.plain_settings import is_there
from device.files.text_table import aligned
from device.measurement.quantities import require
from device.records.audit import AuditHead, recorded, require_head, verify_chain
from device.records.database import DATABASE
from device.records.listing import NEWEST, ROWS
from device.records.store import Store

BUSY_S = 10.0
MOST_SHOWN = 100
NOT_OPENED = (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM, sqlite3.SQLITE_READONLY)
"""What SQLite says of a database whose files this user may not read, or may not make beside it, as reading takes."""
PRIMARY = 0xFF
"""The bits of an SQLite error that its kinds have in common."""
COLUMNS = ("row", "at", "by", "what", "subject", "reason")
EXAMPLES = """examples:
  python -m device audit verify                         every entry; the first row that was changed is named
  python -m device audit verify --head 1204:9f2c...     also that the chain went through a hash kept elsewhere
  python -m device audit list --from 2026-11-23T08:00:00+01:00
  python -m device audit list --subject ID --json       what was done to an exam or a measurement, newest first
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what may be asked of the audit."""
    parser.epilog = EXAMPLES
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    verify = actions.add_parser("verify", help="go through the chain of hashes from its first entry")
    verify.add_argument("--head", metavar="SEQ:HASH", help="what this command, or the journal, said before")
    verify.add_argument("--json", action="store_true", help="print a JSON object")
    listed = actions.add_parser("list", help="print what was done, newest first")
    listed.add_argument("--subject", metavar="ID", help="to one exam, measurement, press or token")
    for name, what in (("from", "then on"), ("to", "before then")):
        listed.add_argument(f"--{name}", dest=name, type=_moment, metavar="TIME", help=f"{what}: 2026-11-23T08:00:00Z")
    listed.add_argument("--limit", type=int, default=MOST_SHOWN, metavar="N", help=f"{MOST_SHOWN} unless given")
    listed.add_argument("--json", action="store_true", help="print a JSON object a line")


def _moment(text: str) -> str:
    """Return a time with its offset as entries have it."""
    moment = datetime.fromisoformat(text)
    if moment.tzinfo is None:
        raise ValueError("a time without an offset is many times")
    return recorded(moment)


def run(options: argparse.Namespace, config: Config) -> int:
    """Say how far the chain goes, or which row was changed; return 0, or 1 when one was. Or list what was done."""
    if options.action == "list":
        return _list(options, config)
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


def _list(options: argparse.Namespace, config: Config) -> int:
    with closing(Store(config.data, to_read=True)) as store:
        times = {"since": getattr(options, "from"), "until": options.to}
        require("limit", options.limit, ROWS, "ask for fewer, or for a time")
        entries = store.audit.entries(subject=options.subject, **times, before_seq=NEWEST, limit=options.limit)
    if options.json:
        print("\n".join(map(json.dumps, entries)))
        return 0
    names = ("seq", "at", "by", "what", "subject", "reason")
    print("\n".join(aligned([COLUMNS, *(tuple(str(entry[name]) for name in names) for entry in entries)])))
    return 0


def verified(folder: Path, head: str | None = None) -> AuditHead:
    """Return how far the chain of a data folder goes; raise `AuditChanged`, or `StorageError` without a database."""
    database = folder / DATABASE
    try:
        with closing(sqlite3.connect(f"{database.resolve().as_uri()}?mode=ro", uri=True, timeout=BUSY_S)) as db:
            found = verify_chain(db)
            if head is not None:
                require_head(db, head)
    except sqlite3.Error as error:
        raise StorageError(f"The audit of {database} cannot be read: {error}.", _remedy(database, error)) from error
    return found


def _remedy(database: Path, error: sqlite3.Error) -> str:
    """Return what to do about a database whose audit cannot be read."""
    if not is_there(database):
        return "Name the data folder by the setting `data`."
    if getattr(error, "sqlite_errorcode", 0) & PRIMARY in NOT_OPENED:
        return "Run this as root or as the daemon's user, to whom the database belongs."
    return "Name the data folder by the setting `data`; an older release's is chained by the next start."
