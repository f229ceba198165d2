"""Release files of every kind for the stories: good ones of a fresh clone, one whose camera dies, damaged ones."""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
WORKER = "device/hardware/camera_worker.py"
LOOP = "        for request in _requests(pipe):\n"
DIES = LOOP + "            raise SystemExit(1)\n"


def run(*command: str, cwd: Path = ROOT) -> str:
    """Run a command; return what it prints, raise with its last words when it fails."""
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode:
        raise OSError(f"{' '.join(command)} ended with {done.returncode}: {(done.stdout + done.stderr)[-1500:]}")
    return done.stdout


class ReleaseShop:
    """A workstation: a fresh clone, a key that probes trust and one that nobody knows, and what they make."""

    def __init__(self, folder: Path) -> None:
        """Make keys and clone in a folder; wheels that were downloaded before are kept."""
        self.folder, self.clone = folder, folder / "clone"
        for path in (self.clone, folder / "releases"):
            shutil.rmtree(path, ignore_errors=True)
        (folder / "releases").mkdir(parents=True)
        run("git", "clone", "--quiet", str(ROOT), str(self.clone))
        kept = ROOT / "build/wheels"
        kept.mkdir(parents=True, exist_ok=True)
        (self.clone / "build").mkdir()
        (self.clone / "build/wheels").symlink_to(kept)
        self._keys = TemporaryDirectory(prefix="tsis-keys-")  # a key in a repository is refused
        keys = Path(self._keys.name)
        self.key, self.evil_key, self.signers = keys / "release_key", keys / "evil_key", keys / "release_signers"
        self.signers.write_text(self._made_key(self.key))
        self._made_key(self.evil_key)

    def built(self, counter: int, *, signed_by: Path | None = None) -> Path:
        """Return a release file of the clone with this counter."""
        out = self.folder / "releases" / f"{counter}{'.evil' if signed_by else ''}"
        run(sys.executable, "-m", "host_tools", "release", "build", "--machine", os.uname().machine, "--key",
            str(signed_by or self.key), "--out", str(out), "--counter", str(counter), cwd=self.clone)  # fmt: skip
        [path] = out.glob("*.release")
        return path

    def built_with_a_dying_camera(self, counter: int) -> Path:
        """Return a release file whose camera's process ends at the first frame that it is asked for."""
        worker = self.clone / WORKER
        before = worker.read_text()
        assert LOOP in before
        worker.write_text(before.replace(LOOP, DIES))
        identity = ("-c", "user.name=stories", "-c", "user.email=stories@localhost")
        run("git", *identity, "commit", "--quiet", "--all", "-m", "Let the camera die", cwd=self.clone)
        try:
            return self.built(counter)
        finally:
            run("git", "reset", "--quiet", "--hard", "HEAD~1", cwd=self.clone)

    def altered(self, release: Path, name: str, **fields: Any) -> Path:
        """Return a copy whose manifest says something else, signed well."""
        path = self.folder / "releases" / f"{name}.release"
        with tarfile.open(release, "r:") as old, tarfile.open(path, "w", format=tarfile.USTAR_FORMAT) as new:
            record = json.load(old.extractfile(old.next()))
            content = (json.dumps(record | fields) + "\n").encode()
            old.next()
            for member, text in (("manifest.json", content), ("manifest.json.sig", self._signature(content))):
                _add(new, member, text)
            for member in old:
                new.addfile(member, old.extractfile(member))
        return path

    def damaged(self, release: Path, name: str, *, flip: int | None = None, keep: int | None = None) -> Path:
        """Return a copy with one bit of the byte at `flip` turned over, or with its first `keep` bytes alone."""
        path = self.folder / "releases" / f"{name}.release"
        content = bytearray(release.read_bytes())
        if flip is not None:
            content[flip] ^= 1
        path.write_bytes(content[:keep])
        return path

    def _made_key(self, path: Path) -> str:
        return run(sys.executable, "-m", "host_tools", "release", "key", str(path), "--no-passphrase")

    def _signature(self, content: bytes) -> bytes:
        file = self.folder / "releases/manifest.json"
        file.write_bytes(content)
        file.with_name("manifest.json.sig").unlink(missing_ok=True)
        run("ssh-keygen", "-q", "-Y", "sign", "-f", str(self.key), "-n", "tsis-release", str(file))
        return file.with_name("manifest.json.sig").read_bytes()


def _add(archive: tarfile.TarFile, name: str, content: bytes) -> None:
    member = tarfile.TarInfo(name)
    member.size, member.mode = len(content), 0o644
    archive.addfile(member, io.BytesIO(content))
