"""A daemon that did not end by a stop: the next one says so once, with what systemd knows of it."""

from __future__ import annotations

import pytest
from supervisor import Supervisor, faults

pytestmark = pytest.mark.real_time
WATCHDOG_S = 60.0


def test_a_kill_is_a_warning_after_the_next_start_and_only_after_that(tmp_path):
    supervisor = Supervisor(tmp_path, "", WATCHDOG_S)
    try:
        supervisor.start().process.kill()
        supervisor.daemon.ended_code()
        assert supervisor.stop_post(SERVICE_RESULT="signal", EXIT_CODE="killed", EXIT_STATUS="KILL")[0] == 0
        [warning] = faults(supervisor.start())
        assert (warning["code"], warning["severity"]) == ("E903", "warning")
        assert warning["cause"] == "The daemon was killed by the signal KILL."
        assert supervisor.daemon.stop() == 0
        assert faults(supervisor.start()) == []
    finally:
        supervisor.close()
