"""What tsis-fallback.service promises under a real systemd: why there is no daemon, without a gap, and its return."""

from __future__ import annotations

import re
import time
import urllib.error
import urllib.request
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from claim import Claim
from service import BOARD, NAME, Service, run, until

FALLBACK = "tsis-fallback.service"
PAGE = "http://127.0.0.1:8000/"
PACKAGES = "lib/python3*/site-packages"
WATCHED_S = 15.0
BAD_SCENE = "[settings.press]\ntarget_n = 99.0\n"


def page() -> str:
    """Return what stands on the daemon's port, empty when nobody answers."""
    try:
        with urllib.request.urlopen(PAGE, timeout=10) as answer:
            return str(answer.read().decode())
    except urllib.error.HTTPError as error:
        with error:
            return error.read().decode()
    except OSError:
        return ""


def says(words: str) -> Callable[[], bool]:
    """Return whether the fallback's page has these words."""
    return lambda: 'class="fallback"' in page() and words in page()


def codes() -> tuple[str, ...]:
    """Return the codes on the fallback's page; "nobody" when none answers, "daemon" when that one does."""
    seen = page()
    if 'class="fallback"' not in seen:
        return ("daemon",) if seen else ("nobody",)
    return tuple(re.findall(r'"fault-code">(\w+)<', seen))


def analysed() -> Iterator[Claim]:
    """The unit as systemd reads it."""
    complaints = run("systemd-analyze", "verify", "--man=no", f"/usr/lib/systemd/system/{FALLBACK}").stderr
    yield Claim(f"systemd-analyze verify has no complaint of {FALLBACK}", not complaints, complaints)


def refused(service: Service) -> Iterator[Claim]:
    """Bad settings: the reason stands there without a gap while systemd tries again, until they are mended."""
    run("systemctl", "start", FALLBACK)
    until("the page of a probe that is stopped", says("is stopped"), 30)
    (BOARD / "scene.toml").write_text(BAD_SCENE)
    run("systemctl", "start", "--no-block", NAME)
    took_s = until("the reason on the page", says("press.target_n is 99"), 60)
    yield Claim("a start that is refused stands on the page with its code", codes() == ("E001",), f"{took_s:.1f} s")
    before, until_s, seen = int(service.shown("NRestarts")), time.monotonic() + WATCHED_S, Counter[tuple[str, ...]]()
    while time.monotonic() < until_s or int(service.shown("NRestarts")) == before:
        seen[codes()] += 1
    yield Claim("and stays there without a gap while it is tried again", set(seen) == {("E001",)}, dict(seen))
    (BOARD / "scene.toml").write_text("")
    took_s = until("the daemon", service.is_ready, 90)
    yield Claim("mended, the daemon has its port", codes() == ("daemon",), f"{took_s:.1f} s")


def broken(service: Service) -> Iterator[Claim]:
    """A release that cannot be imported, on a probe with another one."""
    service.stop()
    [numpy] = Path("/opt/tsis/current").glob(f"{PACKAGES}/numpy")
    away = numpy.rename(numpy.with_name("numpy.away"))
    run("systemctl", "start", "--no-block", NAME)
    took_s = until("the last words on the page", says("No module named &#x27;numpy&#x27;"), 60)
    yield Claim("a release that cannot be imported has its last words there", codes() == ("E000",), f"{took_s:.1f} s")
    headers = {"Content-Type": "application/json"}
    ask = urllib.request.Request(f"{PAGE}api/v1/updates/roll-back", method="POST", headers=headers)
    with urllib.request.urlopen(ask, timeout=10) as answer:
        wish = Path("/var/lib/tsis-update/incoming/roll_back")
        yield Claim("the updater is asked for the release before", answer.status == 202 and wish.exists())
    wish.unlink()
    away.rename(numpy)
    until("the daemon", service.is_ready, 90)
    yield Claim(
        "without a restart of the fallback",
        run("systemctl", "show", "--value", "--property=NRestarts", FALLBACK).stdout.strip() == "0",
    )
    service.stop()
    run("systemctl", "stop", FALLBACK)


def fallback_stories(service: Service) -> list[Callable[[], Iterator[Claim]]]:
    """Return the stories in their order; they leave both units stopped."""
    return [analysed, *(partial(story, service) for story in (refused, broken))]
