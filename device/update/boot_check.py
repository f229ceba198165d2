"""At every start, before the daemon: one whole release is `current`, whatever was interrupted when the power went.

A release on trial is started again, three times; then the committed one comes back. This runs from the committed
release, never from the one on trial, and starts no daemon itself: systemd does, after it.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from device.errors import RolledBack, UpdateFailed
from device.update.incoming import clear_incoming
from device.update.layout import UpdateLayout, point
from device.update.services import reload_units
from device.update.state import PendingRelease, UpdateState, is_on_disk, read_state, write_state
from device.update.trial import GONE, Updater, finish_commit, leave, remove_others, return_link, tell_interrupted

MOST_TRIES = 3


def check_boot(updater: Updater) -> str:
    """Settle what was interrupted; return what was done, in one sentence. Raises `OSError`."""
    layout, state = updater.layout, read_state(updater.layout)
    if not state.pending:
        _repair(updater, state)
        return f"{state.committed or 'No release'} is committed."
    remove_others(layout, state)
    clear_incoming(layout)
    reason, is_bad = _reason_to_leave(layout, state.pending)
    if not reason:
        try:
            _try_again(layout, state, state.pending)
            return f"{state.pending.release} is on trial, start {state.pending.tries + 1} of {MOST_TRIES}."
        except OSError as error:
            reason = f"The start could not be counted: {error}."
    try:
        leave(updater, reason, is_bad=is_bad, starts_daemon=False)
    except RolledBack as told:
        return told.cause
    return ""


def _reason_to_leave(layout: UpdateLayout, pending: PendingRelease) -> tuple[str, bool]:
    """Return why the release on trial is not started again, or nothing, and whether that is its own fault."""
    if pending.leaving:
        return pending.leaving, pending.is_bad
    if not layout.is_installed(pending.release):
        return GONE, False
    if pending.tries >= MOST_TRIES:
        return f"The machine was started {pending.tries} times with it, and it was never healthy for long.", True
    return "", False


def _try_again(layout: UpdateLayout, state: UpdateState, pending: PendingRelease) -> None:
    """Count this start, then let `current` point to the release on trial. Raises `OSError`."""
    write_state(layout, replace(state, pending=replace(pending, tries=pending.tries + 1)))
    if layout.linked(layout.current) != pending.release:
        point(layout.current, layout.release(pending.release))
    _reload()


def _repair(updater: Updater, state: UpdateState) -> None:
    """Nothing is on trial: the committed release is current, what a commit leaves to do is done, the rest removed."""
    layout = updater.layout
    if state.committed and not is_on_disk(layout, state):  # it was found by the links
        write_state(layout, state)
    if return_link(layout, state):
        _reload()
    if state.is_finishing:
        finish_commit(layout)
    remove_others(layout, state)
    clear_incoming(layout)
    tell_interrupted(updater)


def _reload() -> None:
    with suppress(UpdateFailed):  # at the start of the machine systemd may be busy, and reads the files anyway
        reload_units()
