"""A real archive on loopback: Debian's Orthanc as its own process, which may be stopped, killed and started again."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from daemon_process import wait_for
from free_port import free_port

from device.config import DicomSection

TITLE, OWN_TITLE = "HOSPACS", "TSIS"
PLUGIN = Path("/usr/share/orthanc/plugins/libModalityWorklists.so")
PROGRAM = shutil.which("Orthanc", path=f"{os.environ.get('PATH', '')}:/usr/sbin")
needs_orthanc = pytest.mark.skipif(
    not PROGRAM and "TSIS_REQUIRE_PEERS" not in os.environ,  # there its absence is a failure
    reason="Orthanc is not installed (Debian: orthanc)",
)


class Orthanc:
    """An archive that takes from this probe alone, and never overwrites; with a worklist of the files in a folder."""

    def __init__(self, folder: Path, **more: Any) -> None:
        self.folder, self.worklists = folder / "orthanc", folder / "worklists"
        for one in (self.folder, self.worklists):
            one.mkdir()
        self.port, self._http, self.commitment_port = free_port(), free_port(), free_port()
        stated = {
            "Name": "test", "StorageDirectory": str(self.folder), "IndexDirectory": str(self.folder),
            "HttpPort": self._http, "RemoteAccessAllowed": False, "AuthenticationEnabled": False,
            "DicomAet": TITLE, "DicomPort": self.port, "DicomCheckCalledAet": True, "DicomAlwaysAllowEcho": False,
            "DicomAlwaysAllowStore": False, "DicomAlwaysAllowFind": False, "DicomAlwaysAllowFindWorklist": False,
            "DicomModalities": {"probe": {"AET": OWN_TITLE, "Host": "127.0.0.1", "Port": self.commitment_port}},
            "UnknownSopClassAccepted": False, "OverwriteInstances": False, "SyncStorageArea": True,
            "DicomServerEnabled": True, "DicomCheckModalityHost": False, "Plugins": [str(PLUGIN)],
            "Worklists": {"Enable": True, "Database": str(self.worklists), "FilterIssuerAet": False}, **more,
        }  # fmt: skip
        self._settings = folder / "orthanc.json"
        self._stated: dict[str, Any] = {}
        self.state(**stated)
        self._log = (folder / "orthanc.log").open("w")
        self._process: subprocess.Popen[bytes] | None = None

    def state(self, **settings: Any) -> None:
        """Set more, before it is started."""
        self._stated |= settings
        self._settings.write_text(json.dumps(self._stated))

    def start(self) -> Orthanc:
        self._process = subprocess.Popen(
            [PROGRAM or "Orthanc", str(self._settings)], stdout=self._log, stderr=self._log
        )
        wait_for(self._answers, bool)
        return self

    def _answers(self) -> bool:
        assert self._process is not None
        assert self._process.poll() is None, Path(self._log.name).read_text()
        try:
            self.ask("system")
        except OSError:
            return False
        return True

    def kill(self) -> None:
        if self._process:
            self._process.kill()
            self._process.wait()
            self._process = None

    def close(self) -> None:
        self.kill()
        self._log.close()

    def ask(self, path: str) -> Any:
        with urllib.request.urlopen(f"http://127.0.0.1:{self._http}/{path}", timeout=30) as answer:
            content = answer.read()
        return json.loads(content) if answer.headers["Content-Type"].startswith("application/json") else content

    def remove(self, path: str) -> None:
        request = urllib.request.Request(f"http://127.0.0.1:{self._http}/{path}", method="DELETE")
        with urllib.request.urlopen(request, timeout=30):
            pass

    def kept(self) -> list[dict[str, str]]:
        """Return the tags of every object that it keeps, by their names."""
        return [self.ask(f"instances/{one}/simplified-tags") for one in self.ask("instances")]

    def files(self) -> list[bytes]:
        return [self.ask(f"instances/{one}/file") for one in self.ask("instances")]

    def settings(self, **more: Any) -> DicomSection:
        """Return the probe's settings for this archive and its worklist."""
        here = {"archive_host": "127.0.0.1", "archive_port": self.port, "archive_title": TITLE}
        worklist = {"worklist_host": "127.0.0.1", "worklist_port": self.port, "worklist_title": TITLE}
        return DicomSection(**{**here, **worklist, "own_title": OWN_TITLE, **more})
