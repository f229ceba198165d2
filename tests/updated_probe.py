"""A probe for tests of updates: a root folder, keys, a fake `systemctl`, and the updater as its own process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from daemon_process import ROOT as PROJECT
from free_port import free_port
from small_release import release_file, signer

from device.update.contents import damage
from device.update.layout import UpdateLayout
from device.update.progress import UpdateProgress, read_progress
from device.update.state import UpdateState, read_state

QUICK = ("--health-within", "20", "--look-every", "0.03")
SYSTEMCTL = PROJECT / "tests" / "fake_systemctl.sh"
IMPATIENT = ("--health-within", "3")
"""For a release that will not be healthy however long one waits."""


class UpdatedProbe:
    """The folder that stands for /, and what a person or systemd does with it."""

    def __init__(self, folder: Path, key: Path, root: Path | None = None) -> None:
        self.root, self.key, self.folder = root or folder / "root", key, folder
        self.layout = UpdateLayout(self.root)
        for made in (self.layout.incoming, self.layout.releases, self.layout.signers.parent, folder / "bin"):
            made.mkdir(parents=True, exist_ok=True)
        self.layout.signers.write_text(signer(key))
        self.port = free_port()
        (self.root / "etc/tsis/config.toml").write_text(f"[server]\nport = {self.port}\n")
        (folder / "bin" / "systemctl").symlink_to(SYSTEMCTL)
        self.environment = {
            **os.environ, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}", "TSIS_FAKE_ROOT": str(self.root),
            "TSIS_FAKE_PORT": str(self.port), "TSIS_FAKE_STATE": str(folder), "PYTHONPATH": str(PROJECT),
            "TSIS_FAKE_PYTHON": sys.executable, "TSIS_FAKE_DAEMON": str(SYSTEMCTL.with_name("fake_daemon.py")),
        }  # fmt: skip

    def write(self, version: str, counter: int, behaviour: Mapping[str, Any] | None = None, **changes: Any) -> Path:
        """Write a release file that this probe trusts."""
        return self.keep(release_file(self.key, version, counter, behaviour, **changes))

    def keep(self, content: bytes) -> Path:
        path = self.folder / "stick.release"
        path.write_bytes(content)
        return path

    def run(self, *words: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
        """Run the updater's command line."""
        return self.run_code("-m", "device.update", "--root", str(self.root), *QUICK, *map(str, words), **options)

    def run_code(self, *words: str, **options: Any) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-S", *words]
        known = {"env": self.environment, "capture_output": True, "text": True, "timeout": 60, "cwd": self.folder}
        return subprocess.run(command, **(known | options))

    def install(self, version: str, counter: int, behaviour: Mapping[str, Any] | None = None, **changes: Any) -> None:
        """Install a release that has to be committed."""
        done = self.run("install", self.write(version, counter, behaviour, **changes))
        assert done.returncode == 0, done.stdout + done.stderr
        assert self.state.committed == f"{version}+{counter}"

    @property
    def state(self) -> UpdateState:
        return read_state(self.layout)

    @property
    def progress(self) -> UpdateProgress:
        return read_progress(self.layout)

    @property
    def current(self) -> str | None:
        return self.layout.linked(self.layout.current)

    def releases(self) -> list[str]:
        return sorted(path.name for path in self.layout.releases.iterdir())

    def calls(self) -> list[str]:
        log = self.folder / "systemctl.log"
        return log.read_text().splitlines() if log.exists() else []

    def snapshot(self) -> dict[str, bytes]:
        """Return everything below the root but the progress and the lock, which a refusal may write."""
        found = {}
        for path in sorted(self.root.rglob("*")):
            name = str(path.relative_to(self.root))
            if path.name in ("progress.json", "lock"):
                continue
            found[name] = (
                os.readlink(path).encode() if path.is_symlink() else path.read_bytes() if path.is_file() else b"/"
            )
        return found

    def require_whole(self) -> str:
        """Return the release that runs, once every file of it and of the others that are kept has its hash."""
        name = self.current
        assert name is not None
        assert {kept: damage(self.layout.release(kept)) for kept in self.releases() if not kept.startswith(".")} == {
            kept: [] for kept in self.releases() if not kept.startswith(".")
        }
        assert damage(self.layout.release(name)) == []
        return name

    def start(self) -> None:
        subprocess.run(["systemctl", "start", "tsis.service"], env=self.environment, check=True, timeout=20)

    def stop(self) -> None:
        subprocess.run(["systemctl", "stop", "tsis.service"], env=self.environment, check=False, timeout=20)

    def start_machine(self) -> subprocess.CompletedProcess[str]:
        """Start the machine: its processes are gone, the boot is checked, then the daemon starts."""
        self.stop()
        done = self.run("boot-check")
        if self.layout.current.exists():
            self.start()
        return done

    def said(self) -> dict[str, Any]:
        return json.loads(self.run("status", "--json").stdout)
