"""Releases over REST: told to everybody, taken from the probe's own screen only, and never in the way of a press."""

import asyncio
import contextlib
import io
import json
import tarfile
import threading
import types

import httpx
import pytest

from device.errors import BusyError
from device.instrument.watch.readiness import PartHealth
from device.records.updates import Updates
from device.web.app import create_app
from device.web.schema import Health, UpdateResource

OCTETS = {"content-type": "application/octet-stream"}
TYPES = {"updates": OCTETS, "updates/roll-back": {"content-type": "application/json"}}


def release(size_bytes=3_000_000, product="tsis"):
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w") as archive:
        for name, content in (("manifest.json", json.dumps({"product": product}).encode()), ("x", bytes(size_bytes))):
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    return file.getvalue()


class Procedure:
    """One that is idle unless it says otherwise."""

    def __init__(self):
        self.is_pressing = False
        self.health = {"camera": PartHealth(False, "E101"), "store": PartHealth(True, None)}

    def parts(self):
        return self.health

    @contextlib.contextmanager
    def idle(self):
        if self.is_pressing:
            raise BusyError("A press is under way.", "Wait.")
        yield


@pytest.fixture
def probe(tmp_path):
    (tmp_path / "incoming").mkdir()
    (tmp_path / "state.json").write_text(json.dumps({"committed": "0.1.0+400", "previous": "0.0.9+390", "floor": 400}))
    (tmp_path / "progress.json").write_text(json.dumps({"state": "idle"}))
    return types.SimpleNamespace(procedure=Procedure(), folder=tmp_path, incoming=tmp_path / "incoming")


@pytest.fixture
def ask(probe):
    app = create_app(probe.procedure, types.SimpleNamespace(), updates=Updates(probe.folder, "0.1.0+400"))

    def asking(method, path, client="127.0.0.1", **content):
        async def answer():
            transport = httpx.ASGITransport(app, client=(client, 4321))
            async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as http:
                return await http.request(method, path, **content)

        return asyncio.run(answer())

    return asking


def test_the_parts_are_told_with_the_release_whatever_they_are(ask):
    answer = ask("GET", "/api/v1/health/parts")
    assert answer.status_code == 200
    assert Health.model_validate(answer.json()).release == "0.1.0+400"
    assert answer.json()["parts"]["camera"] == {"ready": False, "code": "E101"}


def test_releases_are_told(ask):
    answer = ask("GET", "/api/v1/updates")
    assert answer.status_code == 200
    told = UpdateResource.model_validate(answer.json())
    assert (told.running, told.previous, told.state, told.can_roll_back) == ("0.1.0+400", "0.0.9+390", "idle", True)


def test_a_release_file_is_handed_to_the_updater(ask, probe):
    content = release()
    answer = ask("POST", "/api/v1/updates", content=content, headers=OCTETS)
    assert (answer.status_code, answer.headers["location"]) == (202, "/api/v1/updates")
    UpdateResource.model_validate(answer.json())
    assert (probe.incoming / "update.release").read_bytes() == content
    assert ask("POST", "/api/v1/updates", content=content, headers=OCTETS).status_code == 409


@pytest.mark.parametrize("path", ["updates", "updates/roll-back"])
def test_from_another_computer_nothing_is_taken(ask, probe, path):
    for client in ("192.168.1.7", "10.0.0.1", "fe80::1"):
        answer = ask("POST", f"/api/v1/{path}", client=client, content=b"{}", headers=TYPES[path])
        assert (answer.status_code, answer.json()["code"]) == (403, "E807")
    assert list(probe.incoming.iterdir()) == []


@pytest.mark.parametrize("client", ["127.0.0.1", "::1", "127.5.0.1"])
def test_the_probes_own_screen_is_any_loopback_address(ask, client):
    assert ask("POST", "/api/v1/updates", client=client, content=release(10), headers=OCTETS).status_code == 202


@pytest.mark.parametrize("kind", ["text/plain", "multipart/form-data; boundary=x", "application/json", ""])
def test_what_a_page_of_another_origin_could_send_unasked_is_refused(ask, probe, kind):
    answer = ask("POST", "/api/v1/updates", content=release(10), headers={"content-type": kind})
    assert (answer.status_code, answer.json()["code"]) == (415, "E808")
    assert list(probe.incoming.iterdir()) == []


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04" * 1000, release(10, "toaster"), release(10)[:520]])
def test_another_file_is_refused_and_leaves_nothing(ask, probe, content):
    answer = ask("POST", "/api/v1/updates", content=content, headers=OCTETS)
    assert (answer.status_code, answer.json()["code"]) == (422, "E803")
    assert list(probe.incoming.iterdir()) == []


def test_another_file_is_refused_at_its_first_bytes(ask, probe):
    """The rest is not even read."""
    sent = []

    async def holiday():
        for number in range(1000):
            sent.append(number)
            yield b"\xff\xd8" * 50_000

    assert ask("POST", "/api/v1/updates", content=holiday(), headers=OCTETS).status_code == 422
    assert len(sent) < 5


def test_a_file_that_is_too_large_is_refused_unread(ask, probe):
    answer = ask("POST", "/api/v1/updates", content=b"x", headers=OCTETS | {"content-length": str(10**9)})
    assert answer.status_code == 413
    assert list(probe.incoming.iterdir()) == []


@pytest.mark.parametrize("path", ["updates", "updates/roll-back"])
def test_nothing_is_taken_during_a_press(ask, probe, path):
    probe.procedure.is_pressing = True
    answer = ask("POST", f"/api/v1/{path}", content=b"{}", headers=TYPES[path])
    assert (answer.status_code, answer.json()["code"]) == (409, "E801")
    assert list(probe.incoming.iterdir()) == []


def test_a_press_that_begins_meanwhile_goes_on_and_the_file_is_not_handed_over(ask, probe):
    async def slowly():
        yield release()[:2_000_000]
        probe.procedure.is_pressing = True
        yield release()[2_000_000:]

    answer = ask("POST", "/api/v1/updates", content=slowly(), headers=OCTETS)
    assert (answer.status_code, answer.json()["code"]) == (409, "E801")
    assert list(probe.incoming.iterdir()) == []


def test_the_disk_is_written_by_other_threads_than_the_event_loops(ask, probe, monkeypatch):
    threads = set()
    write = Updates.receive

    def receive(self, announced_bytes):
        incoming = write(self, announced_bytes)
        taking = incoming.write
        incoming.write = lambda part: (threads.add(threading.get_ident()), taking(part))
        return incoming

    monkeypatch.setattr(Updates, "receive", receive)
    ask("POST", "/api/v1/updates", content=release(), headers=OCTETS)
    assert threads
    assert threading.get_ident() not in threads


def test_the_release_before_is_asked_for(ask, probe):
    answer = ask("POST", "/api/v1/updates/roll-back", json={})
    assert (answer.status_code, answer.headers["location"]) == (202, "/api/v1/updates")
    assert (probe.incoming / "roll_back").exists()


def test_on_a_workstation_nothing_is_taken(ask, probe):
    probe.incoming.rmdir()
    answer = ask("POST", "/api/v1/updates", content=release(10), headers=OCTETS)
    assert (answer.status_code, answer.json()["code"]) == (409, "E812")
