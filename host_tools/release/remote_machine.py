"""A machine that is reached by ssh: commands, files on their standard input, what they print as it comes.

Only the programs of OpenSSH are asked for, on either side.
"""

from __future__ import annotations

import shlex
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from device.measurement.quantities import InvalidQuantity

CONNECTION_FAILED = 255
"""ssh's own exit code; every other one is the command's."""
LIVELY = ("-oConnectTimeout=10", "-oServerAliveInterval=5", "-oServerAliveCountMax=6")
"""A link that is dead is told after half a minute instead of hours."""
BOOT_ID = "/proc/sys/kernel/random/boot_id"
PAUSE_S = 1.0


class NotReachable(Exception):  # noqa: N818 - reads as what happened
    """ssh could not connect, or lost the connection; it has said why itself."""


@dataclass(frozen=True)
class RemoteMachine:
    """A host and the user there, with options of ssh such as `-p 18022 -i key`."""

    host: str
    user: str
    options: str = ""

    def __post_init__(self) -> None:
        for name, word in (("host", self.host), ("user", self.user)):
            if not word or word.startswith("-") or any(letter.isspace() for letter in word):
                raise InvalidQuantity(name, repr(word), "a name or an address", "give that of the probe")

    def __str__(self) -> str:
        return f"{self.user}@{self.host}"

    def run(self, *words: str, stdin: Path | None = None, told: Callable[[str], None] | None = None) -> int:
        """Run a command there, or with no words what the account is forced to; return its exit code.

        `told` hears its lines as they come, errors among them. Raises `NotReachable`.
        """
        with (
            (stdin or Path("/dev/null")).open("rb") as file,
            subprocess.Popen(
                self._command(words), stdin=file, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
            ) as ssh,
        ):
            for line in ssh.stdout or ():
                (told or print)(line.rstrip())
            code = ssh.wait()
        if code == CONNECTION_FAILED:
            raise NotReachable(f"ssh to {self} has failed.")
        return code

    def answer(self, *words: str) -> str:
        """Return what a command prints; raise `NotReachable` when it or ssh fails."""
        done = subprocess.run(
            self._command(words), stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise NotReachable(f"{self} does not answer: {done.stderr.strip()}")
        return done.stdout.strip()

    def send(self, file: Path, to: str) -> None:
        """Copy a file; raise `NotReachable` when it did not get there whole."""
        code = self.run(f"cat > {shlex.quote(to)}", stdin=file)
        if code or self.answer(f"wc -c < {shlex.quote(to)}") != str(file.stat().st_size):
            raise NotReachable(f"{file.name} could not be copied to {self}.")

    def wait_for_reboot(self, before: str, within_s: float) -> None:
        """Return when the machine has booted anew since its boot identity was `before`; raise `NotReachable`."""
        until_s = time.monotonic() + within_s
        while True:
            try:
                if self.answer("cat", BOOT_ID) != before:
                    return
            except NotReachable:
                pass  # as it should for a while
            if time.monotonic() > until_s:
                raise NotReachable(f"{self} has not come back {within_s:.0f} s after its reboot.")
            time.sleep(PAUSE_S)

    def _command(self, words: tuple[str, ...]) -> list[str]:
        return ["ssh", *LIVELY, *shlex.split(self.options), f"{self.user}@{self.host}", *words]
