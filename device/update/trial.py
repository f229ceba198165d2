"""A release on trial: switched to, watched, then committed or left. Each part may be interrupted, and goes on.

What is to be done stands in state.json before it is done. A trial that was interrupted is carried through from there:
by `resume` while the machine runs, by device/update/boot_check.py when it starts.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from device.errors import RolledBack, UpdateFailed
from device.files.durable import is_disk_read_only, sync_directory, write_durably
from device.files.plain_settings import daemon_address, data_folder
from device.files.start_note import clear_note
from device.update.gate import (
    DiskRefuses,
    ExcusedStarts,
    NotHealthy,
    Patience,
    RefusesSettings,
    wait_for_press,
    wait_until_healthy,
)
from device.update.layout import UpdateLayout, make_link, point
from device.update.manifest import read_installed
from device.update.progress import ENDED, ProgressReport, read_progress
from device.update.services import reload_units, start_daemon, stop_daemon
from device.update.state import PendingRelease, UpdateState, counter_of, is_on_disk, read_state, write_state
from device.update.unpack import remove_release

log = logging.getLogger(__name__)
LEAST_FREE_BYTES = 1 << 20
"""With less no database opens."""
INTERRUPTED = "The power went, or the updater was killed, before the release was whole."
GONE = "Its folder is not there."
REMEDY = "The release that ran before does again; the maker of the failed one needs to know the reason."
NOT_ITS_FAULT = (
    "The release that ran before does again; free space or see to the reason, then send the other one again."
)


@dataclass(frozen=True)
class Updater:
    """What every step of an update needs: the places, who is told, how long to wait."""

    layout: UpdateLayout
    report: ProgressReport
    patience: Patience = field(default_factory=Patience)


def begin_trial(updater: Updater, pending: PendingRelease) -> None:
    """Write down that a release is on trial. Raises `OSError`; then nothing was begun."""
    layout, state = updater.layout, read_state(updater.layout)
    try:
        if state.committed:
            make_link(layout.way_back, layout.release(state.committed))
        write_state(layout, replace(state, pending=pending))
    except OSError:
        with suppress(OSError):
            write_state(layout, state)  # the first may have failed after it had replaced the file
        raise


def carry_through(updater: Updater) -> None:
    """Bring the trial that is written down to its end, from wherever it is; raise `RolledBack` when it was left.

    Raises `OSError` when the disk refuses even the return; then the next call goes on with it.
    """
    pending = read_state(updater.layout).pending
    if not pending:
        finish_commit(updater.layout)
        tell_interrupted(updater)
        return
    _go_on_telling(updater, pending.release)
    if pending.leaving:
        return leave(updater, pending.leaving, is_bad=pending.is_bad)
    if not updater.layout.is_installed(pending.release):
        return leave(updater, GONE, is_bad=False)
    try:
        _switch(updater, pending.release)
        commit(updater, lacking=_watch(updater, pending))
    except NotHealthy as reason:
        is_of_probe = isinstance(reason, (DiskRefuses, RefusesSettings)) or _is_shut(data_folder(updater.layout.root))
        leave(updater, str(reason), is_bad=not is_of_probe)
    except (OSError, UpdateFailed) as error:
        leave(updater, f"A step failed: {error}", is_bad=False)


def _is_shut(folder: Path) -> bool:
    """Return whether the disk of a folder takes nothing: then no release starts, and none is bad for that."""
    path = next(path for path in (folder, *folder.parents) if path.exists())
    disk = os.statvfs(path)
    return is_disk_read_only(path) or disk.f_bavail * disk.f_frsize < LEAST_FREE_BYTES


def commit(updater: Updater, *, lacking: str = "") -> None:
    """Make the release on trial the one that comes back from now on; `lacking` is why its daemon does not start yet.

    Raises `OSError`; then it is still on trial.
    """
    state = read_state(updater.layout)
    pending = state.pending
    if not pending:
        return
    floor = max(state.floor, counter_of(pending.release))
    committed = replace(
        state, committed=pending.release, previous=state.committed, pending=None, floor=floor, is_finishing=True,
        bad={release: reason for release, reason in state.bad.items() if counter_of(release) > floor},
    ).noted(pending.release, "committed", "asked for by the operator" if pending.is_roll_back else lacking)  # fmt: skip
    try:
        write_state(updater.layout, committed)
    except OSError:
        if not is_on_disk(updater.layout, committed):  # it may have failed after it had replaced the file
            raise
    try:
        finish_commit(updater.layout)
    except OSError as error:
        log.warning("What follows the commit is left to the next start: %s", error)
    updater.report.end("committed")


def finish_commit(layout: UpdateLayout) -> None:
    """Do what follows a commit, as often as it takes: the updater's link, the keys, old releases. Raises `OSError`."""
    state = read_state(layout)
    if not state.is_finishing or not state.committed:
        return
    remove_others(layout, state)  # first, for it makes space
    point(layout.updater, layout.release(state.committed))
    signers = read_installed(layout, state.committed).signers
    if signers and counter_of(state.committed) == state.floor:  # a release that came back brings no old keys back
        write_durably(layout.signers, signers.encode())
        layout.signers.chmod(0o644)
    write_state(layout, replace(state, is_finishing=False))


def leave(updater: Updater, reason: str, *, is_bad: bool, starts_daemon: bool = True) -> None:
    """Bring the committed release back; raises `RolledBack` with the reason, when there is nothing more to do.

    Nothing is left, and nothing raised, where no release is on trial any more: a step after its commit failed.

    The reason is written down first. On a full disk that waits until the failed release is removed.
    """
    layout, state = updater.layout, read_state(updater.layout)
    pending = state.pending
    if not pending:
        return
    if not pending.leaving:
        with suppress(OSError):
            write_state(layout, replace(state, pending=replace(pending, leaving=reason, is_bad=is_bad)))
    problems = _return_to(layout, state, starts_daemon)
    left = _left(state, replace(pending, is_bad=is_bad), reason)
    try:
        write_state(layout, left)
        remove_others(layout, left)
    except OSError:
        remove_others(layout, left)
        write_state(layout, left)
    cause = " ".join([f"{pending.release} was left: {reason}", *problems])
    told = RolledBack(cause, REMEDY if is_bad else NOT_ITS_FAULT)
    updater.report.release = pending.release
    updater.report.end("rolled_back", told)
    raise told


def remove_others(layout: UpdateLayout, state: UpdateState) -> None:
    """Remove every release that is neither committed, previous nor on trial, and what is none yet. Raises `OSError`."""
    keeps = state.keeps()
    if not layout.releases.is_dir():
        return
    for folder in sorted(layout.releases.iterdir()):
        if folder.name not in keeps:  # nor has one that is none yet, or no longer, such a name
            remove_release(folder)


def return_link(layout: UpdateLayout, state: UpdateState) -> bool:
    """Let `current` point to the committed release, or nowhere when there is none; return whether that changed it."""
    if layout.linked(layout.current) == state.committed:
        return False
    if state.committed and layout.linked(layout.way_back) == state.committed:
        layout.way_back.replace(layout.current)
    elif state.committed:
        point(layout.current, layout.release(state.committed))
    else:
        layout.current.unlink(missing_ok=True)
    sync_directory(layout.programs)
    return True


def tell_interrupted(updater: Updater) -> None:
    """Say how an update ended of which progress.json tells only the middle."""
    layout, state, report = updater.layout, read_state(updater.layout), updater.report
    last = read_progress(layout)
    if last.state in (*ENDED, "idle"):
        return
    report.release, report.file = last.release, last.file
    if last.release and last.release == state.committed:
        report.end("committed")
    elif last.release in state.bad:
        report.end("rolled_back", RolledBack(f"{last.release} was left: {state.bad[last.release]}", REMEDY))
    else:
        report.end("refused", UpdateFailed(INTERRUPTED, "Send it again; the release before runs unchanged."))
    report.release, report.file = "", ""


def _go_on_telling(updater: Updater, release: str) -> None:
    """Tell the progress under the name of the file with which this trial began, by which its sender follows it."""
    report, last = updater.report, read_progress(updater.layout)
    if last.release == release and not report.file:
        report.file = last.file
    report.release = release


def _switch(updater: Updater, release: str) -> None:
    """Stop the daemon, exchange the link, start the daemon. Done again, it changes nothing."""
    layout, report = updater.layout, updater.report
    if layout.linked(layout.current) != release:
        report.tell("switching", 0.59, "press")
        wait_for_press(daemon_address(layout.root), updater.patience.every_s)
        report.tell("switching", 0.6, "stop")
        stop_daemon()
        report.tell("switching", 0.62, "link")
        point(layout.current, layout.release(release))
    clear_note(layout.root)  # of a start before this one
    report.tell("switching", 0.64, "start")
    reload_units()
    start_daemon()


def _watch(updater: Updater, pending: PendingRelease) -> str:
    """Return when the release is healthy, or does not start for what is its machine's alone: that, in words."""
    layout = updater.layout
    is_first = read_state(layout).committed is None
    updater.report.tell("checking", 0.65, "health")
    return wait_until_healthy(
        daemon_address(layout.root), pending.release, pending.baseline, updater.patience,
        lambda part: updater.report.tell("checking", 0.65 + 0.3 * part, "health"),
        ExcusedStarts(layout.root, pending.release, lacking=None if is_first else pending.lacking),
    )  # fmt: skip


def _return_to(layout: UpdateLayout, state: UpdateState, starts_daemon: bool) -> list[str]:
    """Bring link and daemon back; return what did not work, each as a sentence. Raises `OSError` for the link alone."""
    problems = []
    if starts_daemon and layout.linked(layout.current) != state.committed:
        problems += _attempt(stop_daemon)
    return_link(layout, state)
    problems += _attempt(reload_units)
    if starts_daemon and state.committed:
        problems += _attempt(start_daemon)
    return problems


def _attempt(step: Callable[[], None]) -> list[str]:
    """Take a step; return what did not work, if anything."""
    try:
        step()
    except UpdateFailed as error:
        return [str(error)]
    return []


def _left(state: UpdateState, pending: PendingRelease, reason: str) -> UpdateState:
    """Return the state without the trial; a new release is bad from now on, unless there was nothing to return to."""
    is_bad = pending.is_bad and not pending.is_roll_back and state.committed
    bad = state.bad | {pending.release: reason} if is_bad else state.bad
    return replace(state, pending=None, bad=bad).noted(pending.release, "rolled_back", reason)
