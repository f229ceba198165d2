"""What schemathesis makes of the API's document finds no answer that the document does not allow, and no crash."""

from __future__ import annotations

from pathlib import Path

import pytest
from daemon_process import Daemon, wait_for
from schema_fuzz import fuzzed

pytestmark = [pytest.mark.real_time, pytest.mark.long]


def test_every_answer_is_as_the_document_says_and_the_probe_still_measures(daemon: Daemon, tmp_path: Path):
    wait_for(lambda: daemon.ask("/api/v1/health/ready").status, lambda status: status == 200)
    found = fuzzed(daemon, tmp_path, examples=3)
    assert found.exit_code == 0, found.told[-6000:]
    assert found.crashes == []
    assert found.requests > 1500

    def is_free() -> bool:
        holder = daemon.ask("/api/v1/tare", "POST", {}).json.get("holder")
        if holder and holder["kind"] == "press":
            daemon.ask(f"/api/v1/presses/{holder['id']}", "DELETE")
        return holder is None

    wait_for(is_free, bool)
    wait_for(lambda: daemon.press("quick")["state"], lambda state: state == "done")
    assert daemon.ask("/api/v1/measurements").status == 200
