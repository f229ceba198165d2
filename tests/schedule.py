"""Which tests of a parallel run (`-n`) share a worker: those of a file, and all in which a hand presses in real time.

Two hands at once would each see frames come late; the tests of a file share what is set up once for them.
"""

from __future__ import annotations

from xdist.scheduler import LoadScopeScheduling

IN_REAL_TIME = tuple(
    f"tests/{path}"
    for path in ("browser/", "device/test_modes", "device/test_scenarios", "test_press_to_result", "test_watchdog")
)


class OneHand(LoadScopeScheduling):
    """Sends the tests of a file to one worker, and those in real time to one, too."""

    def _split_scope(self, nodeid: str) -> str:
        return "real time" if nodeid.startswith(IN_REAL_TIME) else nodeid.split("::", 1)[0]
