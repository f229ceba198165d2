"""A client that asks at a steady rate, as its own process: URL REQUESTS_A_SECOND SECONDS PATH...

It prints {asked, answered, slowest_ms, late_ms}: answered are those with 200; late is how far it fell behind its rate.
"""

from __future__ import annotations

import http.client
import itertools
import json
import sys
import time


def main(url: str, rate: float, seconds: float, paths: list[str]) -> None:
    connection = http.client.HTTPConnection(url.removeprefix("http://"), timeout=60)
    count, took_ms, late_ms, answered = round(rate * seconds), [], 0.0, 0
    begun_s = time.monotonic()
    for number, path in zip(range(count), itertools.cycle(paths), strict=False):
        due_s = begun_s + number / rate
        time.sleep(max(0.0, due_s - time.monotonic()))
        asked_s = time.monotonic()
        late_ms = max(late_ms, 1e3 * (asked_s - due_s))
        connection.request("GET", path)
        answer = connection.getresponse()
        answer.read()
        took_ms.append(1e3 * (time.monotonic() - asked_s))
        answered += answer.status == 200
    took_ms.sort()
    figures = {"median_ms": took_ms[count // 2], "late_ms": late_ms, "slowest_ms": took_ms[-1]}
    print(json.dumps({"asked": count, "answered": answered, **figures}))


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), sys.argv[4:])
