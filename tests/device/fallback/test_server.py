"""The fallback as a process without any package: what it answers, whom it refuses, and when it gives up the port."""

import socket
from contextlib import ExitStack
from pathlib import Path

import pytest
from daemon_process import wait_for
from fallback_process import Fallback, ProbeRoot

from device.access.safe_headers import SAFE_HEADERS
from device.commands.serve import DaemonPort, _ports
from device.config import Config, ServerSection
from device.errors import ConfigError, DeviceError
from device.fallback.address import own_addresses
from device.fallback.handover import ask_for_port, is_fallback
from device.files.screen_choices import NAME, ScreenChoices, write_choices
from device.files.start_note import write_note
from device.web.entrance.network import bound

REFUSED = ConfigError("press.target_n is 99.", "Correct it.")
ROLL_BACK = "/api/v1/updates/roll-back"


@pytest.fixture(scope="module")
def fallback(tmp_path_factory):
    root = ProbeRoot(tmp_path_factory.mktemp("probe"))
    root.releases("0.2.0+9", committed="0.2.0+9", previous="0.1.0+3")
    write_note(root.folder, [REFUSED.as_record()])
    running = Fallback(root)
    yield running
    assert running.stop() == 0


@pytest.mark.parametrize(
    ("method", "path"),
    [
        *(("GET", f"/api/v1/{path}") for path in ("health/live", "health/ready", "health/parts", "status", "events")),
        *(("POST", "/api/v1/presses"), ("POST", "/api/v1/tare"), ("DELETE", "/api/v1/presses/p-1")),
    ],
)
def test_a_program_is_told_why_and_to_come_again(fallback, method, path):
    answer = fallback.ask(method, path)
    assert (answer.status, answer.json["code"], answer.json["detail"]) == (503, "E001", "press.target_n is 99.")
    assert answer.json["faults"] == [REFUSED.as_record()]
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["retry-after"] == "5"


def test_the_page_says_it_too_and_its_files_are_there(fallback):
    answer = fallback.ask("GET", "/")
    assert answer.status == 503
    assert "press.target_n is 99." in answer.body.decode()
    for name in ("screen.css", "fallback.css", "fallback.js"):
        assert len(fallback.ask("GET", f"/static/{name}").body) > 500
    assert fallback.ask("HEAD", "/").body == b""


@pytest.mark.parametrize(
    "path", ["/static/../server.py", "/static/%2e%2e/server.py", "/static/server.py", "/etc/passwd", "/x"]
)
def test_nothing_else_is(fallback, path):
    answer = fallback.ask("GET", path)
    assert (answer.status, answer.json["code"]) == (404, "E804")


def test_every_answer_has_the_headers_of_the_daemons(fallback):
    assert fallback.ask("GET", "/").headers.items() >= SAFE_HEADERS.items()


@pytest.mark.parametrize("path", [ROLL_BACK, "/fallback/yield", "/fallback/support"])
@pytest.mark.parametrize(
    ("headers", "code"),
    [
        ({"Host": "evil.example"}, "E806"),
        ({"Origin": "http://evil.example"}, "E807"),
        ({"Sec-Fetch-Site": "cross-site"}, "E807"),
        ({"Content-Type": "text/plain"}, "E808"),
        ({"Content-Length": "65537"}, "E809"),
    ],
)
def test_the_daemons_rules_hold_for_the_ways_out(fallback, path, headers, code):
    answer = fallback.ask("POST", path, headers)
    assert answer.json["code"] == code
    assert not list((fallback.root.folder / "var/lib/tsis-update/incoming").iterdir())


def test_the_probe_itself_may_ask_the_updater(fallback):
    assert fallback.ask("POST", ROLL_BACK, {"Origin": fallback.root.url}).status == 202
    asked = fallback.root.folder / "var/lib/tsis-update/incoming/roll_back"
    assert asked.exists()
    assert fallback.ask("POST", ROLL_BACK).status == 409
    asked.unlink()


def test_many_who_say_nothing_keep_nobody_from_being_answered(fallback):
    silent = [socket.create_connection(("127.0.0.1", fallback.root.port)) for _ in range(50)]
    assert fallback.ask("GET", "/api/v1/status").status == 503
    for one in silent:
        one.close()


def test_a_page_is_served_to_another_machine_but_no_way_out(tmp_path):
    """This machine's own address on the network stands for another one: it is not loopback."""
    addresses = own_addresses()
    if not addresses:
        pytest.skip("this machine has no address but loopback")
    root = ProbeRoot(tmp_path)
    root.settings('host = "0.0.0.0"\n')
    root.releases("0.2.0+9", committed="0.2.0+9", previous="0.1.0+3")
    running = Fallback(root)
    try:
        answer = running.ask("GET", "/", at=addresses[0])
        assert answer.status == 503
        assert b"<button" not in answer.body
        assert b"0.1.0+3" in answer.body
        for path in (ROLL_BACK, "/fallback/support"):
            refused = running.ask("POST", path, at=addresses[0])
            assert (refused.status, refused.json["code"]) == (403, "E807")
        assert running.state() == 200
    finally:
        running.stop()


def test_a_daemon_that_serves_one_address_of_this_machine_gets_its_port(tmp_path):
    """It asks from that very address, which nobody else has."""
    addresses = own_addresses()
    if not addresses:
        pytest.skip("this machine has no address but loopback")
    root = ProbeRoot(tmp_path)
    root.settings(f'host = "{addresses[0]}"\n')
    running = Fallback(root, waits=False)
    try:
        wait_for(lambda: is_fallback(addresses[0], root.port), bool)
        assert ask_for_port(addresses[0], root.port)
    finally:
        running.stop()


def test_a_host_that_this_machine_has_not_is_served_on_loopback(tmp_path):
    root = ProbeRoot(tmp_path)
    root.settings('host = "192.0.2.77"\n')
    running = Fallback(root)
    assert running.state() == 200
    running.stop()


def test_a_daemon_whose_address_is_not_there_yet_gets_loopback_from_the_fallback(tmp_path):
    """The cable is out: the fallback has loopback, and the daemon takes its own address before it has it."""
    root = ProbeRoot(tmp_path)
    root.settings('host = "192.0.2.77"\n')
    running = Fallback(root)
    config = Config(data=tmp_path / "var", server=ServerSection(host="192.0.2.77", port=root.port, tls_port=0))
    with ExitStack() as opened:
        ports = _ports(config, opened)
        assert ports.network is not None
        assert running.state() == 200  # while parts are opened
        addresses = [port.listening().getsockname() for port in ports.served]
    assert addresses == [("192.0.2.77", root.port), ("127.0.0.1", root.port)]
    wait_for(running.state, lambda state: state == 200)
    running.stop()


def test_without_a_certificate_an_address_of_the_network_is_closed_and_the_fallback_does_not_get_it_back(tmp_path):
    """It would say there that no daemon runs. What listens meanwhile is loopback."""
    root = ProbeRoot(tmp_path)
    root.settings('host = "192.0.2.77"\n')
    missing = {"certificate": str(tmp_path / "none.pem"), "certificate_key": str(tmp_path / "none.key")}
    server = ServerSection(host="192.0.2.77", port=root.port, tls_port=0, **missing)
    with ExitStack() as opened:
        ports = _ports(Config(data=tmp_path / "var", server=server), opened)
        assert ports.network is None
        assert str(tmp_path / "none.pem") in ports.refusal.cause
        [closed] = ports.closed
        closed.hold_closed()
        with pytest.raises(OSError, match="in use"):
            bound("192.0.2.77", root.port)
        assert [port.listening().getsockname() for port in ports.served] == [("127.0.0.1", root.port)]
        assert not closed.listening().getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN)


class TestThePort:
    @pytest.fixture
    def running(self, tmp_path):
        running = Fallback(ProbeRoot(tmp_path))
        yield running
        running.stop()

    def daemon_port(self, running):
        return DaemonPort("127.0.0.1", running.root.port)

    def test_a_daemon_that_starts_in_vain_leaves_the_page_where_it_is(self, running):
        with self.daemon_port(running):
            assert running.state() == 200  # while parts are opened
        assert running.state() == 200

    def test_a_daemon_that_is_ready_gets_it_and_the_fallback_has_it_again_afterwards(self, running):
        with self.daemon_port(running) as port:
            listening = port.listening()
            assert listening.getsockname()[1] == running.root.port
            with pytest.raises(DeviceError, match="cannot be used: Address already in use"):
                self.daemon_port(running)  # a second daemon
        wait_for(running.state, lambda state: state == 200)

    def test_a_fallback_that_has_taken_it_again_is_asked_again(self, running, monkeypatch):
        """The daemon's machine is busy for longer than the port is left to it."""
        with self.daemon_port(running) as port:
            taken = port._taken

            def too_late():
                monkeypatch.setattr(port, "_taken", taken)
                wait_for(running.state, lambda state: state is None)
                wait_for(running.state, lambda state: state == 200)

            monkeypatch.setattr(port, "_taken", too_late)
            assert port.listening().getsockname()[1] == running.root.port

    def test_who_asks_without_taking_it_gets_it_no_longer_than_that(self, running):
        assert is_fallback("127.0.0.1", running.root.port)
        assert ask_for_port("127.0.0.1", running.root.port)
        wait_for(running.state, lambda state: state is None)
        wait_for(running.state, lambda state: state == 200)


def test_a_port_that_somebody_else_has_is_waited_for(tmp_path):
    root = ProbeRoot(tmp_path)
    with socket.create_server(("127.0.0.1", root.port)):
        running = Fallback(root, waits=False)
        wait_for(lambda: running.process.poll() or Path(running.log.name).exists(), bool)
        assert not is_fallback("127.0.0.1", root.port)
    wait_for(running.state, lambda state: state == 200)
    running.stop()


def test_systemd_is_told_that_it_goes_on(tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        running = Fallback(ProbeRoot(tmp_path / "probe"), environment={"NOTIFY_SOCKET": str(tmp_path / "notify")})
        told = [systemd.recv(100) for _ in range(4)]
        running.stop()
    assert told == [b"READY=1", b"WATCHDOG=1", b"WATCHDOG=1", b"WATCHDOG=1"]


def test_the_own_screen_has_the_page_as_it_was_chosen_there_and_nobody_else(fallback):
    folder = fallback.root.folder / "var/lib/tsis"
    english = {"Accept-Language": "en"}
    assert '<html lang="en" data-colours="auto">' in fallback.ask("GET", "/", english).body.decode()
    write_choices(folder, ScreenChoices("de", "dark"))
    assert '<html lang="de" data-colours="dark">' in fallback.ask("GET", "/", english).body.decode()
    assert '<html lang="en" data-colours="dark">' in fallback.ask("GET", "/?language=en").body.decode()
    assert '<html lang="de" data-colours="dark">' in fallback.ask("GET", "/?language=fr&x").body.decode()
    by_proxy = fallback.ask("GET", "/", {**english, "Via": "1.1 proxy"})
    assert '<html lang="en" data-colours="auto">' in by_proxy.body.decode()
    (folder / NAME).write_text("{")
    assert '<html lang="en" data-colours="auto">' in fallback.ask("GET", "/", english).body.decode()
    (folder / NAME).unlink()
