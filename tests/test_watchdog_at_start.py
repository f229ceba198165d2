"""A probe that is held while its daemon starts, under a stand-in for systemd: served, dark, and ready by itself.

The tare fails until the hand, as that of `scenarios/probe_held.toml`, reads the fault on the screen and lifts it.
"""

from __future__ import annotations

import pytest
from supervisor import Supervisor, codes, faults

pytestmark = pytest.mark.real_time
WATCHDOG_S = 6.0
HELD = "[hand]\nheld_n = 0.5\nreaction_s = 5.0\nrate_n_per_s = 3.0\n"
"""It is held for longer than the load cell may be silent: three tenths of the watchdog's time."""
DARK = (0.0, 0.0, 0.0, 0.0)


@pytest.mark.long
def test_a_daemon_whose_probe_is_held_is_fed_says_so_and_is_ready_once_it_is_lifted(tmp_path):
    supervisor = Supervisor(tmp_path, HELD, WATCHDOG_S)
    try:
        daemon = supervisor.start()
        assert supervisor.messages == ["READY=1"]
        [fault] = faults(daemon)
        assert (fault["code"], fault["severity"]) == ("E306", "fault")
        assert fault["remedy"].startswith("Lift the probe")
        assert daemon.ask("/").status == 200
        for path, method in (("/api/v1/health/ready", "GET"), ("/api/v1/presses", "POST")):
            refusal = daemon.ask(path, method, {} if method == "POST" else None)
            assert (refusal.status, refusal.json["code"]) == (503, "E306")
        assert daemon.ask("/api/v1/measurements").json["measurements"] == []
        assert daemon.ask("/api/v1/device").json["light_on_s"] == 0.0
        assert supervisor.chip.led_ratio() == DARK
        assert supervisor.is_fed_until(lambda daemon: daemon.ask("/api/v1/health/ready").status == 200)
        assert codes(daemon) == set()
        assert "WATCHDOG=1" in supervisor.messages
    finally:
        supervisor.close()
