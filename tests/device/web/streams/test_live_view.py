"""The live picture: each frame is encoded once for all who look, not too often, and never while nobody does."""

import asyncio

import cv2
import numpy as np
import pytest

from device.web.streams import live_view
from device.web.streams.live_view import BOUNDARY, INTERVAL_S, REPEAT_S, LiveView, part_of


def frame(level):
    return np.full((492, 768), level, np.uint8)


class Scene:
    """A camera's newest frame and a clock, both moved by hand; it counts what is encoded."""

    def __init__(self, monkeypatch):
        self.newest, self.now_s, self.encoded = None, 100.0, 0
        monkeypatch.setattr(live_view, "part_of", self._part_of)
        self.view = LiveView(lambda: self.newest, clock=lambda: self.now_s)

    def _part_of(self, taken):
        self.encoded += 1
        return part_of(taken)

    def part(self):
        return asyncio.run(self.view.part())


@pytest.fixture
def scene(monkeypatch):
    return Scene(monkeypatch)


def picture(part):
    head, _, rest = part.partition(b"\r\n\r\n")
    length = int(head.split(b"Content-Length: ")[1])
    assert rest[length:] == b"\r\n" + BOUNDARY
    return cv2.imdecode(np.frombuffer(rest[:length], np.uint8), cv2.IMREAD_UNCHANGED)


def test_a_part_is_the_frame_as_it_is():
    """No brightness is made up: what is dark stays dark."""
    for level in (0, 17, 200):
        shown = picture(part_of(frame(level)))
        assert (shown.shape, int(shown.min()), int(shown.max())) == ((492, 768), level, level)


def test_a_frame_is_encoded_once_however_many_look(scene):
    scene.newest = frame(10)

    async def look():
        return await asyncio.gather(*(scene.view.part() for _ in range(20)))

    parts = asyncio.run(look())
    assert scene.encoded == 1
    assert all(part is parts[0] for part in parts)


def test_no_more_than_five_a_second_are_encoded(scene):
    for step in range(60):  # one second of the camera
        scene.newest = frame(step)
        scene.now_s = 200.0 + step / 60
        scene.part()
    assert scene.encoded == 5


def test_nothing_is_encoded_before_the_first_frame_or_without_a_newer_one(scene):
    assert scene.part() == b""
    scene.newest = frame(1)
    first = scene.part()
    scene.now_s += 60.0
    assert scene.part() is first
    assert scene.encoded == 1


def test_a_client_gets_each_picture_once_and_an_old_one_now_and_then(scene, monkeypatch):
    scene.newest = frame(1)

    async def next_look(seconds):
        assert seconds == INTERVAL_S
        scene.now_s += seconds

    async def follow():
        stream = scene.view.parts()
        got = [await anext(stream) for _ in range(3)]
        waited_s = scene.now_s - 100.0
        scene.newest = frame(2)
        got.append(await anext(stream))
        await stream.aclose()
        return got, waited_s

    monkeypatch.setattr(live_view.asyncio, "sleep", next_look)
    (boundary, first, again, second), waited_s = asyncio.run(follow())
    assert boundary == BOUNDARY
    assert again is first
    assert waited_s == pytest.approx(REPEAT_S, abs=INTERVAL_S)
    assert picture(second).max() == 2
