"""`python -m device pair`: a code by which another machine gets a token.

The daemon that runs is asked, by loopback as its own screen asks it: whoever may log in on the probe may do this.
"""

from __future__ import annotations

import argparse
import http.client
import json
from typing import Any

from device.access.known_hosts import LOOPBACK_ADDRESS
from device.access.scopes import PAIRING, SCOPES
from device.config import Config
from device.errors import DeviceError

ASK_S = 10.0
EXAMPLES = """examples:
  python -m device pair --name "Ward PC"                     a code for a PC that may read
  python -m device pair --name PACS --scope measure --days 30
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add for whom a code is."""
    parser.epilog = EXAMPLES
    parser.add_argument("--name", required=True, help="what the machine is called in logs and in the audit")
    parser.add_argument("--scope", choices=SCOPES, default="read", help="what it may (read)")
    parser.add_argument("--days", type=int, default=365, help="how long its token holds (365)")
    parser.add_argument("--json", action="store_true", help="print a JSON object")


def run(options: argparse.Namespace, config: Config) -> int:
    """Make a pairing code and say what to do with it."""
    asked = {"name": options.name, "scope": options.scope, "days": options.days}
    code = ask(config, "POST", PAIRING, asked)
    if options.json:
        print(json.dumps(code))
        return 0
    network = code["network"]
    print(f"Code for {code['name']}, who may {code['scope']}: {code['code']}, for {code['valid_s'] / 60:.0f} minutes.")
    if network:
        print(f"Open {network['url']} there. Its certificate has the SHA-256\n{network['certificate_sha256']}")
    else:
        print("No other machine can reach this probe: server.host is loopback, or the status says why (E021).")
    return 0


def ask(config: Config, method: str, path: str, body: object = None) -> dict[str, Any]:
    """Return what the daemon of this machine answers; raise `DeviceError` with what it refuses by."""
    port = config.server.port
    line = http.client.HTTPConnection(LOOPBACK_ADDRESS, port, timeout=ASK_S)
    try:
        line.request(method, path, None if body is None else json.dumps(body), {"Content-Type": "application/json"})
        answer = line.getresponse()
        said = json.loads(answer.read())
    except (OSError, ValueError, http.client.HTTPException) as error:
        remedy = "Start it, or name its port with --port."
        raise DeviceError(f"No daemon answers at port {port} of this machine: {error}.", remedy) from error
    finally:
        line.close()
    if answer.status >= http.client.BAD_REQUEST:
        raise DeviceError(str(said.get("detail", answer.status)), str(said.get("remedy", "See the daemon's log.")))
    found: dict[str, Any] = said
    return found
