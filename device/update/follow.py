"""For those who may not install themselves: hand a release file over, tell how it goes, and how it ended.

The forced ssh command of `make deploy` is `receive`; `install` does the same for anybody who is not root. The exit
code is that of the outcome.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import BinaryIO

from device.errors import DeviceError, UpdateFailed
from device.update.incoming import Upload, ask_for_roll_back, withdraw
from device.update.layout import UpdateLayout
from device.update.progress import ENDED, UpdateProgress, file_id, read_progress

PIECE_BYTES = 2**18
LOOK_EVERY_S = 0.2
NOT_TAKEN = "Nobody takes what was asked for."
SILENT = "The update under way tells nothing more."
REMEDY = "Look into `systemctl status tsis-update.path tsis-update.service` on the probe."


@dataclass(frozen=True)
class FollowLimits:
    """How long a request may lie untaken while nothing is under way, and how long an update may say nothing (s)."""

    taken_s: float = 60.0
    silent_s: float = 900.0


def receive(layout: UpdateLayout, stream: BinaryIO) -> str:
    """Take a release file from a stream to the updater; return how it is named in the progress.

    Raises `UpdateFailed` and `BusyError`, and then leaves nothing.
    """
    upload = Upload(layout)
    try:
        while piece := stream.read(PIECE_BYTES):
            upload.write(piece)
        return upload.hand_over()
    finally:
        upload.abandon()


def request_roll_back(layout: UpdateLayout) -> str:
    """Ask for the previous release; return how that is named in the progress. Raises `UpdateFailed`."""
    ask_for_roll_back(layout)
    try:
        return file_id(layout.roll_back_request.stat())
    except OSError:
        raise UpdateFailed("The request was taken at once.", "See `python -m device.update status`.") from None


def follow(
    layout: UpdateLayout, file: str, show: Callable[[UpdateProgress], None], limits: FollowLimits = FollowLimits()
) -> None:
    """Show each moment of one update until it has ended; return when it is committed.

    Raises the updater's error otherwise, and `UpdateFailed` when nobody takes the request, which then is withdrawn.
    """
    last, since, shown = read_progress(layout), time.monotonic(), None
    while True:
        moment = read_progress(layout)
        if moment != last:
            last, since = moment, time.monotonic()
        if moment.file == file and moment != shown:
            show(moment)
            shown = moment
        if moment.file == file and moment.state in ENDED:
            return _judge(moment)
        try:
            _require_life(moment, time.monotonic() - since, limits)
        except UpdateFailed:
            withdraw(layout, file)
            raise
        time.sleep(LOOK_EVERY_S)


def _require_life(moment: UpdateProgress, silent_s: float, limits: FollowLimits) -> None:
    is_idle = moment.state in (*ENDED, "idle")
    if silent_s > (limits.taken_s if is_idle else limits.silent_s):
        raise UpdateFailed(NOT_TAKEN if is_idle else SILENT, REMEDY)


def _judge(moment: UpdateProgress) -> None:
    if moment.state == "committed":
        return
    raise DeviceError.by_code.get(moment.code or "", UpdateFailed)(moment.reason, "")
