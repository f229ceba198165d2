"""Clients get pictures and recordings from the disk; those of earlier releases are packed and drawn one by one."""

import asyncio
import io
import os
import threading
import zipfile
from dataclasses import replace

import httpx
import numpy as np
import pytest
from fastapi import FastAPI

from device.config import Config, RetentionSection
from device.files.recording_file import read_recording, write_recording
from device.measurement.recording.recording import CameraSettings, Recording
from device.measurement.recording.tactile_image import Frame
from device.records.retention import RetentionRule
from device.records.store import Store
from device.web import kept_files
from device.web.app import create_app
from device.web.kept_files import add_retention, packed

CAMERA = CameraSettings(
    width_px=64, height_px=64, bits=8, mm_per_px_x=0.05, mm_per_px_y=0.05, exposure_us=4000.0, gain=1.0
)
FRAMES = [
    Frame(np.full((64, 64), counts, np.uint8), role, 0.0, 0.5, (0.6,) * 4)
    for role, counts in (("dark", 4), ("reference", 80), ("press", 90))
]
RECORDING = Recording("r-1", "TSIS-0007", "1.0", "2026-01-02T03:04:05Z", CAMERA, tuple(FRAMES))


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path)
    for number in (1, 2):
        recording = replace(RECORDING, id=f"r-{number}")
        store.add_measurement({"id": f"m-{number}", "recording_id": recording.id}, recording, picture=b"kept picture")
    path = store.recording_path("r-2")
    write_recording(RECORDING, path.with_suffix(""))
    path.unlink()
    store._db.execute("DELETE FROM kept_recording WHERE id = 'r-2'")  # the earlier release kept no hash either
    yield store
    store.close()


@pytest.fixture
def app(store):
    return create_app(None, store)


def ask(app, *paths):
    async def answers():
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
            return await asyncio.gather(*(client.get(f"/api/v1/measurements/{path}") for path in paths))

    return asyncio.run(answers())


@pytest.mark.parametrize("part", ["bytes=0-3", "bytes=0-1,5-9", "bytes=99999999-", "bytes=9-3", "items=0-1"])
def test_a_recording_is_sent_whole_whatever_part_of_it_is_asked_for(app, store, part):
    async def answer():
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
            return await client.get("/api/v1/measurements/m-1/recording.zip", headers={"Range": part})

    found = asyncio.run(answer())
    assert (found.status_code, found.headers["accept-ranges"]) == (200, "none")
    assert found.content == store.recording_path("r-1").read_bytes()


def test_a_picture_is_served_as_it_was_kept_and_nothing_is_made(app, monkeypatch):
    monkeypatch.setattr(kept_files, "tactile_png", None)
    [answer] = ask(app, "m-1/image.png")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "image/png")
    assert answer.content == b"kept picture"


def test_a_recording_is_sent_as_it_lies_on_the_disk(app, store):
    [answer] = ask(app, "m-1/recording.zip")
    assert answer.headers["content-disposition"] == 'attachment; filename="tsis-measurement-m-1.zip"'
    assert (answer.status_code, answer.headers["content-type"]) == (200, "application/zip")
    assert answer.content == store.recording_path("r-1").read_bytes()
    assert int(answer.headers["content-length"]) == len(answer.content)


def test_a_folder_of_an_earlier_release_is_packed_and_its_picture_made(app, tmp_path):
    picture, recording = ask(app, "m-2/image.png", "m-2/recording.zip")
    assert (picture.status_code, picture.content[1:4]) == (200, b"PNG")
    (tmp_path / "copy.zip").write_bytes(recording.content)
    found = read_recording(tmp_path / "copy.zip")
    assert recording.headers["content-disposition"] == 'attachment; filename="tsis-measurement-m-2.zip"'
    assert [frame.role for frame in found.frames] == ["dark", "reference", "press"]
    with zipfile.ZipFile(tmp_path / "copy.zip") as archive:
        assert archive.testzip() is None
        assert archive.namelist()[0] == "r-2/frames/000.png"


def test_what_a_rule_has_deleted_is_gone_and_no_failure(app, store):
    store.retention.carry_out(RetentionRule(free_mb=1e9, saved_first=False))
    for answer in ask(app, "m-1/image.png", "m-1/recording.zip", "m-1/forces"):
        assert (answer.status_code, answer.json()["code"]) == (410, "E813")
        assert "less than 1e+09 MB left" in answer.json()["detail"]
    [kept] = ask(app, "m-1")
    assert kept.status_code == 200


def test_one_picture_is_made_at_a_time_and_nobody_is_refused(app, monkeypatch):
    making, at_once, made = threading.Semaphore(), [], kept_files.tactile_png

    def note(recording):
        at_once.append(making.acquire(blocking=False))
        try:
            return made(recording)
        finally:
            making.release()

    monkeypatch.setattr(kept_files, "tactile_png", note)
    answers = ask(app, *["m-2/image.png"] * 8)
    assert [answer.status_code for answer in answers] == [200] * 8
    assert at_once == [True] * 8


def test_a_zip_is_made_without_holding_more_than_one_file(tmp_path):
    """The pieces are as large as the files, and together they are what `zipfile` writes to a disk."""
    folder = tmp_path / "press"
    folder.mkdir()
    for number in range(5):
        (folder / f"{number}").write_bytes(bytes([number]) * 100_000)
    pieces = list(packed(folder))
    assert max(map(len, pieces)) < 101_000
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w", zipfile.ZIP_STORED) as archive:
        for path in sorted(folder.iterdir()):
            archive.write(path, path.relative_to(tmp_path))
    assert b"".join(pieces) == whole.getvalue()


@pytest.mark.parametrize("path", ["m-1/image.png", "m-1/recording.zip"])
def test_what_has_gone_missing_is_a_problem_with_its_id(app, store, path):
    store.recording_path("r-1").unlink()
    [answer] = ask(app, path)
    assert (answer.status_code, answer.json()["code"]) == (500, "E604")
    assert "r-1" in answer.json()["detail"]


@pytest.mark.parametrize("path", ["m-1/image.png", "m-1/recording.zip"])
@pytest.mark.parametrize("is_known", [True, False], ids=["with its hash", "of before there were hashes"])
def test_what_was_cut_short_is_a_problem_of_the_probe_and_not_of_the_request(app, store, path, is_known):
    zipped = store.recording_path("r-1")
    if not is_known:
        store._db.execute("DELETE FROM kept_recording")
        if path.endswith(".zip"):
            pytest.skip("without its hash nobody can tell")
    os.truncate(zipped, zipped.stat().st_size // 2)
    [answer] = ask(app, path)
    assert (answer.status_code, answer.json()["code"]) == (500, "E604")
    assert "r-1 is damaged" in answer.json()["detail"]


def test_a_measurement_that_there_is_not_has_neither(app):
    assert [answer.json()["code"] for answer in ask(app, "m-9/image.png", "m-9/recording.zip")] == ["E802"] * 2


def test_what_the_rule_of_the_settings_deletes_is_shown_and_stays(store):
    app, rule = FastAPI(), RetentionSection(free_mb=1e6, saved_first=False)
    add_retention(app, "/api/v1", lambda: Config(retention=rule), store)

    async def shown():
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
            return (await client.get("/api/v1/retention")).json()

    plan = asyncio.run(shown())
    assert plan["rule"] == {"keep_days": None, "free_mb": 1e6, "saved_first": False}
    assert [one["measurement_id"] for one in plan["removals"]] == ["m-1"]  # that of an earlier release has no size yet
    assert (plan["size_bytes"], plan["held_back"]) == (plan["removals"][0]["size_bytes"], 0)
    assert store.recording_path("r-1").is_file()
