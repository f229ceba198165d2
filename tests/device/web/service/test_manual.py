"""The API's page has every operation and model of the document, leads nowhere else, and needs no network."""

import asyncio
import json
import re
import types
from html.parser import HTMLParser

import httpx
import pytest
from daemon_process import ROOT

from device.web.app import create_app
from device.web.service.manual import manual

DOCUMENT = json.loads((ROOT / "docs" / "openapi.json").read_text(encoding="utf-8"))
VOID = {"meta", "link", "br"}


class Page(HTMLParser):
    """What a page loads, names and leads to; fails where an element is closed that is not open."""

    def __init__(self, text):
        super().__init__()
        self.open, self.ids, self.leads, self.loads, self.text = [], [], [], [], ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        told = dict(attributes)
        self.ids += [told["id"]] if "id" in told else []
        if tag == "a":
            self.leads.append(told["href"])
        self.loads += [told[name] for name in ("src", "href") if name in told and tag != "a"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


@pytest.fixture(scope="module")
def page():
    return Page(manual(DOCUMENT))


def test_every_operation_and_model_has_its_place(page):
    operations = [(path, method, one) for path, methods in DOCUMENT["paths"].items() for method, one in methods.items()]
    for path, method, operation in operations:
        assert f"{method.upper()} {path}" in page.text
        assert operation["operationId"] in page.ids
    assert set(DOCUMENT["components"]["schemas"]) <= set(page.ids)
    assert len(page.ids) == len(set(page.ids))
    assert page.open == []


def test_every_link_leads_to_a_place_of_the_page_or_to_the_document(page):
    places = {f"#{name}" for name in page.ids}
    assert set(page.leads) - places == {"/api/v1/openapi.json"}


def test_what_the_document_says_is_no_markup():
    hostile = "<script>alert(1)</script>"
    document = json.loads(json.dumps(DOCUMENT))
    document["info"]["title"] = document["tags"][0]["description"] = hostile
    document["components"]["schemas"]["Exam"]["description"] = hostile
    document["components"]["schemas"]["Exam"]["properties"][hostile] = {"type": hostile, "description": hostile}
    text = manual(document)
    assert "<script" not in text
    assert hostile in Page(text).text


def test_it_is_served_by_the_probe_alone():
    app = create_app(types.SimpleNamespace(), types.SimpleNamespace())

    async def get(path):
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
            return await client.get(path)

    answer = asyncio.run(get("/docs"))
    assert (answer.status_code, answer.headers["content-type"]) == (200, "text/html; charset=utf-8")
    page = Page(answer.text)
    assert page.loads == ["/static/manual.css"]
    assert asyncio.run(get(page.loads[0])).status_code == 200
    assert not re.findall(r"https?://", answer.text)
