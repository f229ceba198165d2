"""Pairing over REST: the code is the own screen's, the token is shown once, and what is revoked holds no more."""

import asyncio
import json
import types

import httpx
import pytest

from device.web import pairing
from device.web.app import create_app
from device.web.entrance.door import COOKIE, Door
from device.web.entrance.network import ServedNetwork
from device.web.schema import AuditList

FAR = "192.0.2.7"


@pytest.fixture
def ask(store):
    network = ServedNetwork("https://probe:8443/", "AB:CD")
    app = create_app(types.SimpleNamespace(), store, door=Door(store.tokens), network=network)

    def asking(method, path, body=None, client="127.0.0.1", **headers):
        async def answer():
            base = "http://localhost" if client == "127.0.0.1" else "https://localhost"
            transport = httpx.ASGITransport(app, client=(client, 4321))
            async with httpx.AsyncClient(transport=transport, base_url=base) as http:
                of_all = {"content-type": "application/json", **headers}
                content = None if body is None else json.dumps(body)
                return await http.request(method, f"/api/v1/{path}", headers=of_all, content=content)

        return asyncio.run(answer())

    return asking


def code(ask, **said):
    return ask("POST", "pairing", {"name": "Ward PC", **said}).json()["code"]


def test_a_code_brings_a_token_that_is_let_in_and_is_revoked(ask, store):
    begun = ask("POST", "pairing", {"name": "Ward PC", "scope": "measure", "days": 30})
    assert begun.status_code == 201
    shown = pairing.PairingResource.model_validate(begun.json())
    assert (shown.name, shown.scope, shown.network.certificate_sha256) == ("Ward PC", "measure", "AB:CD")
    assert ask("GET", "pairing").json()["code"] == shown.code
    made = ask("POST", "pairing/claim", {"code": shown.code.lower()}, client=FAR)
    assert made.status_code == 201
    token = pairing.NewToken.model_validate(made.json())
    bearer = {"authorization": f"Bearer {token.token}"}
    assert ask("GET", "exams", client=FAR, **bearer).status_code == 200
    assert ask("GET", "tokens", client=FAR, **bearer).json()["code"] == "E821"
    listed = ask("GET", "tokens")
    assert [one["id"] for one in listed.json()["tokens"]] == [token.id]
    assert token.token not in listed.text
    assert ask("DELETE", f"tokens/{token.id}").json()["revoked_at"]
    assert ask("GET", "exams", client=FAR, **bearer).json()["code"] == "E820"
    assert ask("DELETE", f"tokens/{token.id}").status_code == 404
    told = AuditList.model_validate(ask("GET", f"audit?subject={token.id}").json()).entries
    assert [(one.what, one.client) for one in told] == [("token_revoked", "screen"), ("token_made", "Ward PC")]
    assert store.audit.verify().seq == 2


def test_a_browser_gets_a_cookie_that_no_script_reads_and_no_token(ask):
    made = ask("POST", "pairing/claim", {"code": code(ask), "as_cookie": True}, client=FAR)
    assert made.json()["token"] is None
    said = made.headers["set-cookie"]
    secret = said.partition("=")[2].partition(";")[0]
    parts = {part.strip().lower() for part in said.split(";")}
    assert {"httponly", "secure", "samesite=strict", "path=/"} <= parts
    assert not any(part.startswith("domain") for part in parts)
    assert secret not in made.text
    assert ask("GET", "exams", client=FAR, cookie=f"{COOKIE}={secret}").status_code == 200


@pytest.mark.parametrize("method", ["POST", "GET", "DELETE"])
def test_from_another_machine_no_code_is_made_seen_or_ended(ask, store, method):
    _, admin = store.tokens.make("Admin", "admin", days=1)
    begun = code(ask)
    answer = ask(method, "pairing", {"name": "X"}, client=FAR, authorization=f"Bearer {admin}")
    assert (answer.status_code, answer.json()["code"]) in {(403, "E807"), (403, "E821")}
    assert ask("GET", "pairing").json()["code"] == begun


def test_a_wrong_code_a_used_one_and_none_are_answered_alike(ask):
    none = ask("POST", "pairing/claim", {"code": "AAAA-AAAA"}, client=FAR)
    used = code(ask)
    assert ask("POST", "pairing/claim", {"code": used}, client=FAR).status_code == 201
    again = ask("POST", "pairing/claim", {"code": used}, client=FAR)
    code(ask)
    wrong = ask("POST", "pairing/claim", {"code": "AAAA-AAAA"}, client=FAR)
    assert {one.text for one in (none, again, wrong)} == {wrong.text}
    assert (wrong.status_code, wrong.json()["code"]) == (403, "E822")


def test_who_guesses_waits(ask):
    answers = [ask("POST", "pairing/claim", {"code": "AAAA-AAAA"}, client=FAR) for _ in range(8)]
    assert [one.status_code for one in answers] == [403] * 5 + [429] * 3
    assert answers[-1].json()["code"] == "E823"
    assert ask("POST", "pairing/claim", {"code": code(ask)}, client="192.0.2.8").status_code == 201


@pytest.mark.parametrize(
    "body",
    [
        *({}, {"name": ""}, {"name": "x" * 65}, {"name": "a\nb"}, {"name": "\ud800"}, {"name": "x", "scope": "root"}),
        *({"name": "x", "days": 0}, {"name": "x", "days": True}, {"name": "x", "days": 3651}, {"name": "x", "a": 1}),
    ],
    ids=str,
)
def test_bad_input_makes_no_code(ask, body):
    assert ask("POST", "pairing", body).status_code == 422
    assert ask("GET", "pairing").status_code == 404


def test_a_code_that_is_ended_holds_no_more(ask):
    ended = code(ask)
    assert ask("DELETE", "pairing").json()["code"] == ended
    assert ask("POST", "pairing/claim", {"code": ended}, client=FAR).status_code == 403
    assert ask("DELETE", "pairing").status_code == 404
