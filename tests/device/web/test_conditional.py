"""What a client has is not sent again: 304 by its ETag, and the whole answer as soon as anything is another."""

import asyncio
import types

import httpx
import pytest
from kept_measurements import keep

from device.records.exams import ExamContent
from device.records.store import Store
from device.web.app import create_app


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    keep(opened, 1, picture=b"png")
    yield opened
    opened.close()


@pytest.fixture
def get(store):
    app = create_app(types.SimpleNamespace(), store)

    def getting(path, known=None):
        async def answer():
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                return await client.get(f"/api/v1/{path}", headers={"if-none-match": known} if known else {})

        return asyncio.run(answer())

    return getting


PATHS = [
    "measurements", "measurements?limit=1", "measurements/m-1", "measurements/m-1/features",
    "measurements/m-1/forces", "presses", "exams", "audit",
    "measurements/m-1/image.png", "measurements/m-1/recording.zip",
]  # fmt: skip


@pytest.mark.parametrize("path", PATHS)
def test_what_a_client_has_is_not_sent_again(get, path):
    first = get(path)
    tag = first.headers["etag"]
    assert (first.status_code, get(path).headers["etag"]) == (200, tag)
    for known in (tag, f'"other", {tag}', f"W/{tag}", "*"):
        again = get(path, known)
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", tag)
    assert get(path, '"other"').content == first.content


def test_a_list_has_another_tag_when_something_is_added_and_when_it_changes(store, get):
    tags = [get("measurements").headers["etag"]]
    store.exams.void("m-1", version=1, by="Ada", reason="Slipped")
    tags.append(get("measurements").headers["etag"])
    keep(store, 2)
    tags.append(get("measurements").headers["etag"])
    assert len(set(tags)) == 3


def test_a_record_that_was_changed_is_sent(store, get):
    exam = store.exams.make(ExamContent(kind="patient", patient_ref="A", operator="Ada"))
    path, known = f"exams/{exam['id']}", '"1"'
    assert get(path, known).status_code == 304
    store.exams.change(exam["id"], {"note": "Left"}, version=1, by="Ada", reason="Forgotten")
    assert (get(path, known).status_code, get(path).headers["etag"]) == (200, '"2"')


def test_what_is_refused_has_no_tag_and_is_never_unchanged(get):
    answer = get("measurements/none", "*")
    assert (answer.status_code, "etag" in answer.headers) == (404, False)
