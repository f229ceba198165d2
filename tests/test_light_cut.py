"""With an enable line a probe whose daemon is frozen, or stuck in its bus, is dark by itself: nobody has to end it.

The LED chip, its line's end and the test are one process; the daemon is a second, and the keeper of the line a third.
"""

from __future__ import annotations

import signal

import pytest
from daemon_process import QUICK_HAND, wait_for
from supervisor import Supervisor, codes

from device.records.store import ENDED

pytestmark = pytest.mark.real_time
LINE = "[settings.light]\nenable_line = 17\n"
HUNG_BUS = '[[faults]]\nkind = "i2c_frozen"\nfrom_press = 1\nfrom_s = 1.5\n[settings.press]\nmode = "standard"\n'
WATCHDOG_S = 600.0
PRESSED = ("too_light", "unsteady", "holding", "capturing")


def pressing(supervisor):
    """Start a daemon and return it once the light of a press is on.

    On a machine so busy that the daemon has no processor for 0.75 s the line does what it is there for, and the press
    fails: then another one is asked for.
    """
    daemon = supervisor.start()
    light_a_press(supervisor, daemon)
    return daemon


def light_a_press(supervisor, daemon):
    """Ask for presses until one is lit."""

    def is_lit():
        status = daemon.ask("/api/v1/status").json
        if status["press"] is None or status["press"]["state"] in ENDED:
            daemon.ask("/api/v1/presses", "POST", {})
        return status["press_state"] in PRESSED and min(supervisor.chip.led_ratio()) > 0.5

    wait_for(is_lit, bool)


@pytest.fixture
def supervisor(tmp_path, request):
    made = Supervisor(tmp_path, f"{QUICK_HAND}{LINE}{request.param}", WATCHDOG_S, has_line=True)
    yield made
    made.close()


@pytest.mark.parametrize("supervisor", [""], indirect=True, ids=[""])
def test_a_frozen_daemon_is_dark_while_it_is_frozen_and_measures_again_when_it_goes_on(supervisor):
    daemon = supervisor.start()

    def press_frozen():
        """Return how a press ended that was frozen while lit, or "done" when it had just ended by itself."""
        light_a_press(supervisor, daemon)
        daemon.process.send_signal(signal.SIGSTOP)
        wait_for(supervisor.chip.led_ratio, lambda light: not any(light))
        assert daemon.process.poll() is None
        daemon.process.send_signal(signal.SIGCONT)
        job = daemon.ask("/api/v1/status").json["press"]
        return daemon.ended(f"/api/v1/presses/{job['id']}")["state"]

    wait_for(press_frozen, lambda state: state == "failed")

    def has_measured():
        answer = daemon.ask("/api/v1/presses", "POST", {})
        return answer.status == 202 and daemon.ended(answer.headers["location"])["state"] == "done"

    wait_for(has_measured, bool)


@pytest.mark.parametrize("supervisor", [HUNG_BUS], indirect=True, ids=[""])
def test_a_daemon_whose_bus_hangs_is_dark_before_anybody_ends_it_and_after_a_kill(supervisor):
    daemon = pressing(supervisor)
    wait_for(supervisor.chip.led_ratio, lambda light: not any(light))
    assert "E901" not in codes(daemon), "the watchdog was first"
    daemon.process.kill()
    daemon.ended_code()
    assert not any(supervisor.chip.led_ratio())
    assert supervisor.stop_post()[0] == 0


@pytest.mark.parametrize("supervisor", [""], indirect=True, ids=[""])
def test_a_killed_daemon_is_dark_before_anything_is_started_for_it(supervisor):
    daemon = pressing(supervisor)
    daemon.process.kill()
    wait_for(supervisor.chip.led_ratio, lambda light: not any(light))
    daemon.ended_code()
