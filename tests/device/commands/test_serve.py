"""The daemon's port, and what it leaves behind when it does not start. Its change of hands: test_server.py."""

import socket
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from device.assembly.opened_parts import StartFailed
from device.commands.serve import SWITCH_S, DaemonPort, refusal_noted, serve
from device.config import Config, ServerSection
from device.errors import CameraError, ConfigError, DeviceError, LightError
from device.files.start_note import NOTE, read_note
from device.measurement.bundle import BundleRefused
from device.measurement.quantities import InvalidQuantity
from device.settings.last_good import StartSettings


def test_an_answer_of_two_parts_does_not_wait_for_the_clients_acknowledgement():
    """Without it every request over a connection that stays open takes 44 ms instead of half a millisecond."""
    with ExitStack() as opened:
        listening = opened.enter_context(DaemonPort("127.0.0.1", 0)).listening()
        opened.enter_context(socket.create_connection(listening.getsockname()))
        accepted = opened.enter_context(listening.accept()[0])
        assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_a_probe_whose_network_is_not_there_yet_starts_and_serves_its_own_screen(caplog):
    """192.0.2.7 is of no machine (RFC 5737): as the address of a cable that is out."""
    with DaemonPort("192.0.2.7", 0) as port:
        assert port.listening().getsockname()[0] == "192.0.2.7"
    assert "does not have the address 192.0.2.7 now: it is served once it has" in caplog.text


def test_a_host_that_is_none_is_refused_with_the_setting_that_names_it():
    with pytest.raises(DeviceError, match=r"Port 0 of no\.such\.invalid cannot be used: .* Correct server\.host"):
        DaemonPort("no.such.invalid", 0)


@pytest.mark.parametrize(
    ("error", "codes"),
    [
        (ConfigError("a.", "b."), ["E001"]),
        (StartFailed([CameraError("a.", "b."), LightError("c.", "d.")]), ["E101", "E201"]),
        (InvalidQuantity("press.target_n", 99, "at most 20 N", "correct it"), ["E001"]),
        (BundleRefused(Path("models/paper"), "name", "missing", "there"), ["E401"]),
        (ZeroDivisionError("division by zero"), ["E000"]),
    ],
    ids=lambda value: type(value).__name__,
)
def test_why_a_start_fails_is_noted_with_a_code_and_the_error_goes_on(tmp_path, error, codes):
    (tmp_path / NOTE).parent.mkdir(parents=True)
    with pytest.raises(type(error)), refusal_noted(tmp_path):
        raise error
    faults = read_note(tmp_path).faults
    assert [fault["code"] for fault in faults] == codes
    assert all(fault["cause"] and fault["remedy"] for fault in faults)


def test_what_ends_as_it_should_notes_nothing(tmp_path):
    (tmp_path / NOTE).parent.mkdir(parents=True)
    with refusal_noted(tmp_path):
        pass
    assert read_note(tmp_path) is None


def test_no_thread_of_the_web_keeps_the_frames_waiting_for_pythons_lock():
    before_s = sys.getswitchinterval()

    def opened():
        raise CameraError("There is no camera.", "Plug it in.")

    try:
        with pytest.raises(CameraError):
            serve(StartSettings(Config(server=ServerSection(port=0))), opened)
        assert sys.getswitchinterval() == pytest.approx(SWITCH_S)
    finally:
        sys.setswitchinterval(before_s)
