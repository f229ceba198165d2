"""A `systemctl` and a daemon for tests of updates, in the standard library alone: a real process, real HTTP.

`fake_systemd.py systemctl VERB...` is the command; it starts and kills `fake_systemd.py daemon`, which answers as the
release under `opt/tsis/current` tells it to (`tsis_fake.json`): `{"mute": true}` never answers, `{"dies_after": 2}`
ends after so many answers, `{"falls_back_after": 2}` gives way to the page that stands in for it,
`{"faults": {"camera": "E101"}}` is not ready, `{"says": "..."}` is of another release.
"""

import json
import os
import signal
import subprocess
import sys
import time
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

ROOT = Path(os.environ["TSIS_FAKE_ROOT"])
PORT = int(os.environ["TSIS_FAKE_PORT"])
PID = Path(os.environ["TSIS_FAKE_STATE"]) / "daemon.pid"
CALLS = PID.with_name("systemctl.log")
REFUSED = PID.with_name("refused")


def systemctl(words):
    with CALLS.open("a") as log:
        log.write(" ".join(words) + "\n")
    verb = words[-2] if words[-1] == "tsis.service" else words[-1]
    if REFUSED.exists() and verb in REFUSED.read_text().split():
        sys.exit(f"Failed to {verb}: as the test asked.")
    if verb == "stop" and not (ROOT / "opt/tsis/current").exists():
        print("Failed to stop tsis.service: Unit tsis.service not loaded.", file=sys.stderr)
        sys.exit(5)
    if verb == "start" and not alive():
        subprocess.run(os.environ.get("TSIS_FAKE_ON_START", "true").split(), check=True)
        command = [sys.executable, "-S", "-E", __file__, "daemon"]
        quiet = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
        PID.write_text(str(subprocess.Popen(command, start_new_session=True, **quiet).pid))
    if verb == "stop" and alive():
        os.kill(alive(), signal.SIGKILL)
        while alive():
            time.sleep(0.005)


def alive():
    """The daemon's process, or 0; one that has ended and is nobody's child any more counts as gone."""
    try:
        pid = int(PID.read_text())
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, ValueError):
        return 0
    return 0 if state in "ZX" else pid


class Answers(BaseHTTPRequestHandler):
    left = None
    good = None
    record = None

    def do_GET(self):
        if self.path != "/api/v1/health/parts":
            self.send_error(404)
            return
        body = json.dumps(self.record if self.good is None or self.good > 0 else {"status": 503}).encode()
        if self.good is not None:
            Answers.good -= 1
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)
        if self.left is not None:
            Answers.left -= 1
            if not self.left:
                self.wfile.flush()
                os._exit(1)

    def log_message(self, *words):
        pass


def daemon():
    current = ROOT / "opt/tsis/current"
    name = Path(os.readlink(current)).name
    behaviour = json.loads(next(current.glob("lib/python3*/site-packages/tsis_fake.json")).read_text())
    if behaviour.get("mute"):
        time.sleep(600)
    faults = behaviour.get("faults", {})
    parts = {
        part: {"ready": part not in faults, "code": faults.get(part)}
        for part in ("camera", "light", "force", "answers", "store")
    }
    Answers.left, Answers.record = behaviour.get("dies_after"), {"release": behaviour.get("says", name), "parts": parts}
    Answers.good = behaviour.get("falls_back_after")
    HTTPServer(("127.0.0.1", PORT), Answers).serve_forever()


if __name__ == "__main__":
    daemon() if sys.argv[1] == "daemon" else systemctl(sys.argv[2:])
