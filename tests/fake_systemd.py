"""A `systemctl` for tests of updates, in the standard library alone: it starts and kills tests/fake_daemon.py.

`fake_systemd.py VERB...` is the command. An update calls it many times: it imports no more than it needs.
"""

import os
import signal
import sys
import time
from pathlib import Path

ROOT = Path(os.environ["TSIS_FAKE_ROOT"])
PID = Path(os.environ["TSIS_FAKE_STATE"]) / "daemon.pid"
CALLS = PID.with_name("systemctl.log")
REFUSED = PID.with_name("refused")
DAEMON = Path(__file__).with_name("fake_daemon.py")


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
        if before := os.environ.get("TSIS_FAKE_ON_START"):
            assert os.system(before) == 0
        PID.write_text(str(started([sys.executable, "-S", "-E", str(DAEMON)])))
    if verb == "stop" and alive():
        os.kill(alive(), signal.SIGKILL)
        while alive():
            time.sleep(0.005)


def started(command):
    """Start a process of its own session with nothing to read or write; return its number."""
    quiet = [(os.POSIX_SPAWN_OPEN, number, os.devnull, os.O_RDWR, 0) for number in range(3)]
    return os.posix_spawn(command[0], command, os.environ, file_actions=quiet, setsid=True)


def alive():
    """The daemon's process, or 0; one that has ended and is nobody's child any more counts as gone."""
    try:
        pid = int(PID.read_text())
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, ValueError):
        return 0
    return 0 if state in "ZX" else pid


if __name__ == "__main__":
    systemctl(sys.argv[1:])
