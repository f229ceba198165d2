"""Unpacks a release file as a probe does, with Debian's own Python and ssh-keygen: FILE SIGNERS FOLDER.

A stand-in for `python3 -m device.update install`, which also switches a running daemon. Verified first: the signature,
then size and hash of every file.
"""

from __future__ import annotations

import compileall
import hashlib
import io
import json
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path


def main(file: Path, signers: Path, folder: Path) -> None:
    with tarfile.open(file, "r:") as archive:
        contents = {member.name: archive.extractfile(member).read() for member in archive}
    manifest, signature = contents.pop("manifest.json"), contents.pop("manifest.json.sig")
    Path("manifest.json.sig").write_bytes(signature)
    verify = ["ssh-keygen", "-Y", "verify", "-f", signers, "-I", "release@tsis", "-n", "tsis-release"]
    subprocess.run([*verify, "-s", "manifest.json.sig", "-Overify-time=20300101"], input=manifest, check=True)
    stated = json.loads(manifest)
    found = [(name, len(content), hashlib.sha256(content).hexdigest()) for name, content in contents.items()]
    assert found == [(entry["path"], entry["size"], entry["sha256"]) for entry in stated["files"]]
    release = folder / "releases" / f"{stated['version']}+{stated['counter']}"
    packages = release / "lib" / f"python{stated['python']}" / "site-packages"
    for name, content in contents.items():
        if name.startswith("wheels/"):
            zipfile.ZipFile(io.BytesIO(content)).extractall(packages)
        else:
            (release / name).parent.mkdir(parents=True, exist_ok=True)
            (release / name).write_bytes(content)
    (release / "pyvenv.cfg").write_text("home = /usr/bin\ninclude-system-site-packages = true\nversion = 3.11.2\n")
    (release / "bin").mkdir()
    (release / "bin" / "python").symlink_to("/usr/bin/python3")
    compileall.compile_dir(packages, quiet=2)
    (folder / "current").symlink_to(release)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
