"""A page of another origin in a real Chromium, on the probe's own machine: it starts nothing and takes no zero.

It tries everything that a browser lets a page send anywhere without asking for leave.
"""

from __future__ import annotations

import functools
import http.server
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from chromium import chromium_page
from daemon_process import Daemon, wait_for
from playwright.sync_api import Page

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
PATHS = ("presses", "tare", "self-test")
REBOUND = "rebound.example"
FORM = """<form method="POST" action="{url}/api/v1/{path}" enctype="{kind}"><input name="{{" value="}}"></form>"""
SILENT = {
    "no-cors": "([url]) => fetch(url, {method: 'POST', mode: 'no-cors'}).catch(String)",
    "no-cors with a body": "([url]) => fetch(url, {method: 'POST', mode: 'no-cors', body: '{}'}).catch(String)",
    "no-cors that says JSON": "([url]) => fetch(url, {method: 'POST', mode: 'no-cors', body: '{}',"
    " headers: {'Content-Type': 'application/json'}}).catch(String)",  # the browser sends text/plain
    "a beacon": "([url]) => navigator.sendBeacon(url, '{}')",
}
ASKING = (
    "([url]) => fetch(url, {method: 'POST', body: '{}', headers: {'Content-Type': 'application/json'}}).catch(String)"
)


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with chromium_page(f"--host-resolver-rules=MAP {REBOUND} 127.0.0.1") as page:
        yield page


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    """A folder, and the address at which its pages are served: the same machine, another port."""
    folder = tmp_path_factory.mktemp("elsewhere")
    (folder / "index.html").write_text("<!doctype html><title>elsewhere</title>")
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=folder)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        serving = threading.Thread(target=server.serve_forever)
        serving.start()
        yield folder, f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        serving.join()


@pytest.fixture
def untouched(daemon: Daemon) -> Iterator[None]:
    """Nothing happens to the probe meanwhile."""

    def state() -> tuple[object, ...]:
        status = daemon.ask("/api/v1/status").json
        return status["press"], status["self_test"], Path(daemon.log.name).read_text().count("tared")

    before = state()
    yield
    assert state() == before


def refusals(daemon: Daemon, path: str) -> int:
    """Return how often the daemon has refused a page of another origin, by its log."""
    return Path(daemon.log.name).read_text().count(f"E807 POST /api/v1/{path} ")


@pytest.mark.usefixtures("untouched")
@pytest.mark.parametrize("way", SILENT)
def test_what_a_page_elsewhere_sends_without_asking_for_leave_is_refused(daemon, page, elsewhere, way):
    page.goto(elsewhere[1])
    for path in PATHS:
        before = refusals(daemon, path)
        page.evaluate(SILENT[way], [f"{daemon.url}/api/v1/{path}"])
        wait_for(lambda path=path: refusals(daemon, path), lambda found, before=before: found > before)


@pytest.mark.usefixtures("untouched")
@pytest.mark.parametrize("kind", ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data"])
def test_a_form_elsewhere_that_is_sent_here_is_refused(daemon, page, elsewhere, kind):
    folder, url = elsewhere
    for path in PATHS:
        name = f"{path}-{kind.partition('/')[2]}.html"
        (folder / name).write_text(FORM.format(url=daemon.url, path=path, kind=kind))
        page.goto(f"{url}/{name}")
        with page.expect_response(f"**/api/v1/{path}") as answer:
            page.evaluate("document.forms[0].submit()")
        assert answer.value.status == 403
        assert answer.value.json()["code"] == "E807"


@pytest.mark.usefixtures("untouched")
def test_a_page_elsewhere_that_asks_for_leave_gets_none(daemon, page, elsewhere):
    page.goto(elsewhere[1])
    for path in PATHS:
        assert "Failed to fetch" in page.evaluate(ASKING, [f"{daemon.url}/api/v1/{path}"])


def test_a_name_that_was_made_to_resolve_to_the_probe_is_not_answered(daemon, page):
    port = daemon.url.rpartition(":")[2]
    answer = page.goto(f"http://{REBOUND}:{port}/api/v1/measurements")
    assert answer.status == 421
    assert answer.json()["code"] == "E806"


def test_a_page_elsewhere_cannot_frame_the_screen(daemon, page, elsewhere):
    folder, url = elsewhere
    (folder / "frame.html").write_text(f'<iframe src="{daemon.url}/"></iframe>')
    with page.expect_console_message(lambda message: "frame-ancestors" in message.text):
        page.goto(f"{url}/frame.html")


def test_the_probes_own_page_may(daemon, page):
    """The same words, sent from here, are heard: else nothing of the above would be shown."""
    page.goto(daemon.url)
    with page.expect_response("**/api/v1/tare") as answer:
        page.evaluate(ASKING, [f"{daemon.url}/api/v1/tare"])
    assert answer.value.status == 200
