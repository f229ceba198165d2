"""A container as who provisions and updates it sees it: by ssh, by the toolkit's commands, by REST."""

from __future__ import annotations

import json
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from releases import ROOT, ReleaseShop

URL = "http://127.0.0.1:8000/api/v1/"
BROWSER = "http://127.0.0.1:18091/json"
HOST, PORT = "127.0.0.1", "18022"
PAUSE_S = 0.2


class NotReached(Exception):  # noqa: N818 - reads as what happened
    """What a story waits for did not come in time."""


@dataclass(frozen=True)
class Ended:
    """How a command ended, what it said, how long it took (s)."""

    code: int
    said: str
    took_s: float

    @property
    def last(self) -> str:
        """Return its last line but one, where the reason stands, and its last."""
        return " | ".join(self.said.strip().splitlines()[-2:])


def until(what: str, condition: Callable[[], bool], within_s: float) -> float:
    """Return after how many seconds a condition holds; raise `NotReached` when it never does."""
    since_s = time.monotonic()
    while not condition():
        if time.monotonic() - since_s > within_s:
            raise NotReached(f"not within {within_s:.0f} s: {what}")
        time.sleep(PAUSE_S)
    return time.monotonic() - since_s


def asked(url: str) -> Any:
    """Return the JSON that is answered, None when nobody does or with an error."""
    try:
        with urllib.request.urlopen(url, timeout=5) as response:
            return json.load(response)
    except (OSError, ValueError):
        return None


def posted(path: str, body: object) -> Any:
    """Return what the REST API answers to a POST of JSON, or of a file's bytes; raise `OSError` when it refuses."""
    is_file = isinstance(body, bytes)
    headers = {"Content-Type": "application/octet-stream" if is_file else "application/json"}
    request = urllib.request.Request(URL + path, body if is_file else json.dumps(body).encode(), headers)
    with urllib.request.urlopen(request, timeout=60) as response:
        return json.load(response)


class ProbeAtHand:
    """The container, the key of its user pi, and the keys of releases."""

    def __init__(self, folder: Path, shop: ReleaseShop) -> None:
        self.key, self.shop = folder / "key", shop
        strange = "-oStrictHostKeyChecking=no -oUserKnownHostsFile=/dev/null -oLogLevel=ERROR -oIdentitiesOnly=yes"
        self.ssh_options = f"-p {PORT} -i {self.key} {strange}"

    def inside(self, command: str, user: str = "pi", *options: str) -> Ended:
        """Run a command in the container as a user; the words of options come before all others."""
        return _ended(["ssh", *options, *self.ssh_options.split(), f"{user}@{HOST}", command])

    def root(self, command: str) -> Ended:
        """Run a command in the container as root."""
        return self.inside(f"sudo sh -c '{command}'")

    def put(self, file: Path, to: str) -> None:
        """Put a file of ours into the container."""
        with file.open("rb") as content:
            command = ["ssh", *self.ssh_options.split(), f"pi@{HOST}", f"sudo install -D -m 644 /dev/stdin {to}"]
            subprocess.run(command, stdin=content, check=True)

    def provision(self, release: Path, *options: str, serial: str = "TSIS-0007") -> Ended:
        """`make provision`."""
        return self._toolkit("provision", release, "--deploy-key", f"{self.key}.pub", "--stand-in", "--serial", serial,
                             "--time-zone", "Europe/Berlin", *options)  # fmt: skip

    def deploy(self, release: Path, *options: str) -> Ended:
        """`make deploy` of a file."""
        return self._toolkit("deploy", release, *options)

    def deploy_unseen(self, release: Path) -> Ended:
        """The same by a workstation that does not look at the file itself."""
        return self.deploy(release, "--no-check-here")

    def running(self) -> tuple[str, str]:
        """Return the release that runs and the number of its process: what a refusal must not touch."""
        health = asked(URL + "health/parts") or {"release": "none"}
        return health["release"], self.inside("systemctl show --value --property=MainPID tsis").said.strip()

    def is_ready(self) -> bool:
        """Return whether every part works."""
        health = asked(URL + "health/parts")
        return bool(health) and all(part["ready"] for part in health["parts"].values())

    def fill_disk(self, free_mb: int) -> None:
        """Leave so much space (MB) on its disk."""
        free = "$(df --output=avail --block-size=1M / | tail -n 1)"
        filled = self.root(f"rm -f /full; fallocate -l $(({free} - {free_mb}))M /full")
        if filled.code:
            raise NotReached(filled.said)

    def _toolkit(self, verb: str, release: Path, *options: str) -> Ended:
        command = [sys.executable, "-m", "host_tools", verb, str(release), "--host", HOST, "--ssh", self.ssh_options]
        return _ended([*command, "--signers", str(self.shop.signers), *options])


def _ended(command: list[str]) -> Ended:
    since_s = time.monotonic()
    done = subprocess.run(
        command,
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return Ended(done.returncode, done.stdout, time.monotonic() - since_s)
