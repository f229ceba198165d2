"""What a request must say of itself: what a page of another origin can send is refused, a program is let through."""

import pytest

from device.access.known_hosts import KnownHosts
from device.access.request_rules import BODY_RULES, AskedRequest, joined, require_allowed
from device.errors import BodyTooLarge, DeviceError, ForeignRequest, UnknownHost, UnknownPath, WrongContentType

HOSTS = KnownHosts(frozenset({"127.0.0.1", "probe.local"}))
OWN = {"host": "127.0.0.1:8000", "content-type": "application/json"}
UNSAFE = ["POST", "PUT", "PATCH", "DELETE"]


def ask(method="POST", path="/api/v1/presses", client="127.0.0.1", **headers):
    stated = {**OWN, **{name.replace("_", "-"): value for name, value in headers.items()}}
    present = {name: value for name, value in stated.items() if value is not None}
    require_allowed(AskedRequest(method, path, present, "127.0.0.1", client), HOSTS)


def code(**asked):
    try:
        ask(**asked)
    except DeviceError as error:
        return error.code
    return None


@pytest.mark.parametrize("method", ["GET", "HEAD", "OPTIONS", *UNSAFE])
@pytest.mark.parametrize("host", [None, "evil.example", "evil.example:8000", "127.0.0.1.evil.example"])
def test_a_name_that_is_none_of_this_machines_is_refused_for_any_method(method, host):
    assert code(method=method, host=host) == "E806" == UnknownHost.code


@pytest.mark.parametrize("method", ["GET", "HEAD", "OPTIONS", *UNSAFE])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\x00", "\x85", "\u2028"])
def test_a_path_with_a_lines_end_is_none_for_any_method(method, end):
    for path in ("/api/v1/presses", "/api/v1/pairing", "/api/v1/updates/roll-back"):
        assert code(method=method, path=path + end) == "E804" == UnknownPath.code


@pytest.mark.parametrize("method", UNSAFE)
@pytest.mark.parametrize(
    "elsewhere",
    [
        {"origin": "http://evil.example"},
        {"origin": "http://127.0.0.1:8001"},
        {"origin": "https://127.0.0.1:8001"},
        {"origin": "http://127.0.0.1"},
        {"origin": "null"},
        {"origin": ""},
        {"origin": "file://"},
        {"origin": "http://127.0.0.1:8000.evil.example"},
        {"origin": "http://127.0.0.1:8000, http://evil.example"},
        {"sec_fetch_site": "cross-site"},
        {"sec_fetch_site": "same-site"},
        {"sec_fetch_site": "cross-site", "origin": "http://127.0.0.1:8000"},
        {"sec_fetch_site": "same-origin", "origin": "http://evil.example"},
    ],
    ids=str,
)
def test_a_page_of_another_origin_cannot_change_anything(method, elsewhere):
    assert code(method=method, **elsewhere) == "E807" == ForeignRequest.code


@pytest.mark.parametrize(
    "own",
    [
        {},
        {"origin": "http://127.0.0.1:8000"},
        {"origin": "http://127.0.0.1:8000", "sec_fetch_site": "same-origin"},
        {"sec_fetch_site": "none"},
        {"host": "probe.local", "origin": "http://probe.local"},
        {"host": "probe.local", "origin": "http://probe.local:80"},
        {"host": "probe.local", "origin": "https://probe.local"},
        {"host": "probe.local:443", "origin": "https://probe.local"},
        {"content_type": "application/json; charset=utf-8"},
        {"content_type": "Application/JSON"},
    ],
    ids=str,
)
@pytest.mark.parametrize("method", UNSAFE)
def test_the_probes_own_page_and_a_program_may(method, own):
    assert code(method=method, **own) is None


def test_a_page_of_another_origin_may_ask_what_changes_nothing():
    """It sends, and cannot read the answer: the browser's own rule."""
    assert code(method="GET", origin="http://evil.example", sec_fetch_site="cross-site", content_type=None) is None


@pytest.mark.parametrize("method", ["POST", "PUT", "PATCH"])
@pytest.mark.parametrize(
    "kind",
    [None, "", "text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=application/json"],
)
def test_what_a_page_may_send_anywhere_without_leave_is_refused(method, kind):
    """A browser says `Origin` with each of them: the Fetch standard, "append a request Origin header"."""
    own = {"origin": "http://127.0.0.1:8000"}
    assert code(method=method, content_type=kind, content_length="0", **own) == "E808" == WrongContentType.code
    assert code(method=method, content_type=kind, content_length="0", sec_fetch_site="same-origin") == "E808"


def test_a_program_need_not_say_of_which_type_a_body_is_that_it_does_not_send():
    """Clients that are generated from openapi.json say none where an operation takes none."""
    assert code(method="POST", content_type=None, content_length="0") is None
    assert code(method="POST", content_type=None) is None
    for body in ({"content_length": "2"}, {"transfer_encoding": "chunked"}):
        assert code(method="POST", content_type=None, **body) == "E808"
    assert code(method="POST", content_type="text/plain", content_length="0") == "E808"


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ({"content_encoding": "gzip"}, "E808"),
        ({"content_encoding": "identity"}, None),
        ({"content_type": "application/json; charset=iso-8859-1"}, "E808"),
        ({"content_type": 'application/json; charset="UTF-8"'}, None),
        ({"content_type": "application/json; charset=utf-8"}, None),
        ({"content_type": "application/json; charset=utf8"}, None),
        ({"content_type": "application/json;charset=UTF-8;"}, None),
        ({"content_type": "application/json; charset=utf-8; v=1"}, None),
        ({"content_type": "application/json; v=1; charset=latin-1"}, "E808"),
        ({"content_encoding": ""}, None),
    ],
)
def test_a_body_that_is_compressed_or_of_another_charset_is_refused_as_such(said, expected):
    assert code(method="POST", content_length="2", **said) == expected


def test_a_delete_needs_a_content_type_only_for_a_body():
    assert code(method="DELETE", content_type=None) is None
    assert code(method="DELETE", content_type=None, content_length="2") == "E808"
    assert code(method="DELETE", content_type=None, transfer_encoding="chunked") == "E808"


@pytest.mark.parametrize("method", ["GET", "POST", "DELETE"])
def test_more_than_64_kb_are_refused_by_the_size_that_is_said(method):
    assert code(method=method, content_length="65536") is None
    assert code(method=method, content_length="65537") == "E809" == BodyTooLarge.code
    assert code(method=method, content_length="9" * 30) == "E809"
    assert code(method=method, content_length="-1") == "E809"


@pytest.mark.parametrize(
    "refused",
    [{"host": "evil.example"}, {"origin": "null"}, {"content_type": "text/plain"}, {"content_length": "99999"}],
    ids=str,
)
def test_a_refusal_says_what_was_wrong_and_what_to_do(refused):
    with pytest.raises(DeviceError) as refusal:
        ask(**refused)
    assert refusal.value.cause.endswith(".")
    assert refusal.value.remedy.endswith(".")


class TestAPathWithARuleOfItsOwn:
    path = "/api/v1/updates"

    def test_it_takes_a_release_file_from_this_machine(self):
        size = str(BODY_RULES[self.path].max_bytes)
        assert code(path=self.path, content_type="application/octet-stream", content_length=size) is None
        assert code(path=self.path, content_type="application/octet-stream", content_length=size + "0") == "E809"

    def test_it_takes_nothing_else(self):
        assert code(path=self.path) == "E808"

    @pytest.mark.parametrize("client", ["192.168.1.7", None, "::ffff:10.0.0.1"])
    def test_it_takes_none_from_another_machine_which_may_still_ask(self, client):
        assert code(path=self.path, client=client, content_type="application/octet-stream") == "E807"
        assert code(path=self.path, client=client, method="GET") is None

    def test_the_way_back_is_asked_for_at_this_machine_too(self):
        assert code(path=self.path + "/roll-back") is None
        assert code(path=self.path + "/roll-back", client="192.168.1.7") == "E807"

    def test_a_path_below_it_has_the_common_rule(self):
        assert code(path=self.path + "/x", content_type="application/octet-stream") == "E808"


def test_a_header_that_is_there_twice_is_neither_of_the_two():
    both = joined([("Host", "127.0.0.1"), ("HOST", "evil.example"), ("X", "1")])
    assert both == {"host": "127.0.0.1, evil.example", "x": "1"}
    with pytest.raises(UnknownHost):
        require_allowed(AskedRequest("GET", "/", both, "127.0.0.1"), HOSTS)


def own_screen(client="127.0.0.1", version="1.1", **headers):
    return AskedRequest("GET", "/", {"host": "127.0.0.1:8000", **headers}, "127.0.0.1", client, False, version)


@pytest.mark.parametrize("host", ["127.0.0.1:8000", "localhost:8000", "[::1]:8000", "LOCALHOST"])
def test_the_own_screen_asks_by_loopback_and_its_name(host):
    assert own_screen(host=host).is_own_screen


@pytest.mark.parametrize(
    "passed_on",
    [
        {"client": "192.0.2.7"},
        {"client": None},
        {"host": "probe.local"},
        {"host": "127.0.0.1.evil.example"},
        {"host": ""},
        {"version": "1.0"},
        {"x-forwarded-for": "127.0.0.1"},
        {"x-forwarded-for": ""},
        {"x-real-ip": "127.0.0.1"},
        {"forwarded": "for=127.0.0.1"},
        {"via": "1.1 proxy"},
        {"x-forwarded-host": "localhost"},
        {"x-forwarded-proto": "https"},
    ],
    ids=str,
)
def test_what_a_proxy_on_the_machine_passes_on_is_not_the_own_screens(passed_on):
    assert not own_screen(**passed_on).is_own_screen
