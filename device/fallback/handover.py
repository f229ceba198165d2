"""The daemon's side of the port's change of hands: the fallback keeps it while parts are opened, then gives it up.

So its page stays where it is while a daemon starts in vain again and again.
"""

from __future__ import annotations

import http.client
import json

from device.access.known_hosts import asked_at
from device.fallback.server import LIVE, YIELD

ANSWER_S = 2.0
HEADERS = {"Content-Type": "application/json"}


def is_fallback(host: str, port: int) -> bool:
    """Return whether it is the fallback that has a port of this machine."""
    answer = _asked("GET", host, port, LIVE)
    return answer is not None and "fallback" in answer


def ask_for_port(host: str, port: int) -> bool:
    """Ask the fallback for its port; return whether it gives it up, which takes it a moment."""
    return _asked("POST", host, port, YIELD) is not None


def _asked(method: str, host: str, port: int, path: str) -> dict[str, object] | None:
    line = http.client.HTTPConnection(asked_at(host), port, timeout=ANSWER_S)
    try:
        line.request(method, path, headers=HEADERS)
        answer = line.getresponse()
        record = json.loads(answer.read(2**16))
        return record if answer.status == 200 and isinstance(record, dict) else None
    except (OSError, ValueError, http.client.HTTPException):
        return None
    finally:
        line.close()
