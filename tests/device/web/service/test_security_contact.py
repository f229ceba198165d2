"""Whoever finds a vulnerability is told by the probe itself whom to tell, without a token."""

import asyncio
import types

import httpx
import pytest

from device.access.scopes import need_of
from device.config import MakerSection
from device.files.toml_record import InvalidRecord, from_table
from device.measurement.quantities import InvalidQuantity
from device.web.app import create_app

PATH = "/.well-known/security.txt"
STATED = {"security_contact": "mailto:security@example.org", "updates_until": "2031-12-31"}


def answered(store, maker):
    """Ask an application whose settings name a maker."""
    app = create_app(types.SimpleNamespace(config=types.SimpleNamespace(maker=maker)), store)

    async def asking():
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
            return await client.get(PATH)

    return asyncio.run(asking())


def test_it_says_whom_to_tell_and_until_when_there_are_updates(store):
    answer = answered(store, from_table(MakerSection, STATED))
    assert (answer.status_code, answer.headers["content-type"]) == (200, "text/plain; charset=utf-8")
    fields = dict(line.split(": ", 1) for line in answer.text.splitlines() if not line.startswith("#"))
    assert fields == {
        "Contact": "mailto:security@example.org",
        "Expires": "2031-12-31T23:59:59Z",
        "Preferred-Languages": "en, de",
    }
    assert "# There are updates for this probe until 2031-12-31." in answer.text.splitlines()


def test_without_a_maker_who_says_so_there_is_none(store):
    answer = answered(store, MakerSection())
    assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")
    assert "Nobody is named" in answer.text


def test_no_token_is_needed_to_be_told():
    assert need_of("GET", PATH) == "nothing"
    assert need_of("POST", PATH) == "admin"


@pytest.mark.parametrize(
    "changed",
    [
        {"security_contact": "security@example.org"},
        {"security_contact": "mailto:a@example.org\nContact: mailto:b@example.org"},
        {"updates_until": "soon"},
        {"updates_until": "2031-02-30"},
        {"updates_until": None},
        {"security_contact": None},
    ],
    ids=["no address", "two lines", "no day", "a day there is not", "no day at all", "nobody"],
)
def test_what_says_half_of_it_is_refused(changed):
    stated = {name: value for name, value in (STATED | changed).items() if value is not None}
    with pytest.raises((InvalidQuantity, InvalidRecord)):
        next(from_table(MakerSection, stated).conflicts(), None)
