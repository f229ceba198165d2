"""`python -m device exams`: the exams that are kept, newest first, also beside a daemon. It only reads.

Exit code 0.
"""

from __future__ import annotations

import argparse
import json
from contextlib import closing

from device.config import Config
from device.files.text_table import aligned
from device.measurement.quantities import require
from device.records.listing import NEWEST, ROWS, Wanted
from device.records.store import Store

EXAMPLES = """examples:
  python -m device exams                           the newest exams of patients
  python -m device exams --patient A-17 --json     those of one reference, one JSON object a line
  python -m device exams --patient 4711 --issuer "HOSPITAL A"
  python -m device exams --kind phantom
"""
COLUMNS = ("made at", "exam", "patient", "issuer", "order", "side", "operator", "measurements")
PAGE = 100


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    parser.add_argument("--kind", choices=("patient", "phantom"), default="patient", help="of patients, or of phantoms")
    parser.add_argument("--patient", metavar="REF", help="of one patient's reference, of any issuer")
    parser.add_argument("--issuer", metavar="NAME", help="of references that NAME has issued; '' for no known issuer")
    parser.add_argument("--limit", type=int, default=PAGE, metavar="N", help=f"at most so many, {PAGE} unless given")
    parser.add_argument("--json", action="store_true", help="as one JSON object a line")


def run(options: argparse.Namespace, config: Config) -> int:
    """Print the exams; return the exit code, or raise what keeps the store from being read."""
    require("limit", options.limit, ROWS, "ask for fewer, or for one patient's")
    with closing(Store(config.data, to_read=True)) as store:
        page = store.listing.exams(
            Wanted(),
            kind=options.kind,
            patient_ref=options.patient,
            patient_issuer=options.issuer,
            before=NEWEST,
            limit=options.limit,
        )
        if options.json:
            for exam in page.records:
                print(json.dumps(exam))
            return 0
        rows = [
            tuple(
                str(value if value is not None else "")
                for value in (
                    exam["made_at"], exam["id"], exam["patient_ref"], exam["patient_issuer"], exam["order_number"],
                    exam["side"], exam["operator"], _counted(*store.listing.measurements_of(exam["id"])),
                )
            )
            for exam in page.records
        ]  # fmt: skip
    print("\n".join(aligned([COLUMNS, *rows])))
    return 0


def _counted(counting: int, void: int) -> str:
    """Return how many measurements count, as the report and the table of lesions say it, and how many do not."""
    return f"{counting} (+{void} void)" if void else f"{counting}"
