"""Whether a release is healthy: its daemon is asked for every part, until all are ready three times in a row.

A fault that was there before the switch is not the new release's. The models' answers and the store depend on no
cable, and have to be ready always. A first release has nothing before it: where its daemon does not start for what it
says is its machine's, as a part that is not wired yet, no other release would, and without it nobody could look why.
A later one that does not start for the same is no worse.

A release that refuses settings which the one before took is not healthy: it runs on the last good ones, but passes over
each that it does not know, and its default holds. Of a limit of light or force nobody would notice.
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

from device.access.known_hosts import LOOPBACK_ADDRESS, asked_at
from device.files.plain_settings import DaemonAddress
from device.files.start_note import StartNote, read_note

Answer = TypeVar("Answer")

PATH, STATUS = "/api/v1/health/parts", "/api/v1/status"
UNDER_WAY = ("waiting", "capturing", "computing", "running")
LONGEST_PRESS_S = 180.0
PARTS = ("camera", "light", "force", "answers", "store")
"""In the order in which they are looked at: where the store is not ready, all others are."""
ALWAYS = ("answers", "store")
FULL_DISK = "E602"
SETTINGS, OLD_SETTINGS = "settings", "E002"
"""What is no part, but may be at fault too, and its code: the files are bad, and the last good settings in use."""
ANSWER_WITHIN_S, MOST_BYTES = 5.0, 2**16
Baseline = dict[str, str | None]
"""The parts that were not ready before the switch, each with its fault's code; the settings, too."""


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


class DiskRefuses(NotHealthy):
    """All that is missing is the store, which says that the disk is full: no release does that."""


class RefusesSettings(NotHealthy):
    """It runs on its last good settings, and the release before ran on the files."""


class DaemonGone(NotHealthy):
    """Nobody listens on the port, or somebody else does: the page that stands in for a daemon (device/fallback/)."""


def ask_parts(address: DaemonAddress) -> PartsHealth:
    """Return what the daemon of this machine says of its parts; raise `NotHealthy` when it does not answer so."""
    return _asked(address, PATH, _read)


def ask_settings(address: DaemonAddress) -> str:
    """Return why the daemon runs on its last good settings, with the setting's name; "" where it runs on its files.

    Raises `NotHealthy` when it does not answer so.
    """
    return _asked(address, STATUS, lambda status: next(
        (str(fault["cause"]) for fault in status["faults"] if fault["code"] == OLD_SETTINGS), ""
    ))  # fmt: skip


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
            baseline: Baseline = {part: code for part, code in ask_parts(address).faults.items() if code is not None}
            return baseline | ({SETTINGS: OLD_SETTINGS} if ask_settings(address) else {})
        except NotHealthy:
            continue
    return None


def wait_until_healthy(
    address: DaemonAddress,
    release: str,
    baseline: Baseline | None,
    patience: Patience,
    told: Callable[[float], None],
    excused: ExcusedStarts | None = None,
) -> str:
    """Return when the release was healthy at every one of some looks in a row, or its starts are excused: that, or "".

    Raises `NotHealthy` when time is up, or at once when a daemon that was healthy is gone; `RefusesSettings` at once;
    `DiskRefuses` when time is up and only the disk was in the way. `told` hears, from 0 to 1, how much of the time is
    over.
    """
    began, healthy, reason, kind = time.monotonic(), 0, "it was not ready often enough", NotHealthy
    while healthy < patience.looks:
        spent = time.monotonic() - began
        told(min(1.0, spent / patience.within_s))
        try:
            _require_healthy(ask_parts(address), release, baseline)
            healthy += 1
            _require_own_settings(address, baseline)
        except RefusesSettings:
            raise  # that lasts until its next start
        except NotHealthy as error:
            if healthy and isinstance(error, DaemonGone):
                raise NotHealthy(f"It was ready, and then {error}.") from None  # though systemd starts it again
            healthy, reason = 0, str(error)
            kind = DiskRefuses if isinstance(error, DiskRefuses) else NotHealthy
            is_gone, is_last = isinstance(error, DaemonGone), spent > patience.within_s
            if excused and is_gone and (words := excused.words(is_last=is_last)):
                return words
        if healthy < patience.looks:
            if spent > patience.within_s:
                raise kind(f"After {patience.within_s:g} s {reason}.")
            time.sleep(patience.every_s)
    return ""


class ExcusedStarts:
    """Starts of a release that fail for what is its machine's alone, by the daemon's own notes.

    So they are for a first release, which has nothing before it that would start, and for a later one that lacks no
    more than the one before.
    """

    def __init__(self, root: Path, release: str, *, lacking: str | None) -> None:
        """Take the codes, in one text, that the release before could not start for; None for a first release."""
        self._root, self._release, self._lacking = root, release, lacking
        self._seen = set[int]()

    def words(self, *, is_last: bool) -> str:
        """Return why, in words, once a second process has said so, or one when no more time is left; else ""."""
        note = read_note(self._root)
        if note is None or note.release != self._release or not note.is_of_the_machine or self._has_more(note):
            self._seen.clear()
            return ""
        self._seen.add(note.pid)
        return str(note) if is_last or len(self._seen) > 1 else ""

    def _has_more(self, note: StartNote) -> bool:
        return self._lacking is not None and not set(note.codes) <= set(self._lacking.split())


def codes_of_failed_start(root: Path, release: str | None) -> str:
    """Return for which codes a release does not start, in one text, by its own note; "" where there is none."""
    note = read_note(root)
    return " ".join(note.codes) if note and note.release == release else ""


def _require_healthy(health: PartsHealth, release: str, baseline: Baseline | None) -> None:
    if health.release != release:
        raise DaemonGone(f"the daemon that answers is {health.release or 'of no release'}")
    for part in PARTS:
        if part not in health.faults:
            raise NotHealthy(f"the daemon says nothing of its {part}")
        code = health.faults[part]
        if code is not None and not _is_excused(part, code, baseline):
            kind = DiskRefuses if part == "store" and code == FULL_DISK else NotHealthy
            raise kind(f"{part} is not ready ({code or 'without a code'})")


def _require_own_settings(address: DaemonAddress, baseline: Baseline | None) -> None:
    """Raise `RefusesSettings` where the release does, and the one before did not.

    Where nobody could tell, as on the way back to a release that a newer setting is unknown to, nothing is asked.
    """
    if baseline is None or baseline.get(SETTINGS):
        return
    if cause := ask_settings(address):
        raise RefusesSettings(f"It refuses settings that the release before took ({OLD_SETTINGS}): {cause}")


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
