"""Requests that schemathesis makes of the API's document, good and bad, sent to a running simulated probe.

`python tests/schema_fuzz.py 55` makes some three thousand; for `make fuzz`.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from daemon_process import QUICK_HAND, ROOT, Daemon, wait_for

NEVER_END = ("/api/v1/events", "/api/v1/live.mjpeg")
CONFIGURATION = """
headers = { "Content-Type" = "application/json" }

[checks.positive_data_acceptance]
expected-statuses = ["2xx", "3xx", "401", "403", "404", "409", "412", "415", "422", "429", "5xx"]

[[operations]]
include-path = "/api/v1/updates"
headers = { "Content-Type" = "application/octet-stream" }
"""
"""A document cannot say all that is refused: what belongs together in an exam, which text can be printed, which version
is the present one, how often a code may be wrong. What has no content type is refused before it is looked at, so each
request has one.
"""


@dataclass(frozen=True)
class Fuzzed:
    """How many requests were made, what schemathesis says of them, and what the daemon has logged."""

    exit_code: int
    requests: int
    told: str
    log: str

    @property
    def crashes(self) -> list[str]:
        """The log's lines of requests that the daemon failed to answer."""
        return re.findall(r".*(?:status=500|Traceback|request failed).*", self.log)


def fuzzed(daemon: Daemon, folder: Path, examples: int, seed: int = 1) -> Fuzzed:
    """Send up to so many examples to each operation, and the cases that cover its schema, and check each answer."""
    configuration = folder / "schemathesis.toml"
    configuration.write_text(CONFIGURATION)
    excluded = [word for path in NEVER_END for word in ("--exclude-path", path)]
    command = [
        sys.executable, "-m", "schemathesis.cli", "--config-file", configuration, "run", ROOT / "docs" / "openapi.json",
        "--url", daemon.url, "--checks", "all", "--max-examples", str(examples), "--seed", str(seed), "--no-color",
        "--phases", "examples,coverage,fuzzing", "--request-timeout", "60", "--generation-database",
        "none", *excluded,
    ]  # fmt: skip
    done = subprocess.run(list(map(str, command)), cwd=folder, check=False, capture_output=True, text=True)
    made = re.search(r"(\d+) generated", done.stdout)
    return Fuzzed(done.returncode, int(made[1]) if made else 0, done.stdout + done.stderr, daemon.log_text())


def main(examples: int) -> int:
    """Fuzz a daemon of its own; print what was found; return the exit code."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        daemon = Daemon(folder, QUICK_HAND)
        try:
            wait_for(lambda: daemon.ask("/api/v1/health/ready").status, lambda status: status == 200)
            found = fuzzed(daemon, folder, examples)
        finally:
            daemon.stop()
    print(found.told, *found.crashes, json.dumps({"requests": found.requests, "crashes": len(found.crashes)}), sep="\n")
    return found.exit_code or bool(found.crashes)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 55))
