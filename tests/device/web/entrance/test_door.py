"""The door: every operation against no token, wrong, expired, revoked and narrow ones, and the own screen."""

import asyncio
import json
import types

import httpx
import pytest
from daemon_process import ROOT

from device.access.request_rules import AskedRequest
from device.access.scopes import SCOPES, may, need_of
from device.errors import DeviceError, ScopeNeeded, TokenNeeded, TooManyTries, UnencryptedRequest
from device.records.store import Store
from device.web.app import create_app
from device.web.entrance.door import COOKIE, Door, bearer, cookie

DOCUMENT = json.loads((ROOT / "docs" / "openapi.json").read_text())
OPERATIONS = sorted((method.upper(), path) for path, found in DOCUMENT["paths"].items() for method in found)
PROBE = "probe.local"


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    opened = Store(tmp_path_factory.mktemp("var"))
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def secrets(store):
    made = {scope: store.tokens.make(f"{scope} PC", scope, days=1) for scope in SCOPES}
    revoked, secret = store.tokens.make("Gone", "admin", days=1)
    store.tokens.revoke(revoked.id)
    expired = store.tokens.make("Old", "admin", days=0)[1]
    return {**{scope: secret for scope, (_, secret) in made.items()}, "revoked": secret, "expired": expired}


@pytest.fixture
def door(store):
    return Door(store.tokens)


def request(method="GET", path="/api/v1/status", *, client="192.0.2.7", host=PROBE, is_encrypted=True, **headers):
    return AskedRequest(method, path, {"host": host, **headers}, "192.0.2.1", client, is_encrypted)


def with_token(secret):
    return {"authorization": f"Bearer {secret}"}


@pytest.mark.parametrize(("method", "path"), OPERATIONS, ids=" ".join)
@pytest.mark.parametrize("scope", SCOPES)
def test_each_scope_is_let_in_to_what_it_may_and_to_nothing_else(door, secrets, scope, method, path):
    asked = request(method, path, **with_token(secrets[scope]))
    if may(scope, need_of(method, path)):
        assert door.require(asked).name == f"{scope} PC"
    else:
        with pytest.raises(ScopeNeeded) as refusal:
            door.require(asked)
        assert refusal.value.code == "E821"


@pytest.mark.parametrize(("method", "path"), OPERATIONS, ids=" ".join)
@pytest.mark.parametrize("token", [None, "wrong", "revoked", "expired", "empty", "basic"])
def test_without_a_token_that_holds_nothing_is_answered_but_what_is_open(store, secrets, token, method, path):
    said = {
        None: {},
        "wrong": with_token("tsis_" + "x" * 43),
        "empty": with_token(""),
        "basic": {"authorization": "Basic YWRtaW46YWRtaW4="},
    }
    asked = request(method, path, **(said[token] if token in said else with_token(secrets[token])))
    if need_of(method, path) == "nothing":
        assert Door(store.tokens).require(asked).scope is None
    else:
        with pytest.raises(TokenNeeded) as refusal:
            Door(store.tokens).require(asked)
        assert refusal.value.code == "E820"


def test_the_own_screen_may_all_and_a_token_on_loopback_only_what_it_may(door, secrets):
    here = {"client": "127.0.0.1", "host": "127.0.0.1:8000", "is_encrypted": False}
    for method, path in OPERATIONS:
        assert door.require(request(method, path, **here)).name == "screen"
    with pytest.raises(ScopeNeeded):
        door.require(request("POST", "/api/v1/presses", **here, **with_token(secrets["read"])))


def test_by_loopback_but_not_as_the_own_screen_a_token_is_needed(door, secrets):
    proxied = {"client": "127.0.0.1", "host": PROBE, "is_encrypted": False}
    with pytest.raises(TokenNeeded):
        door.require(request(**proxied))
    assert door.require(request(**proxied, **with_token(secrets["read"]))).name == "read PC"
    with pytest.raises(TokenNeeded):
        door.require(request(client="127.0.0.1", host="localhost", is_encrypted=False, **{"x-forwarded-for": "::1"}))


@pytest.mark.parametrize("path", ["/", "/api/v1/status", "/api/v1/health/live", "/api/v1/pairing/claim"])
def test_in_clear_no_other_machine_is_answered_with_whatever_token(door, secrets, path):
    for headers in ({}, with_token(secrets["admin"])):
        with pytest.raises(UnencryptedRequest) as refusal:
            door.require(request(path=path, is_encrypted=False, **headers))
        assert refusal.value.code == "E824"


def test_a_cookie_is_a_token_too(door, secrets):
    assert door.require(request(cookie=f"a=b; {COOKIE}={secrets['read']}")).name == "read PC"
    with pytest.raises(TokenNeeded):
        door.require(request(cookie=f"tsis={secrets['read']}"))
    assert COOKIE.startswith("__Host-")


def test_a_token_in_the_address_is_none(door, secrets):
    with pytest.raises(TokenNeeded):
        door.require(request(path=f"/api/v1/status?token={secrets['admin']}"))


def test_who_sends_many_wrong_tokens_waits_and_a_right_one_is_let_in(door, secrets):
    seen = set()
    for number in range(20):
        with pytest.raises(DeviceError) as refusal:
            door.require(request(**with_token(f"tsis_{number}")))
        seen.add(type(refusal.value))
    assert seen == {TokenNeeded, TooManyTries}
    assert door.require(request(**with_token(secrets["read"]))).name == "read PC"
    with pytest.raises(TokenNeeded):
        door.require(request(client="192.0.2.9", **with_token("tsis_x")))


@pytest.mark.parametrize(
    ("said", "found"),
    [("Bearer x", "x"), ("bearer  x ", "x"), ("Basic x", ""), ("Bearer", ""), ("", ""), (None, None)],
)
def test_an_authorization_is_read_as_a_bearers_or_as_a_wrong_one(said, found):
    assert bearer(request(**({} if said is None else {"authorization": said}))) == found


@pytest.mark.parametrize("said", ["", ";;;", "\x00", f"{COOKIE}", "a=b", "=" * 5000])
def test_what_is_no_cookie_is_none(said):
    assert cookie(request(cookie=said)) is None


def answered(store, path, secret=None):
    """Return what another machine is answered, with a token or without."""
    app = create_app(types.SimpleNamespace(), store, door=Door(store.tokens))

    async def ask():
        transport = httpx.ASGITransport(app, client=("192.0.2.7", 4321))
        async with httpx.AsyncClient(transport=transport, base_url="https://localhost") as http:
            return await http.get(path, headers=with_token(secret) if secret else {})

    return asyncio.run(ask())


def test_a_refusal_says_how_it_is_asked_for_and_the_screen_leads_to_pairing(store):
    refused = answered(store, "/api/v1/exams")
    assert (refused.status_code, refused.headers["www-authenticate"]) == (401, "Bearer")
    assert (refused.json()["code"], refused.headers["content-type"]) == ("E820", "application/problem+json")
    screen = answered(store, "/")
    assert (screen.status_code, screen.headers["location"]) == (303, "/pair")
    assert answered(store, "/pair").status_code == 200


@pytest.mark.parametrize(
    ("path", "status"), [("/api/v1/health/live", 200), ("/api/v1/tokens", 200), ("/api/v1/unknown", 404)]
)
def test_a_token_in_its_last_month_is_told_its_end_with_every_answer(store, path, status):
    soon, secret = store.tokens.make("Soon", "admin", days=30)
    answer = answered(store, path, secret)
    assert (answer.status_code, answer.headers["token-expires"]) == (status, soon.expires_at)


def test_a_token_that_holds_longer_one_that_holds_no_more_and_none_are_told_no_end(store, secrets):
    later = store.tokens.make("Later", "admin", days=31)[1]
    for secret, status in ((later, 200), (secrets["expired"], 401), (secrets["revoked"], 401), (None, 401)):
        answer = answered(store, "/api/v1/tokens", secret)
        assert (answer.status_code, answer.headers.get("token-expires")) == (status, None)
