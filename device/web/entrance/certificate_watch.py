"""Whether each certificate of the settings holds: told a month before its end, after it, and before it begins.

Nothing is told by a clock that somebody has set within a quarter of an hour, or that shows a time before this software
was made: a board without a battery may show any date until a time server answers.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from device.access.certificate import NOT_BEFORE, ServerCertificate
from device.access.pem_file import HeldPeriod, held_periods
from device.config import Config
from device.errors import CertificateEnds, DeviceError

log = logging.getLogger(__name__)
LOOK_S = 60.0
"""How often the clock is looked at, and whether a file was renewed."""
STOP_S = 5.0
SOON_DAYS, DAY_S = 30, 86400
"""So many days before its end a certificate is told of."""
AT_START = "Renew the file that server.client_authority names, and start the daemon again."
AT_USE = "Put the renewed certificate into that file: it is read at the next try."
Stamp = tuple[int, int, int, int] | None


@dataclass(frozen=True)
class WatchedFile:
    """A file of certificates: the setting that names it, who is refused once one ends, and how it is renewed.

    `is_kept`: what was read at the start is in use until the daemon is started again, whatever the file becomes.
    """

    setting: str
    path: Path
    refusal: str
    renewal: str
    is_kept: bool = False

    def stamp(self) -> Stamp:
        """Return what changes with the file's content, and with who may read it; None where it is not there."""
        try:
            found = self.path.stat()
        except OSError:
            return None
        return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def watched_files(config: Config, served: ServerCertificate | None) -> list[WatchedFile]:
    """Return the files of certificates in use; `served` is what other machines see, None where they are not served."""
    files = list[WatchedFile]()
    if served:
        refusal = "other machines refuse the probe"
        files.append(WatchedFile("server.certificate", served.certificate, refusal, served.renewal, is_kept=True))
    if served and config.server.client_authority:
        path = Path(config.server.client_authority)
        files.append(WatchedFile("server.client_authority", path, "whom it vouches for is refused", AT_START, True))
    if config.dicom.tls_authority:
        path = config.dicom.tls_authority
        files.append(WatchedFile("dicom.tls_authority", path, "the archive it vouches for is refused", AT_USE))
    if config.dicom.tls_certificate:
        path = config.dicom.tls_certificate
        files.append(WatchedFile("dicom.tls_certificate", path, "archive and worklist refuse the probe", AT_USE))
    if config.webhook.tls_authority:
        path = config.webhook.tls_authority
        files.append(WatchedFile("webhook.tls_authority", path, "the address for notices is refused", AT_USE))
    return files


def judged(file: WatchedFile, period: HeldPeriod, now_s: float) -> str:
    """Return in a sentence what is wrong with one of a file's certificates at a time, in s since 1970; else ""."""
    begins, ends = (datetime.fromtimestamp(at, UTC).date() for at in (period.begins_s, period.ends_s))
    days_left = (period.ends_s - now_s) / DAY_S
    if now_s < period.begins_s:
        when = f"is not valid before {begins}, and the clock shows {datetime.fromtimestamp(now_s, UTC).date()}"
    elif days_left < 0:
        when = f"has ended on {ends}"
    elif days_left < SOON_DAYS:
        when = f"ends on {ends}, in {days_left:.0f} days"
    else:
        return ""
    then = "then " if when.startswith("ends") else ""
    return f"The certificate {period.subject!r} in {file.path} ({file.setting}) {when}: {then}{file.refusal}."


class CertificateWatch:
    """Looks by a thread of its own; `tell` hears one `CertificateEnds` of all files, or None once it is over."""

    def __init__(
        self,
        files: Sequence[WatchedFile],
        tell: Callable[[DeviceError | None], None],
        is_clock_steady: Callable[[], bool],
        wall_time_s: Callable[[], float] = time.time,
    ) -> None:
        """Take the files in use, and whether ages by the wall clock are believed."""
        self._files, self._tell, self._wall_time_s = files, tell, wall_time_s
        self._is_clock_steady = is_clock_steady
        self._read: dict[str, tuple[Stamp, tuple[HeldPeriod, ...]]] = {}
        self._told: CertificateEnds | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="certificate watch", daemon=True)

    def start(self) -> None:
        """Begin; there is nothing to look at where no file is in use."""
        if self._files:
            self._thread.start()

    def close(self) -> None:
        """End."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(timeout=STOP_S)

    def ends_s(self) -> Mapping[str, float]:
        """Return when the first certificate of each setting ends, in s since 1970, of those that could be read."""
        return {setting: min(one.ends_s for one in found) for setting, (_, found) in self._read.items() if found}

    def look(self) -> None:
        """Tell what holds today, if that was not told yet."""
        self._read_again()
        now_s = self._wall_time_s()
        if not self._is_clock_steady() or now_s < NOT_BEFORE.timestamp():
            return
        found = self._found(now_s)
        if (found and found.cause) == (self._told and self._told.cause):
            return
        self._told = found
        if found:
            log.warning("%s %s", found.code, found)
        self._tell(found)

    def _read_again(self) -> None:
        """Read the files that were not read yet or were renewed since."""
        for file in self._files:
            before, stamp = self._read.get(file.setting), file.stamp()
            if before is None or (before[0] != stamp and not file.is_kept):
                self._read = {**self._read, file.setting: (stamp, held_periods(file.path))}  # another thread reads it

    def _found(self, now_s: float) -> CertificateEnds | None:
        wrong = [
            (sentence, file.renewal)
            for file in self._files
            for period in self._read[file.setting][1]
            if (sentence := judged(file, period, now_s))
        ]
        if not wrong:
            return None
        causes, remedies = (" ".join(dict.fromkeys(each)) for each in zip(*wrong, strict=True))
        return CertificateEnds(causes, remedies)

    def _run(self) -> None:
        self._read_again()
        while not self._stopping.wait(LOOK_S):
            self.look()
