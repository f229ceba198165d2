"""Certificates of an authority on this machine: for a name or address, valid from and until when a test says."""

from __future__ import annotations

import subprocess
from datetime import UTC, datetime, timedelta
from pathlib import Path


class Authority:
    """An authority with its own folder; `certificate` is what is to be trusted."""

    def __init__(self, folder: Path, name: str) -> None:
        folder.mkdir()
        self._folder, self.certificate, self._key = folder, folder / "ca.pem", folder / "ca.key"
        self._run("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", f"/CN={name}",
                  "-out", self.certificate, "-keyout", self._key)  # fmt: skip
        for made in ("index.txt", "index.txt.attr"):
            (folder / made).touch()
        settings = (
            f"[ca]\ndefault_ca=own\n[own]\ndatabase={folder}/index.txt\nnew_certs_dir={folder}\n"
            "rand_serial=yes\ndefault_md=sha256\npolicy=any\nunique_subject=no\n[any]\ncommonName=supplied\n"
        )
        (folder / "ca.cnf").write_text(settings)

    def sign(
        self, name: str, alternative: str = "IP:127.0.0.1", *, from_days: float = -1, days: float = 2
    ) -> tuple[Path, Path]:
        """Return a certificate and its key, valid from so many days from now, for so many days."""
        at = self._folder / name
        made, key, asked, more = (at.with_suffix(end) for end in (".pem", ".key", ".csr", ".ext"))
        more.write_text(f"subjectAltName={alternative}\n")
        begin = datetime.now(UTC) + timedelta(days=from_days)
        begin_at, end_at = (f"{one:%Y%m%d%H%M%SZ}" for one in (begin, begin + timedelta(days=days)))
        self._run("req", "-newkey", "rsa:2048", "-nodes", "-subj", f"/CN={name}", "-out", asked, "-keyout", key)
        of_authority = "-config", self._folder / "ca.cnf", "-cert", self.certificate, "-keyfile", self._key
        of_certificate = "-extfile", more, "-startdate", begin_at, "-enddate", end_at
        self._run("ca", "-batch", "-notext", *of_authority, *of_certificate, "-in", asked, "-out", made)
        return made, key

    def _run(self, *words: str | Path) -> None:
        subprocess.run(["openssl", *map(str, words)], check=True, capture_output=True)
