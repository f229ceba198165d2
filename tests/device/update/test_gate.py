"""What the gate makes of an answer, over real HTTP; whole trials are in test_install.py."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from device.files.plain_settings import DaemonAddress
from device.files.start_note import NOTE
from device.update.gate import (
    PARTS,
    DaemonGone,
    ExcusedStarts,
    NotHealthy,
    Patience,
    ask_parts,
    take_baseline,
    wait_for_press,
    wait_until_healthy,
)

READY = {"release": "1.1+11", "parts": {part: {"ready": True, "code": None} for part in PARTS}, "faults": []}
"""What both paths are answered with: the parts, and a status without a fault."""
REFUSED = {"code": "E002", "cause": "The settings files are bad (light.power in /etc/tsis/config.toml); others."}
FALLBACK = {"type": "about:blank", "status": 503, "code": "E401", "detail": "The model's card was changed."}
AT_ONCE = Patience(within_s=1.0, every_s=0.01)


@contextmanager
def answering(*answers: tuple[int, object]) -> Iterator[int]:
    """Serve one answer after the other, the last one for ever; give the port."""
    left = list(answers)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            status, record = left.pop(0) if len(left) > 1 else left[0]
            self.send_response(status)
            self.end_headers()
            self.wfile.write(json.dumps(record).encode())

        def log_message(self, *_: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server.server_port
        finally:
            server.shutdown()
            thread.join()


def test_the_page_that_stands_in_for_a_daemon_is_no_daemon_and_its_reason_is_told():
    with (
        answering((503, FALLBACK)) as port,
        pytest.raises(DaemonGone, match=r"does not start \(E401: The model's card"),
    ):
        ask_parts(DaemonAddress(port))


def test_a_daemon_that_was_ready_and_then_leaves_the_port_to_the_page_is_not_waited_for():
    with (
        answering((200, READY), (503, FALLBACK)) as port,
        pytest.raises(NotHealthy, match=r"^It was ready, and then the daemon does not start \(E401"),
    ):
        wait_until_healthy(
            DaemonAddress(port), "1.1+11", None, Patience(within_s=600.0, every_s=0.01), lambda part: None
        )


def test_a_daemon_that_comes_after_the_page_is_healthy_once_it_was_ready_three_times():
    told = []
    with answering((503, FALLBACK), (503, FALLBACK), (200, READY)) as port:
        wait_until_healthy(DaemonAddress(port), "1.1+11", None, Patience(within_s=600.0, every_s=0.01), told.append)
    assert len(told) == 2 + 3


def test_the_page_leaves_no_baseline():
    with answering((503, FALLBACK)) as port:
        assert take_baseline(DaemonAddress(port), AT_ONCE) is None


@pytest.mark.parametrize("part", ["answers", "store"])
def test_models_and_store_are_never_excused(part):
    ill = {**READY, "parts": {**READY["parts"], part: {"ready": False, "code": "E601"}}}
    with answering((200, ill)) as port, pytest.raises(NotHealthy, match=f"{part} is not ready"):
        wait_until_healthy(DaemonAddress(port), "1.1+11", {part: "E601"}, AT_ONCE, lambda share: None)


def test_a_part_with_the_fault_of_before_is_excused_and_with_another_it_is_not():
    ill = {**READY, "parts": {**READY["parts"], "camera": {"ready": False, "code": "E101"}}}
    with answering((200, ill)) as port:
        wait_until_healthy(DaemonAddress(port), "1.1+11", {"camera": "E101"}, AT_ONCE, lambda share: None)
        with pytest.raises(NotHealthy, match=r"camera is not ready \(E101\)"):
            wait_until_healthy(DaemonAddress(port), "1.1+11", {"camera": "E104"}, AT_ONCE, lambda share: None)


def test_settings_that_the_release_before_took_and_this_one_refuses_are_no_health_and_told_at_once():
    patient = Patience(within_s=600.0, every_s=0.01)
    with answering((200, {**READY, "faults": [REFUSED]})) as port:
        with pytest.raises(NotHealthy, match=r"^It refuses settings .* \(E002\): .* \(light.power in /etc"):
            wait_until_healthy(DaemonAddress(port), "1.1+11", {}, patient, lambda share: None)
        for known in ({"settings": "E002"}, None):  # they were refused before, or nobody could tell
            assert wait_until_healthy(DaemonAddress(port), "1.1+11", known, patient, lambda share: None) == ""


@pytest.mark.parametrize(("faults", "baseline"), [([REFUSED], {"settings": "E002"}), ([], {})])
def test_settings_that_are_refused_before_the_switch_are_in_the_baseline(faults, baseline):
    with answering((200, {**READY, "faults": faults})) as port:
        assert take_baseline(DaemonAddress(port), AT_ONCE) == baseline


def test_a_press_under_way_is_waited_for_and_one_that_has_ended_is_not():
    def status(press, self_test):
        return 200, {"press": press and {"state": press}, "self_test": self_test and {"state": self_test}}

    pressed, tested, ended = status("capturing", None), status("done", "running"), status("done", "done")
    with answering(pressed, tested, ended, (500, {})) as port:
        wait_for_press(DaemonAddress(port), every_s=0.01)
        with pytest.raises(DaemonGone):  # the three answers were asked for, and no more
            ask_parts(DaemonAddress(port))


def test_where_nobody_can_tell_no_press_is_waited_for():
    with answering((503, FALLBACK)) as port:
        wait_for_press(DaemonAddress(port), every_s=600.0)


class Starts:
    """A daemon that does not start, again and again, each time as another process, with a note of it."""

    def __init__(self, root: Path) -> None:
        self._path, self.pid = root / NOTE, 0
        self._path.parent.mkdir(parents=True)

    def fail(self, *codes: str, release: str = "1.0+10") -> None:
        self.pid += 1
        said = {"title": "", "severity": "fault", "cause": "Not there.", "remedy": ""}
        faults = [{"code": code, **said} for code in codes]
        record = {"schema": "tsis.start/1", "pid": self.pid, "release": release, "faults": faults}
        self._path.write_text(json.dumps(record))


def test_a_start_is_excused_once_a_second_one_has_failed_for_its_machine_too(tmp_path):
    """One part may be late once, as a camera that a board has just found."""
    starts, excused = Starts(tmp_path), ExcusedStarts(tmp_path, "1.0+10", lacking=None)
    assert excused.words(is_last=True) == ""  # nobody has said why
    starts.fail("E101")
    assert excused.words(is_last=False) == excused.words(is_last=False) == ""
    starts.fail("E101", "E001")
    assert excused.words(is_last=False) == "E101 Not there. E001 Not there."


@pytest.mark.parametrize(
    ("codes", "release", "lacking"),
    [(("E401",), "1.0+10", None), (("E101", "E603"), "1.0+10", None), (("E101",), "0.9+9", None),
     (("E101",), "1.0+10", ""), (("E101", "E201"), "1.0+10", "E101 E301")],
)  # fmt: skip
def test_a_start_is_not_excused_for_more_than_its_machine_lacks(tmp_path, codes, release, lacking):
    starts, excused = Starts(tmp_path), ExcusedStarts(tmp_path, "1.0+10", lacking=lacking)
    for _ in range(3):
        starts.fail(*codes, release=release)
        assert excused.words(is_last=True) == ""
