"""`python -m device status`: what the daemon of this probe does now, or what the last press was when none runs.

Exit codes: 0 ready or busy with a press, 1 at fault, 3 no daemon answers.
"""

from __future__ import annotations

import argparse
import json
import sys
import urllib.request
from typing import Any
from urllib.error import HTTPError, URLError

from device.access.known_hosts import LOOPBACK_ADDRESS, is_loopback
from device.config import Config
from device.errors import DeviceError, StorageError
from device.records.store import Store

ANSWER_S = 5.0
NO_DAEMON = 3
EXAMPLES = """examples:
  python -m device status                          what the probe does, and its faults
  python -m device status --json                   the whole status, as GET /api/v1/status has it
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    parser.add_argument("--json", action="store_true", help="as one JSON object")


def run(options: argparse.Namespace, config: Config) -> int:
    """Print the status; return the exit code."""
    status = _asked(config)
    if status is None:
        print("No daemon answers; it is started by `systemctl start tsis`.", file=sys.stderr)
        print(json.dumps({"press": _last_press(config)}) if options.json else _press_line(_last_press(config)))
        return NO_DAEMON
    print(json.dumps(status) if options.json else "\n".join(_lines(status)))
    is_at_fault = any(fault["severity"] == "fault" for fault in status["faults"])
    return 1 if is_at_fault else 0


def _asked(config: Config) -> dict[str, Any] | None:
    """Return what the daemon says, None when there is none; raise `DeviceError` when it refuses to."""
    stated = config.server.host  # a daemon for other machines is served by loopback, too, where no token is needed
    host = stated if is_loopback(stated) else LOOPBACK_ADDRESS
    address = f"http://{host}:{config.server.port}/api/v1/status"
    try:
        with urllib.request.urlopen(address, timeout=ANSWER_S) as answer:
            status: dict[str, Any] = json.load(answer)
            return status
    except HTTPError as error:
        raise DeviceError(f"The daemon at {address} answered {error.code}.", "Look at its log.") from error
    except (URLError, OSError, ValueError):
        return None


def _lines(status: dict[str, Any]) -> list[str]:
    kind = "simulated probe" if status["simulated"] else "probe"
    force = "no force" if status["force_n"] is None else f"{status['force_n']:.2f} N"
    lines = [f"{kind} {status['serial']}, software {status['software']}: {status['step']}, {force}"]
    lines += [f"{fault['code']} {fault['title']}: {fault['cause']} {fault['remedy']}" for fault in status["faults"]]
    return [*lines, _press_line(status["press"])]


def _press_line(press: dict[str, Any] | None) -> str:
    if press is None:
        return "no press yet"
    kept = f", measurement {press['measurement_id']}" if press.get("measurement_id") else ""
    why = f": {press['reason']}" if press.get("reason") else ""
    return f"last press {press['id']}, {press.get('mode')}, {press.get('asked_at')}: {press['state']}{kept}{why}"


def _last_press(config: Config) -> dict[str, Any] | None:
    try:
        store = Store(config.data, to_read=True)
    except StorageError:
        return None
    try:
        return store.last_press()
    finally:
        store.close()
