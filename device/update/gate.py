"""Whether a release is healthy: its daemon is asked for every part, until all are ready three times in a row.

A fault that was there before the switch is not the new release's. The models' answers and the store depend on no
cable, and have to be ready always. A first release has nothing before it: where its daemon does not start for what it
says is its machine's, as a part that is not wired yet, no other release would, and without it nobody could look why.
"""

from __future__ import annotations

import errno
import http.client
import json
import os
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from device.access.known_hosts import asked_at
from device.files.plain_settings import DaemonAddress
from device.files.start_note import read_note

Answer = TypeVar("Answer")

PATH, STATUS = "/api/v1/health/parts", "/api/v1/status"
UNDER_WAY = ("waiting", "capturing", "computing", "running")
LONGEST_PRESS_S = 180.0
PARTS = ("camera", "light", "force", "answers", "store")
ALWAYS = ("answers", "store")
OF_THE_MACHINE = ("E001", "E1", "E2", "E3")
"""How codes of settings, camera, light and load cell begin."""
LOOPBACK_ADDRESS = "127.0.0.1"
ANSWER_WITHIN_S, MOST_BYTES = 5.0, 2**16
Baseline = dict[str, str | None]
"""The parts that were not ready before the switch, each with its fault's code."""


@dataclass(frozen=True)
class Patience:
    """How long a release may take to be healthy, and how often it has to be seen so."""

    within_s: float = 120.0
    every_s: float = 2.0
    looks: int = 3


@dataclass(frozen=True)
class PartsHealth:
    """What the daemon says: which release it is, and of each part None when ready, else its fault's code or ""."""

    release: str
    faults: Mapping[str, str | None]


class NotHealthy(Exception):  # noqa: N818 - it is an answer, not an error of the updater
    """The release was not healthy in its time; says what was missing at the last look."""


class DaemonGone(NotHealthy):
    """Nobody listens on the port, or somebody else does: the page that stands in for a daemon (device/fallback/)."""


def ask_parts(address: DaemonAddress) -> PartsHealth:
    """Return what the daemon of this machine says of its parts; raise `NotHealthy` when it does not answer so."""
    return _asked(address, PATH, _read)


def wait_for_press(address: DaemonAddress, every_s: float) -> None:
    """Return once no press and no self-test is under way: to stop the daemon in one would lose it.

    Returns at once when nobody can tell, and after three minutes all the same.
    """
    until_s = time.monotonic() + LONGEST_PRESS_S
    while _is_pressed(address) and time.monotonic() < until_s:
        time.sleep(every_s)


def _is_pressed(address: DaemonAddress) -> bool:
    try:
        return _asked(address, STATUS, lambda status: any(
            (status.get(job) or {}).get("state") in UNDER_WAY for job in ("press", "self_test")
        ))  # fmt: skip
    except NotHealthy:
        return False


def _asked(address: DaemonAddress, path: str, read: Callable[[Any], Answer]) -> Answer:
    """Return what `read` makes of the daemon's answer; raise `NotHealthy` when there is none, or none of a daemon."""
    port, line = address.port, None
    try:
        line = _line(address)
        line.request("GET", path)
        answer = line.getresponse()
        record = json.loads(answer.read(MOST_BYTES))
        if answer.status == http.client.SERVICE_UNAVAILABLE:
            raise DaemonGone(f"the daemon does not start ({record['code']}: {record['detail']})")
        return read(record)
    except (OSError, http.client.HTTPException) as error:
        kind = DaemonGone if isinstance(error, ConnectionError) else NotHealthy
        raise kind(f"the daemon does not answer on port {port} ({error or type(error).__name__})") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise DaemonGone(f"what answers on port {port} is no daemon of a probe") from None
    finally:
        if line:
            line.close()


def _line(address: DaemonAddress) -> http.client.HTTPConnection:
    """Connect to the daemon: by loopback, or where one of an earlier release, or the fallback, has no other port."""
    for place in (LOOPBACK_ADDRESS, asked_at(address.host)):
        line = http.client.HTTPConnection(place, address.port, timeout=ANSWER_WITHIN_S)
        with suppress(ConnectionRefusedError):
            line.connect()
            return line
    raise ConnectionRefusedError(errno.ECONNREFUSED, os.strerror(errno.ECONNREFUSED))


def take_baseline(address: DaemonAddress, patience: Patience) -> Baseline | None:
    """Return what is not ready before the switch, or None when the daemon does not answer for a few looks."""
    for look in range(patience.looks):
        if look:
            time.sleep(patience.every_s)
        try:
            return {part: code for part, code in ask_parts(address).faults.items() if code is not None}
        except NotHealthy:
            continue
    return None


def wait_until_healthy(
    address: DaemonAddress,
    release: str,
    baseline: Baseline | None,
    patience: Patience,
    told: Callable[[float], None],
    *,
    excuse: Callable[[], str] = str,
) -> str:
    """Return when the release was healthy at every one of some looks in a row: what `excuse` said at the last, or "".

    `excuse` says in words why a daemon that does not start is not to be blamed, and "" when it is. Raises `NotHealthy`
    when time is up, or at once when a daemon that was healthy is gone. `told` hears, from 0 to 1, how much of the time
    is over.
    """
    began, healthy, reason, words = time.monotonic(), 0, "", ""
    while healthy < patience.looks:
        spent = time.monotonic() - began
        told(min(1.0, spent / patience.within_s))
        try:
            _require_healthy(ask_parts(address), release, baseline)
            healthy, words = healthy + 1, ""
        except NotHealthy as error:
            words = excuse() if isinstance(error, DaemonGone) else ""
            if healthy and not words and isinstance(error, DaemonGone):
                raise NotHealthy(f"It was ready, and then {error}.") from None  # though systemd starts it again
            healthy, reason = healthy + 1 if words else 0, str(error)
        if healthy < patience.looks:
            if spent > patience.within_s:
                raise NotHealthy(f"After {patience.within_s:g} s {reason or 'it was not ready often enough'}.")
            time.sleep(patience.every_s)
    return words


def what_the_machine_lacks(root: Path, release: str) -> str:
    """Return why a release's daemon does not start, by its own note, if all of that is its machine's; "" otherwise."""
    note = read_note(root)
    if note is None or note.release != release or not all(
        fault["code"].startswith(OF_THE_MACHINE) for fault in note.faults
    ):  # fmt: skip
        return ""
    return " ".join(f"{fault['code']} {fault['cause']}" for fault in note.faults)


def _require_healthy(health: PartsHealth, release: str, baseline: Baseline | None) -> None:
    if health.release != release:
        raise DaemonGone(f"the daemon that answers is {health.release or 'of no release'}")
    for part in PARTS:
        if part not in health.faults:
            raise NotHealthy(f"the daemon says nothing of its {part}")
        code = health.faults[part]
        if code is not None and not _is_excused(part, code, baseline):
            raise NotHealthy(f"{part} is not ready ({code or 'without a code'})")


def _is_excused(part: str, code: str, baseline: Baseline | None) -> bool:
    """Return whether a fault is not held against the release: it was there, or nobody could tell whether it was."""
    if part in ALWAYS:
        return False
    return baseline is None or baseline.get(part) == code


def _read(record: Mapping[str, Mapping[str, Mapping[str, object]]]) -> PartsHealth:
    faults = {
        name: None if part["ready"] is True else str(part["code"] or "") for name, part in record["parts"].items()
    }
    return PartsHealth(str(record["release"] or ""), faults)
