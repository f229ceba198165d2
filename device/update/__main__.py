"""`python -m device.update`: install a release, go back to the previous one, and what the probe's units call.

It needs the standard library alone, so that it runs when the packages of a release do not, and on a fresh system from
the wheel itself: `PYTHONPATH=tsis-0.2.0-py3-none-any.whl python3 -m device.update install FILE`.

Exit codes: 0 ok, 1 failed or refused or rolled back, 2 usage.
"""

from __future__ import annotations

import argparse
import fcntl
import json
import logging
import math
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import BinaryIO

from device.errors import BusyError, DeviceError, RolledBack, UpdateFailed
from device.update.boot_check import check_boot
from device.update.contents import damage
from device.update.fits import require_machine
from device.update.follow import follow, receive, request_roll_back
from device.update.gate import Patience
from device.update.incoming import BUSY, clear_incoming, take_roll_back_request, take_uploaded
from device.update.install import install, roll_back
from device.update.layout import UpdateLayout
from device.update.manifest import read_manifest
from device.update.progress import ProgressReport, UpdateProgress, read_progress
from device.update.release_file import opened
from device.update.state import read_state
from device.update.trial import Updater, carry_through

log = logging.getLogger(__name__)
ABOUT = "Signed updates of the probe's software."
EXAMPLES = """examples:
  python -m device.update install /media/stick/tsis-0.2.0-bookworm-aarch64.release   install, watch, commit or come back
  python -m device.update roll-back                                         the previous release
  python -m device.update status --verify                                   what runs, and whether it is whole
Whoever is not root hands the file over to the updater and follows it.
"""
BEFORE_AGAIN_S = 10.0
MOST_SECONDS = 86400.0
SCHEMA = "tsis.update_status/1"


def add_update_verbs(parser: argparse.ArgumentParser) -> None:
    """Add verbs and options, but for `--root`, which is a program's own."""
    parser.formatter_class, parser.epilog = argparse.RawDescriptionHelpFormatter, EXAMPLES
    standard = Patience()
    parser.add_argument(
        "--health-within", type=_seconds, default=standard.within_s, metavar="SECONDS",
        help=f"how long a release may take to be healthy (default {standard.within_s:g})",
    )  # fmt: skip
    parser.add_argument(
        "--look-every", type=_seconds, default=standard.every_s, metavar="SECONDS",
        help=f"time between two looks at its health (default {standard.every_s:g})",
    )  # fmt: skip
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    verbs.add_parser("install", help="install a release file").add_argument("file", type=Path, metavar="FILE")
    verbs.add_parser("receive", help="take a release file from standard input to the updater, and follow it")
    verbs.add_parser("roll-back", help="go back to the previous release")
    fits = verbs.add_parser("fits", help="whether a release file can run on this machine; changes nothing")
    fits.add_argument("file", type=Path, metavar="FILE")
    status = verbs.add_parser("status", help="what is installed, and how far an update is")
    status.add_argument("--json", action="store_true", help="as JSON")
    status.add_argument("--verify", action="store_true", help="compare every file of the releases with its hash")
    verbs.add_parser("boot-check", help="before the daemon: settle what a power cut interrupted")
    verbs.add_parser("resume", help="carry the release on trial through")
    verbs.add_parser("watch-incoming", help="resume, then do what waits in the folder incoming")


def _seconds(text: str) -> float:
    """Return a time (s); raise `argparse.ArgumentTypeError` for one that is none."""
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0.0 < seconds <= MOST_SECONDS:
        raise argparse.ArgumentTypeError(f"{text!r} is no time: give seconds above 0 and at most {MOST_SECONDS:g}")
    return seconds


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line; return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m device.update", description=ABOUT)
    parser.add_argument("--root", type=Path, default=Path("/"), metavar="DIR", help="folder that stands for /")
    add_update_verbs(parser)
    return run_update(parser.parse_args(arguments))


def run_update(options: argparse.Namespace) -> int:
    """Do what a command line asks; return its exit code."""
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    os.umask(0o022)
    layout = UpdateLayout(options.root)
    try:
        return _run(options, layout)
    except DeviceError as error:
        print(f"{error.code} {str(error).strip()}", file=sys.stderr)
    except OSError as error:
        failed = UpdateFailed(f"The disk refuses: {error}.", "Free space, then run `python -m device.update resume`.")
        print(f"{failed.code} {failed}", file=sys.stderr)
    return 1


def _run(options: argparse.Namespace, layout: UpdateLayout) -> int:
    if options.verb == "status":
        return _status(options, layout)
    if options.verb == "fits":
        with opened(options.file) as file:
            require_machine(read_manifest(file.signed()[0]))
        return 0
    if options.verb == "receive":
        return _follow(layout, receive(layout, sys.stdin.buffer))
    if not _may_install(layout):
        return _hand_over(options, layout)
    updater = Updater(layout, ProgressReport(layout, _show), Patience(options.health_within, options.look_every))
    with _only_one(layout, waits=options.verb not in ("install", "roll-back")):
        _VERBS[options.verb](updater, options)
    return 0


def _install(updater: Updater, options: argparse.Namespace) -> None:
    install(updater, options.file)


def _roll_back(updater: Updater, options: argparse.Namespace) -> None:
    roll_back(updater)


def _check_boot(updater: Updater, options: argparse.Namespace) -> None:
    print(check_boot(updater))


def _resume(updater: Updater, options: argparse.Namespace) -> None:
    carry_through(updater)


def _watch_incoming(updater: Updater, options: argparse.Namespace) -> None:
    """Do what waits; how it ended is in the progress, and no failure of the unit.

    What waits on a disk that cannot be written stays, and systemd begins this again at once: not before a while.
    """
    try:
        _do_what_waits(updater)
    except OSError:
        time.sleep(BEFORE_AGAIN_S)
        raise


def _do_what_waits(updater: Updater) -> None:
    has_gone_back = _logged(lambda: carry_through(updater))
    clear_incoming(updater.layout)
    while True:
        asked = take_roll_back_request(updater.layout)
        if asked and not has_gone_back:
            _logged(lambda asked=asked: roll_back(updater, asked))  # type: ignore[misc]
        elif asked:
            has_gone_back = False  # it was asked for while that was under way; twice would be one release too far
        elif take_uploaded(updater.layout):
            has_gone_back = _logged(lambda: install(updater, updater.layout.taken))
            clear_incoming(updater.layout)
        else:
            return


_VERBS: dict[str, Callable[[Updater, argparse.Namespace], None]] = {
    "install": _install,
    "roll-back": _roll_back,
    "boot-check": _check_boot,
    "resume": _resume,
    "watch-incoming": _watch_incoming,
}


def _logged(step: Callable[[], None]) -> bool:
    """Take a step; return whether it ended with the way back to the release before."""
    try:
        step()
    except DeviceError as error:
        log.warning("%s %s", error.code, error)
        return isinstance(error, RolledBack)
    return False


def _hand_over(options: argparse.Namespace, layout: UpdateLayout) -> int:
    """Do as somebody who may not install: hand over to the updater, and follow it."""
    if options.verb == "install":
        with _opened(options.file) as file:
            return _follow(layout, receive(layout, file))
    if options.verb == "roll-back":
        return _follow(layout, request_roll_back(layout))
    raise UpdateFailed(f"{options.verb} is root's: {layout.notes} cannot be written.", "Run it with sudo.")


def _follow(layout: UpdateLayout, file: str) -> int:
    follow(layout, file, _show)
    return 0


def _show(moment: UpdateProgress) -> None:
    print(moment, flush=True)


def _may_install(layout: UpdateLayout) -> bool:
    """Return whether this user may write where releases lie; root on a fresh system makes the folders."""
    for folder in (layout.releases, layout.notes):
        present = next(path for path in (folder, *folder.parents) if path.exists())
        if not os.access(present, os.W_OK):
            return False
    return True


def _status(options: argparse.Namespace, layout: UpdateLayout) -> int:
    state, progress = read_state(layout), read_progress(layout)
    kept = sorted(state.keeps() | {name for link in (layout.current, layout.updater) if (name := layout.linked(link))})
    damaged = {name: damage(layout.release(name)) for name in kept} if options.verify else {}
    damaged = {name: problems for name, problems in damaged.items() if problems}
    current = layout.linked(layout.current)
    if options.json:
        record = {"schema": SCHEMA, "current": current, "state": state.as_record(), "progress": asdict(progress)}
        print(json.dumps(record | {"damaged": damaged}))
    else:
        print(f"current {current}, committed {state.committed}, previous {state.previous}, floor {state.floor}")
        if state.pending:
            print(f"on trial: {state.pending.release}, start {state.pending.tries}")
        for release, reason in state.bad.items():
            print(f"bad: {release}: {reason}")
        if state.history and state.history[-1].event == "recovered":
            print(f"recovered: {state.history[-1].reason}")
        print(progress)
        for name, problems in damaged.items():
            print(f"{name} is damaged: {'; '.join(problems[:5])}{' ...' if len(problems) > 5 else ''}")
    return 1 if damaged else 0


@contextmanager
def _only_one(layout: UpdateLayout, *, waits: bool) -> Iterator[None]:
    """Hold the lock that one update at a time has; raise `BusyError` when another one has it, unless `waits`."""
    layout.notes.mkdir(parents=True, exist_ok=True)
    with layout.lock.open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
        except BlockingIOError:
            raise BusyError("Another update is under way.", BUSY) from None
        yield


@contextmanager
def _opened(path: Path) -> Iterator[BinaryIO]:
    try:
        with path.open("rb") as file:
            yield file
    except (FileNotFoundError, IsADirectoryError, PermissionError) as error:
        raise UpdateFailed(f"The release file {path} cannot be read: {error}.", "Name the release file.") from None


if __name__ == "__main__":
    sys.exit(main())
