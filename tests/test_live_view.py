"""The live picture of a running probe: JPEGs that change while it is pressed, and the press is measured as without."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import httpx
import numpy as np
import pytest
from daemon_process import WAIT_S, Daemon, wait_for

pytestmark = [pytest.mark.real_time, pytest.mark.long]


def pictures(daemon: Daemon) -> Iterator[np.ndarray]:
    """Yield the pictures of the stream, each by its stated length."""
    with httpx.stream("GET", f"{daemon.url}/api/v1/live.mjpeg", timeout=WAIT_S) as answer:
        assert answer.headers["content-type"] == "multipart/x-mixed-replace; boundary=frame"
        waiting = b""
        for received in answer.iter_bytes():
            waiting += received
            head, end, rest = waiting.partition(b"\r\n\r\n")
            if not end:
                continue
            length = int(head.split(b"Content-Length: ")[1])
            if len(rest) >= length:
                yield cv2.imdecode(np.frombuffer(rest[:length], np.uint8), cv2.IMREAD_UNCHANGED)
                waiting = rest[length:]


def test_who_looks_sees_the_light_of_a_press_and_does_not_disturb_it(daemon):
    wait_for(lambda: daemon.ask("/api/v1/health/ready").status, lambda status: status == 200)
    lookers = [pictures(daemon) for _ in range(4)]
    assert [next(one).shape for one in lookers] == [(492, 768)] * 4
    press = daemon.ask("/api/v1/presses", "POST", {"mode": "quick"})
    lit = next(picture for picture in lookers[0] if picture.max() > 60)
    assert lit.shape == (492, 768)
    ended = daemon.ended(press.headers["location"])
    for one in lookers:
        one.close()
    assert (ended["state"], ended["warnings"]) == ("done", [])
