"""`python -m device calibration`: which certificates a probe has, what one of them says, and which is active.

Exit codes: 0 ok, 1 a certificate cannot be used.
"""

from __future__ import annotations

import argparse
import json
from typing import Any

from device.assembly.answers import require_own
from device.config import Config
from device.errors import MissingCalibration
from device.files.bundle_file import read_paper_model
from device.instrument.watch.calibration_watch import CalibrationWatch
from device.instrument.watch.clock_watch import ClockWatch
from device.records.calibrations import Calibrations

EXAMPLES = """examples:
  python -m device calibration list                the certificates of this probe; * is the active one
  python -m device calibration show                what the active one says
  python -m device calibration activate ID         the next start of the daemon uses this one
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    verbs = parser.add_subparsers(dest="verb", metavar="list | show | activate", required=True)
    listed = verbs.add_parser("list", help="print each certificate with its validity; * is the active one")
    listed.add_argument("--json", action="store_true", help="as one JSON object")
    show = verbs.add_parser("show", help="print what a certificate says, the active one unless another is named")
    show.add_argument("id", nargs="?", metavar="ID")
    show.add_argument("--json", action="store_true", help="as one JSON object")
    activate = verbs.add_parser("activate", help="let the next start of the daemon use a certificate")
    activate.add_argument("id", metavar="ID")


def run(options: argparse.Namespace, config: Config) -> int:
    """Run a verb; return the exit code, or raise the `DeviceError` of a certificate that cannot be used."""
    calibrations = Calibrations(config.calibration)
    if options.verb == "activate":
        return _activate(calibrations, options.id, config)
    if options.verb == "list":
        return _list(calibrations, as_json=options.json)
    name = options.id or calibrations.active_name()
    if name is None:
        raise MissingCalibration("No certificate is active.", "Activate one, see `python -m device calibration list`.")
    record = calibrations.read(name).summary()
    if options.json:
        print(json.dumps(record))
    else:
        print("\n".join(f"{key:20} {_written(value)}" for key, value in record.items()))
    return 0


def _written(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _list(calibrations: Calibrations, *, as_json: bool) -> int:
    active, entries = calibrations.active_name(), calibrations.all()
    if as_json:
        records = [{"id": one.name, "is_active": one.name == active, **one.as_record()} for one in entries]
        print(json.dumps({"active": active, "calibrations": records}))
        return 0
    for one in entries:
        mark = "*" if one.name == active else " "
        known = one.calibration
        text = f"{known.serial}, until {known.validity.expires_at}" if known else one.problem
        print(f"{mark} {one.name}  {text}")
    if not entries:
        print(f"There is no certificate in {calibrations.path}.")
    return 0


def _activate(calibrations: Calibrations, name: str, config: Config) -> int:
    """Refuse what a start would refuse, and what has expired; then write the pointer."""
    calibration = calibrations.read(name)
    require_own(calibration, config, read_paper_model(config.paper_model))
    CalibrationWatch(calibration).require_valid(ClockWatch(config.clock.max_jump_s).now())
    calibrations.activate(name)
    print(f"{name} is active from the next start of the daemon on.")
    return 0
