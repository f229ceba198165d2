"""`python -m device status`: what the daemon of this probe does now, or what the last press was when none runs.

Where the page that stands in for a daemon has the port, its faults are said: they are why none runs.
Exit codes: 0 ready or busy with a press, 1 at fault, 3 no daemon answers.
"""

from __future__ import annotations

import argparse
import json
import sys
import urllib.request
from contextlib import closing
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any
from urllib.error import HTTPError, URLError

from device.access.known_hosts import LOOPBACK_ADDRESS, is_loopback
from device.config import Config
from device.errors import DeviceError, StorageError
from device.files.plain_settings import is_there
from device.records.database import DATABASE
from device.records.store import Store

ANSWER_S = 5.0
NO_DAEMON = 3
FAULT = ("code", "title", "severity", "cause", "remedy")
EXAMPLES = """examples:
  python -m device status                          what the probe does, and its faults
  python -m device status --json                   the whole status, as GET /api/v1/status has it
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    parser.add_argument("--json", action="store_true", help="as one JSON object")


@dataclass(frozen=True)
class WithoutDaemon:
    """What is known while no daemon answers: what stands in for it says, the last press, and why that is not known."""

    faults: list[dict[str, str]]
    press: dict[str, Any] | None = None
    unread: StorageError | None = None

    def as_record(self) -> dict[str, Any]:
        """Return it as `--json` prints it; `press` is None also where `unread` says why none could be looked for."""
        return {"press": self.press, "faults": self.faults, "unread": self.unread and self.unread.as_record()}

    def lines(self) -> list[str]:
        """Return it as sentences, one a line."""
        last = f"last press unknown: {self.unread.code} {self.unread}" if self.unread else _press_line(self.press)
        return [*map(_fault_line, self.faults), last]


def run(options: argparse.Namespace, config: Config) -> int:
    """Print the status; return the exit code."""
    asked = _asked(config)
    if isinstance(asked, list):
        known = _without_daemon(config, asked)
        start = "No daemon answers; it is started by `systemctl start tsis`."
        print("No daemon runs; its page says why." if asked else start, file=sys.stderr)
        print(json.dumps(known.as_record()) if options.json else "\n".join(known.lines()))
        return NO_DAEMON
    print(json.dumps(asked) if options.json else "\n".join(_lines(asked)))
    is_at_fault = any(fault["severity"] == "fault" for fault in asked["faults"])
    return 1 if is_at_fault else 0


def _asked(config: Config) -> dict[str, Any] | list[dict[str, str]]:
    """Return what the daemon says, or, when there is none, the faults that stand in for it say.

    Raises `DeviceError` when the daemon refuses to answer.
    """
    stated = config.server.host  # a daemon for other machines is served by loopback, too, where no token is needed
    host = stated if is_loopback(stated) else LOOPBACK_ADDRESS
    address = f"http://{host}:{config.server.port}/api/v1/status"
    try:
        with urllib.request.urlopen(address, timeout=ANSWER_S) as answer:
            status: dict[str, Any] = json.load(answer)
            return status
    except HTTPError as error:
        if faults := _faults_of_page(error):
            return faults
        raise DeviceError(f"The daemon at {address} answered {error.code}.", "Look at its log.") from error
    except (URLError, OSError, ValueError):
        return []


def _faults_of_page(answer: HTTPError) -> list[dict[str, str]]:
    """Return why no daemon runs, as the page on its port has it (device/fallback/page.py); [] of any other answer."""
    if answer.code != HTTPStatus.SERVICE_UNAVAILABLE:
        return []
    try:
        problem = json.load(answer)
        return [{name: str(fault[name]) for name in FAULT} for fault in problem["faults"]]
    except (OSError, ValueError, LookupError, TypeError):
        return []


def _without_daemon(config: Config, faults: list[dict[str, str]]) -> WithoutDaemon:
    try:
        return WithoutDaemon(faults, press=_last_press(config))
    except StorageError as error:
        return WithoutDaemon(faults, unread=error)


def _lines(status: dict[str, Any]) -> list[str]:
    kind = "simulated probe" if status["simulated"] else "probe"
    force = "no force" if status["force_n"] is None else f"{status['force_n']:.2f} N"
    lines = [f"{kind} {status['serial']}, software {status['software']}: {status['step']}, {force}"]
    return [*lines, *map(_fault_line, status["faults"]), _press_line(status["press"])]


def _fault_line(fault: dict[str, str]) -> str:
    return f"{fault['code']} {fault['title']}: {fault['cause']} {fault['remedy']}"


def _press_line(press: dict[str, Any] | None) -> str:
    if press is None:
        return "no press yet"
    kept = f", measurement {press['measurement_id']}" if press.get("measurement_id") else ""
    why = f": {press['reason']}" if press.get("reason") else ""
    return f"last press {press['id']}, {press.get('mode')}, {press.get('asked_at')}: {press['state']}{kept}{why}"


def _last_press(config: Config) -> dict[str, Any] | None:
    """Return the press that changed last, None when there was none; raise `StorageError` when nobody can say."""
    if not is_there(config.data / DATABASE):  # nothing was ever kept: that is no fault
        return None
    with closing(Store(config.data, to_read=True)) as store:
        return store.last_press()
