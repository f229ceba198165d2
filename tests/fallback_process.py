"""The fallback as its own process, under the system's Python without any package, on a probe's root below a folder."""

from __future__ import annotations

import http.client
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from daemon_process import ROOT, WAIT_S, Answer, Daemon, wait_for
from free_port import free_port

NO_SYSTEMD = "#!/bin/sh\nexit 1\n"
RUNNER = "import sys, runpy; sys.path.insert(0, {root!r}); runpy.run_module('device.fallback', run_name='__main__')"


class ProbeRoot:
    """A folder that stands for /: settings, what the daemon notes, releases and the updater's folders; and a port."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.port = folder, free_port()
        for name in ("etc/tsis", "run/tsis", "var/lib/tsis-update/incoming", "opt/tsis/releases", "bin"):
            (folder / name).mkdir(parents=True, exist_ok=True)
        for command in ("systemctl", "journalctl"):
            self.command(command, NO_SYSTEMD)
        self.settings("")

    def settings(self, text: str) -> None:
        """Write the settings file: its server is on the port, and then `text`."""
        text = f'serial = "TSIS-0042"\n[server]\nport = {self.port}\n{text}'
        (self.folder / "etc/tsis/config.toml").write_text(text)

    def command(self, name: str, text: str) -> None:
        """Put a command where the fallback finds it before the machine's own."""
        path = self.folder / "bin" / name
        path.write_text(text)
        path.chmod(0o755)

    def releases(self, current: str, *, committed: str, previous: str | None = None) -> None:
        """Say which release is to run, and what the updater knows."""
        link = self.folder / "opt/tsis/current"
        link.unlink(missing_ok=True)
        link.symlink_to(f"releases/{current}")
        state = {"schema": "tsis.update_state/1", "committed": committed, "previous": previous}
        (self.folder / "var/lib/tsis-update/state.json").write_text(json.dumps(state))

    @property
    def url(self) -> str:
        """Where the screen is."""
        return f"http://127.0.0.1:{self.port}"


class Fallback:
    """`python3 -m device.fallback`, without site-packages."""

    def __init__(self, root: ProbeRoot, *, waits: bool = True, environment: Mapping[str, str] | None = None) -> None:
        self.root = root
        path = f"{root.folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
        command = [sys.executable, "-I", "-S", "-c", RUNNER.format(root=str(ROOT)), "--root", str(root.folder)]
        self.log = (root.folder / "fallback.log").open("a")
        self.process = subprocess.Popen(
            command, env={**os.environ, "PATH": path, **(environment or {})}, stderr=self.log, stdout=self.log
        )
        if waits:
            wait_for(self.state, lambda state: state == 200)

    def state(self) -> int | None:
        """Return the status with which it answers for itself, None while nobody has the port."""
        try:
            return self.ask("GET", "/fallback/state").status
        except OSError:
            return None

    def ask(self, method: str, path: str, headers: Mapping[str, str] | None = None, *, at: str = "127.0.0.1") -> Answer:
        """Ask as a program does; `headers` come on top of JSON as content type."""
        line = http.client.HTTPConnection(at, self.root.port, timeout=WAIT_S)
        try:
            line.request(method, path, headers={"Content-Type": "application/json", **(headers or {})})
            answer = line.getresponse()
            return Answer(answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read())
        finally:
            line.close()

    def stop(self) -> int:
        """End it; return its exit code."""
        self.process.terminate()
        code = self.process.wait(timeout=WAIT_S)
        self.log.close()
        return code


def failed_start(root: ProbeRoot) -> str:
    """Start a daemon of this root that refuses to start; return what it says."""
    command = [sys.executable, "-m", "device", "--root", str(root.folder)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        command, cwd=root.folder, env=environment, capture_output=True, text=True, timeout=WAIT_S, check=False
    )
    assert done.returncode == 1, done.stderr
    return done.stderr


def good_daemon(root: ProbeRoot) -> Daemon:
    """Start a simulated probe on the port of this root."""
    return Daemon(root.folder, port=root.port, root=root.folder)
