"""The daemon of a release in tests of updates, in the standard library alone: a real process, real HTTP.

It answers as the release under `opt/tsis/current` tells it to (`tsis_fake.json`): `{"mute": true}` never answers,
`{"dies_after": 2}` ends after so many answers, `{"falls_back_after": 2}` gives way to the page that stands in for it,
`{"lacks": ["E101"]}` does not start and notes these codes, `{"faults": {"camera": "E101"}}` is not ready,
`{"says": "..."}` is of another release, `{"refuses": "light.power"}` does not know that setting.
"""

import json
import os
import time
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

ROOT = Path(os.environ["TSIS_FAKE_ROOT"])
PORT = int(os.environ["TSIS_FAKE_PORT"])


class Answers(BaseHTTPRequestHandler):
    left = None
    good = None
    record = None
    status = None

    def do_GET(self):
        if self.path == "/api/v1/status":
            self.send_body(json.dumps(self.status).encode())
            return
        if self.path != "/api/v1/health/parts":
            self.send_error(404)
            return
        body = json.dumps(self.record if self.good is None or self.good > 0 else {"status": 503}).encode()
        if self.good is not None:
            Answers.good -= 1
        self.send_body(body)
        if self.left is not None:
            Answers.left -= 1
            if not self.left:
                self.wfile.flush()
                os._exit(1)

    def send_body(self, body):
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *words):
        pass


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
    Answers.left, Answers.record = behaviour.get("dies_after"), {"release": behaviour.get("says", name), "parts": parts}
    refused = behaviour.get("refuses")
    cause = f"The settings files are bad ({refused} in /etc/tsis/config.toml); it runs on its last good settings."
    Answers.status = {"faults": [{"code": "E002", "cause": cause}] if refused else []}
    Answers.good = behaviour.get("falls_back_after")
    HTTPServer(("127.0.0.1", PORT), Answers).serve_forever()


if __name__ == "__main__":
    daemon()
