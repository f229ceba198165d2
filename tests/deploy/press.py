"""Presses the probe at a URL once and prints what came of it: press.py URL MODE. Exit code 1 when it is not done."""

from __future__ import annotations

import json
import sys
import time
import urllib.error
import urllib.request
from typing import Any

WITHIN_S = 1800.0


def ask(url: str, body: dict[str, str] | None = None) -> Any:
    """Return what the daemon answers; an emulated one takes its time."""
    content = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(url, data=content, headers={"content-type": "application/json"})
    with urllib.request.urlopen(request, timeout=120) as answer:
        return json.load(answer)


def main(url: str, mode: str) -> int:
    job = ask(f"{url}/api/v1/presses", {"mode": mode})
    until_s, states = time.monotonic() + WITHIN_S, [job["state"]]
    while job["state"] not in ("done", "rejected", "cancelled", "failed") and time.monotonic() < until_s:
        time.sleep(1)
        job = ask(f"{url}/api/v1/presses/{job['id']}")
        if job["state"] != states[-1]:
            states.append(job["state"])
    print(" > ".join(states), job.get("reason") or "")
    if job["state"] != "done":
        return 1
    measured = ask(f"{url}/api/v1/measurements/{job['measurement_id']}")
    print(json.dumps(measured)[:600])
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1], sys.argv[2]))
    except urllib.error.HTTPError as refused:
        print("refused:", json.load(refused).get("detail"))
        sys.exit(1)
