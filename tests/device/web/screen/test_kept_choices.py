"""What is chosen at the own screen: kept over a restart, in the own screen's pages, and nobody else's to see or set."""

import asyncio
import html
import json
import re
import types
from pathlib import Path

import httpx
import pytest

from device.files import screen_choices
from device.files.screen_choices import NAME, ScreenChoices, read_choices
from device.web.app import create_app
from device.web.entrance.door import Door
from device.web.screen.kept_choices import KeptChoices, ScreenResource

FAR = "192.0.2.7"
NOTHING = {"language": None, "colours": None, "sound": None}


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "var"


@pytest.fixture
def ask(store, folder):
    return asking(store, KeptChoices(folder))


def asking(store, choices):
    app = create_app(types.SimpleNamespace(), store, door=Door(store.tokens), choices=choices)

    def ask(method, path="/api/v1/screen", body=None, client="127.0.0.1", **headers):
        async def answer():
            base = "http://localhost" if client == "127.0.0.1" else "https://localhost"
            transport = httpx.ASGITransport(app, client=(client, 4321))
            async with httpx.AsyncClient(transport=transport, base_url=base) as http:
                content = None if body is None else json.dumps(body)
                return await http.request(
                    method, path, headers={"content-type": "application/json", **headers}, content=content
                )

        return asyncio.run(answer())

    return ask


def kept_in(answer):
    """Return what a page says that the probe keeps, None where it says nothing."""
    found = re.search(r'<html lang="en"[^>]* data-kept="([^"]*)">', answer.text)
    return found and json.loads(html.unescape(found[1]))


def test_what_is_chosen_stays_over_a_restart_and_what_is_not_named_stays_too(ask, store, folder):
    assert ask("GET").json() == NOTHING
    assert ask("PATCH", body={"language": "de"}).json() == {**NOTHING, "language": "de"}
    changed = ask("PATCH", body={"colours": "dark", "sound": "off"})
    assert changed.status_code == 200
    assert ScreenResource.model_validate(changed.json()).language == "de"
    again = asking(store, KeptChoices(folder))
    assert again("GET").json() == {"language": "de", "colours": "dark", "sound": "off"}
    assert again("PATCH", body={"language": None}).json()["language"] is None
    assert read_choices(folder) == ScreenChoices(colours="dark", sound="off")


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ({"language": "fr"}, "body.language is 'fr', but must be 'en' or 'de'."),
        ({"colours": "pink", "language": "de"}, "body.colours is 'pink', but must be 'auto', 'light' or 'dark'."),
        ({"sound": True}, "body.sound is True, but must be 'on' or 'off'."),
        ({"operator": "Ada"}, "body.operator is 'Ada': Extra inputs are not permitted."),
    ],
    ids=str,
)
def test_an_unknown_value_is_refused_with_those_that_are_allowed(ask, folder, body, told):
    answer = ask("PATCH", body=body)
    assert (answer.status_code, answer.json()["detail"]) == (422, told)
    assert ask("GET").json() == NOTHING
    assert not (folder / NAME).exists()


@pytest.mark.parametrize("method", ["GET", "PATCH"])
def test_another_machine_sees_and_changes_nothing_whatever_its_token(ask, store, method):
    ask("PATCH", body={"language": "de"})
    _, admin = store.tokens.make("Admin", "admin", days=1)
    bearer = {"authorization": f"Bearer {admin}"}
    answer = ask(method, body={"language": "en"} if method == "PATCH" else None, client=FAR, **bearer)
    assert (answer.status_code, answer.json()["code"]) == {"GET": (403, "E821"), "PATCH": (403, "E807")}[method]
    assert ask("GET").json()["language"] == "de"


@pytest.mark.parametrize("path", ["/", "/pair"])
def test_the_pages_of_the_own_screen_alone_come_as_it_was_chosen(ask, store, path):
    assert kept_in(ask("GET", path)) == NOTHING
    ask("PATCH", body={"language": "de", "colours": "dark"})
    answer = ask("GET", path)
    assert kept_in(answer) == {"language": "de", "colours": "dark", "sound": None}
    assert 'data-colours="dark"' in answer.text
    _, token = store.tokens.make("Ward PC", "admin", days=1)
    elsewhere = ask("GET", path, client=FAR, authorization=f"Bearer {token}")
    by_proxy = ask("GET", path, authorization=f"Bearer {token}", via="1.1 proxy")
    for page in (elsewhere, by_proxy):
        assert (page.status_code, page.headers["content-type"]) == (200, "text/html; charset=utf-8")
        assert '<html lang="en">' in page.text


def test_a_disk_that_takes_nothing_is_said_and_what_was_kept_before_stays(ask, folder, monkeypatch):
    ask("PATCH", body={"language": "de"})

    def full(path: Path, content: bytes) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(screen_choices, "write_durably", full)
    answer = ask("PATCH", body={"language": "en"})
    assert (answer.status_code, answer.json()["code"]) == (507, "E601")
    assert answer.json()["detail"].endswith(f"{folder / NAME}: No space left on device.")
    assert ask("GET").json()["language"] == kept_in(ask("GET", "/"))["language"] == "de"


def test_a_choice_that_is_made_again_is_not_written_again(ask, monkeypatch):
    ask("PATCH", body={"language": "de"})
    monkeypatch.setattr(screen_choices, "write_durably", lambda *_: pytest.fail("it was written again"))
    assert ask("PATCH", body={"language": "de"}).status_code == 200


def test_a_probe_without_a_data_folder_keeps_nothing_and_its_page_says_nothing(store):
    ask = asking(store, None)
    assert kept_in(ask("GET", "/")) is None
    assert ask("PATCH", body={"language": "de"}).status_code == 507
