"""The daemon as its own process, spoken to over HTTP as a hospital PC would."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

ROOT = Path(__file__).resolve().parents[1]
WAIT_S = 240.0
"""Longer than anything takes on the busiest machine: what is waited for are events."""
PATIENT = "[settings.camera]\nlate_frames = 100.0\n"
Seen = TypeVar("Seen")


def wait_for(look: Callable[[], Seen], is_it: Callable[[Seen], bool]) -> Seen:
    """Look again and again until it is what is waited for; return that."""
    until_s = time.monotonic() + WAIT_S
    while not is_it(seen := look()):
        assert time.monotonic() < until_s, f"waited in vain: {seen}"
        time.sleep(0.05)
    return seen


@dataclass(frozen=True)
class Answer:
    """Status, headers and body of one HTTP answer."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


class Daemon:
    """`python -m device --simulate` as its own process on a free port unless told otherwise.

    To its scene comes that no frame is late, unless that has settings of the camera: on a busy machine many are.
    `program` is what Python runs instead of `-m device`; `environment` comes on top of that of the tests. With
    `arguments` it is not simulated: they are its whole command line. `root` stands for / where it looks for files.
    `own_group`: it and its camera's process can be killed together, by the group of its number.
    """

    def __init__(
        self,
        folder: Path,
        scene: str = "",
        port: int = 0,
        *,
        program: Sequence[str] = ("-m", "device"),
        environment: Mapping[str, str] | None = None,
        arguments: Sequence[str] = (),
        root: Path | None = None,
        own_group: bool = False,
    ) -> None:
        if not arguments:
            (folder / "scene.toml").write_text(scene if "[settings.camera]" in scene else scene + PATIENT)
            arguments = ("--simulate", "--port", str(port), "--scene", "scene.toml")
        if root:
            arguments = (*arguments, "--root", str(root))
        path = os.pathsep.join([str(ROOT), str(ROOT / "tests")])
        whole = {**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1", **(environment or {})}
        self._log_path = folder / "log.txt"
        self.log = self._log_path.open("a")
        self.process = subprocess.Popen(
            [sys.executable, *program, *arguments],
            cwd=folder,
            env=whole,
            stdout=subprocess.PIPE,
            stderr=self.log,
            text=True,
            start_new_session=own_group,
        )
        assert self.process.stdout is not None
        greeting = self.process.stdout.readline()
        assert "http://" in greeting, (folder / "log.txt").read_text()
        self.greeting = greeting
        self.url = greeting.split()[-1].rstrip("/")

    def ask(
        self, path: str, method: str = "GET", body: object = None, *, headers: Mapping[str, str] | None = None
    ) -> Answer:
        data = None if body is None else json.dumps(body).encode()
        of_all = {"content-type": "application/json", **(headers or {})}
        request = urllib.request.Request(self.url + path, method=method, data=data, headers=of_all)
        try:
            with urllib.request.urlopen(request, timeout=WAIT_S) as response:
                return Answer(response.status, dict(response.headers), response.read())
        except urllib.error.HTTPError as error:
            with error:
                return Answer(error.code, dict(error.headers), error.read())

    def press(self, mode: str | None = None) -> dict[str, Any]:
        """Start a press and return its job once it has ended."""
        answer = self.ask("/api/v1/presses", "POST", {"mode": mode} if mode else {})
        assert answer.status == 202, answer.body
        return self.ended(answer.headers["location"])

    def ended(self, location: str) -> dict[str, Any]:
        """Wait for a press to end; return its job."""

        def job() -> dict[str, Any]:
            return self.ask(location).json

        return wait_for(job, lambda job: job["state"] in ("done", "rejected", "cancelled", "failed"))

    def log_text(self) -> str:
        """Return what it has logged."""
        return self._log_path.read_text()

    def stop(self) -> int:
        self.process.terminate()
        return self.ended_code()

    def ended_code(self) -> int:
        """Return how the process ended, once it has."""
        code = self.process.wait(timeout=WAIT_S)
        assert self.process.stdout is not None
        self.process.stdout.close()
        self.log.close()
        return code


QUICK_HAND = "[hand]\nrate_n_per_s = 1.5\nramp_rate_n_per_s = 0.25\nreaction_s = 0.05\n"
