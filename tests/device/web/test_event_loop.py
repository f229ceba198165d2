"""Nothing heavy runs on the event loop: pictures, archives, the store and the estimate are made in other threads."""

import asyncio
import inspect
import json
import threading
import types

import httpx
import pytest
from fastapi.routing import APIRoute

from device.config import Config
from device.instrument.status import StatusBoard
from device.records.listing import Page
from device.web import kept_files
from device.web.app import create_app
from device.web.events import StatusFeed

MEASUREMENT = {"id": "m-1", "recording_id": "r-1", "features": {"total": 1.0}, "version": 1}


class Witness:
    """A store and a procedure that note on which thread they are asked."""

    def __init__(self, folder):
        self.folder, self.threads = folder, {}
        self.config, self.modes, self.mode, self.is_simulated = Config(), ("paper",), "paper", True
        self.light_on_s, self.board = 0.0, StatusBoard()
        self.bench = types.SimpleNamespace(force=types.SimpleNamespace(latest_n=0.25))

    def note(self, what, answer):
        self.threads[what] = threading.get_ident()
        return answer

    def measurement(self, measurement_id):
        return self.note("measurement", MEASUREMENT)

    @property
    def listing(self):
        def listed(what):
            return lambda wanted, *, before, limit: self.note(what, Page([], None))

        return types.SimpleNamespace(measurements=listed("measurements"), presses=listed("presses"))

    def recording_path(self, recording_id):
        return self.note("recording", self.folder)

    def press(self, press_id):
        return self.note("press", {"id": press_id})

    def require_ready(self):
        self.note("ready", None)


@pytest.fixture
def witness(tmp_path, monkeypatch):
    (tmp_path / "recording.json").write_text('{"frames": []}')
    witness = Witness(tmp_path)
    monkeypatch.setattr(kept_files, "read_recording", lambda folder: witness.note("reading", None))
    monkeypatch.setattr(kept_files, "tactile_png", lambda recording: witness.note("picture", b"png"))
    return witness


HEAVY = {
    "measurements": "measurements",
    "presses": "presses",
    "measurements/m-1": "measurement",
    "measurements/m-1/features": "measurement",
    "measurements/m-1/image.png": "picture",
    "measurements/m-1/forces": "recording",
    "measurements/m-1/recording.zip": "recording",
    "presses/p-1": "press",
    "health/ready": "ready",
}


@pytest.mark.parametrize("path", HEAVY)
def test_what_reads_the_disk_or_makes_a_picture_is_not_done_on_the_event_loop(witness, path):
    app = create_app(witness, witness)

    async def ask():
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
            return threading.get_ident(), await client.get(f"/api/v1/{path}")

    loop_thread, answer = asyncio.run(ask())
    assert answer.status_code == 200
    assert witness.threads[HEAVY[path]] != loop_thread


def test_only_what_waits_runs_on_the_event_loop(witness):
    """Streams, a picture that waits for its turn to be made, an upload's parts, and pages, read at the start."""
    routes = [route for route in create_app(witness, witness).routes if isinstance(route, APIRoute)]
    waits = (inspect.iscoroutinefunction, inspect.isasyncgenfunction)
    on_the_loop = [route.path for route in routes if any(is_it(route.endpoint) for is_it in waits)]
    assert sorted(on_the_loop) == [
        "/",
        "/api/v1/events",
        "/api/v1/live.mjpeg",
        "/api/v1/measurements/{measurement_id}/image.png",
        "/api/v1/updates",
        "/pair",
        "/static/joined/screen.css",
        "/static/joined/screen.js",
    ]


def test_an_event_is_small_and_touches_neither_disk_nor_store(witness):
    """It is what the board and the cell's newest sample say: some 1 kB, built once for all clients."""
    told = StatusFeed(witness).event().raw_data
    assert len(told) < 2000
    assert json.loads(told)["press_state"] == "idle"
    assert witness.threads == {}
