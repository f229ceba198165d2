"""The daemon of a release in tests of updates, in the standard library alone: a real process, real HTTP.

It answers as the release under `opt/tsis/current` tells it to (`tsis_fake.json`): `{"mute": true}` never answers,
`{"dies_after": 2}` ends after so many answers, `{"falls_back_after": 2}` gives way to the page that stands in for it,
`{"lacks": ["E101"]}` does not start and notes these codes, `{"faults": {"camera": "E101"}}` is not ready,
`{"says": "..."}` is of another release, `{"refuses": "light.power"}` does not know that setting.
"""

import json
import os
import socket
import time
from pathlib import Path

ROOT = Path(os.environ["TSIS_FAKE_ROOT"])
PORT = int(os.environ["TSIS_FAKE_PORT"])


class Answers:
    """What is said of the parts and of all, and how often the first is said (None: always)."""

    def __init__(self, health, status, left, good):
        self.health, self.status, self.left, self.good = health, status, left, good

    def serve(self):
        """Answer one request a connection; http.server would take three times as long to start."""
        listening = socket.create_server(("127.0.0.1", PORT))
        while True:
            line, _ = listening.accept()
            with line, line.makefile("rb") as request:
                words = request.readline().split()
                while request.readline().strip():
                    pass
                line.sendall(self.answer(words[1].decode() if len(words) > 1 else ""))
            if self.left is not None and self.left <= 0:
                os._exit(1)

    def answer(self, path):
        if path == "/api/v1/status":
            return said("200 OK", self.status)
        if path != "/api/v1/health/parts":
            return said("404 Not Found", {})
        record = self.health if self.good is None or self.good > 0 else {"status": 503}
        if self.good is not None:
            self.good -= 1
        if self.left is not None:
            self.left -= 1
        return said("200 OK", record)


def said(status, record):
    body = json.dumps(record)
    return f"HTTP/1.0 {status}\r\nContent-Length: {len(body)}\r\n\r\n{body}".encode()


def keep_note(name, codes):
    said = {"title": "", "severity": "fault", "cause": "It is not there.", "remedy": "Plug it in."}
    record = {
        "schema": "tsis.start/1",
        "pid": os.getpid(),
        "release": name,
        "faults": [{"code": code, **said} for code in codes],
    }
    (ROOT / "run/tsis").mkdir(parents=True, exist_ok=True)
    (ROOT / "run/tsis/start.json").write_text(json.dumps(record))


def daemon():
    current = ROOT / "opt/tsis/current"
    name = Path(os.readlink(current)).name
    behaviour = json.loads(next(current.glob("lib/python3*/site-packages/tsis_fake.json")).read_text())
    if behaviour.get("mute"):
        time.sleep(600)
    if codes := behaviour.get("lacks"):
        keep_note(name, codes)
        os._exit(1)
    faults = behaviour.get("faults", {})
    parts = {
        part: {"ready": part not in faults, "code": faults.get(part)}
        for part in ("camera", "light", "force", "answers", "store")
    }
    health = {"release": behaviour.get("says", name), "parts": parts}
    refused = behaviour.get("refuses")
    cause = f"The settings files are bad ({refused} in /etc/tsis/config.toml); it runs on its last good settings."
    status = {"faults": [{"code": "E002", "cause": cause}] if refused else []}
    Answers(health, status, behaviour.get("dies_after"), behaviour.get("falls_back_after")).serve()


if __name__ == "__main__":
    daemon()
