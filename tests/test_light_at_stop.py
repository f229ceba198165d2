"""The light of a daemon that is told to stop goes off first: before its clients are waited for."""

from __future__ import annotations

import signal
import urllib.request

import pytest
from daemon_process import QUICK_HAND, wait_for
from supervisor import Supervisor

pytestmark = pytest.mark.real_time
WATCHDOG_S = 60.0


@pytest.mark.parametrize("ending", [signal.SIGTERM, signal.SIGINT])
def test_a_daemon_with_a_screen_connected_is_dark_before_it_lets_the_screen_go(tmp_path, ending):
    supervisor = Supervisor(tmp_path, QUICK_HAND, WATCHDOG_S)
    try:
        daemon = supervisor.start()
        assert supervisor.is_fed_until(lambda daemon: daemon.ask("/api/v1/health/ready").status == 200)
        with urllib.request.urlopen(daemon.url + "/api/v1/events") as screen:
            assert screen.readline() == b"event: status\n"
            daemon.ask("/api/v1/presses", "POST", {})
            wait_for(supervisor.chip.led_ratio, lambda light: min(light) > 0.5)
            daemon.process.send_signal(ending)
            wait_for(supervisor.chip.led_ratio, lambda light: not any(light))
            assert daemon.process.poll() is None, "it was dark no sooner than it had ended"
            while screen.readline():
                pass
        daemon.ended_code()
        assert not any(supervisor.chip.led_ratio())
    finally:
        supervisor.close()
