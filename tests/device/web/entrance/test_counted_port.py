"""A port that other machines cannot fill: real connections, from addresses that a test says they have."""

import asyncio
import socket
import ssl
from contextlib import ExitStack, closing

import pytest

from device.access.certificate import own_certificate
from device.web.entrance import counted_port
from device.web.entrance.counted_port import CountedPort, ServerLoop


class Elsewhere(socket.socket):
    """A listening socket whose connections come from the address that a test says."""

    machine = "192.0.2.1"

    def accept(self):
        taken, _ = super().accept()
        return taken, (self.machine, 9)


class CountedElsewhere(CountedPort, Elsewhere):
    """The port, asked by other machines."""


@pytest.fixture
def port():
    listening = CountedElsewhere(socket.create_server(("127.0.0.1", 0), backlog=512))
    listening.settimeout(10.0)
    with closing(listening):
        yield listening


@pytest.fixture
def connections():
    with ExitStack() as opened:
        yield opened


def take(port, connections, machine, count=1):
    """Return the connections that are taken of so many of a machine's."""
    port.machine, taken = machine, []
    for _ in range(count):
        connections.enter_context(socket.create_connection(port.getsockname()))
        try:
            taken.append(connections.enter_context(port.accept()[0]))
        except BlockingIOError:
            continue
    return taken


def test_a_machine_has_some_connections_and_one_more_once_it_lets_one_go(port, connections):
    taken = take(port, connections, "192.0.2.1", 40)
    assert len(taken) == counted_port.MOST_OF_ONE
    assert len(take(port, connections, "192.0.2.2", 2)) == 2
    taken[0].close()
    taken[0].close()
    assert len(take(port, connections, "192.0.2.1", 2)) == 1


def test_all_other_machines_have_a_bound_and_the_own_screen_always_gets_in(port, connections):
    each = [take(port, connections, f"192.0.2.{number}", 30) for number in range(6)]
    assert sum(map(len, each)) == counted_port.MOST_IN_ALL
    assert len(take(port, connections, "127.0.0.1", 50)) == 50


def test_what_was_let_go_leaves_no_trace_of_its_machine(port, connections):
    for number in range(20):
        [taken] = take(port, connections, f"198.51.100.{number}")
        taken.close()
    assert not port.open


def test_one_too_many_is_closed_at_once(port, connections):
    take(port, connections, "192.0.2.1", counted_port.MOST_OF_ONE)
    line = connections.enter_context(socket.create_connection(port.getsockname()))
    with pytest.raises(BlockingIOError, match="one connection too many"):
        port.accept()
    line.settimeout(10.0)
    assert line.recv(1) == b""


def test_a_handshake_that_does_not_go_on_is_ended_and_its_connection_counts_no_more(tmp_path, monkeypatch):
    monkeypatch.setattr(counted_port, "HANDSHAKE_S", 0.2)
    own = own_certificate(tmp_path, ["localhost"])
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(own.certificate, own.key)
    listening = CountedElsewhere(socket.create_server(("127.0.0.1", 0)))

    async def silent():
        server = await asyncio.get_running_loop().create_server(asyncio.Protocol, sock=listening, ssl=context)
        reader, writer = await asyncio.open_connection(*listening.getsockname())
        assert await reader.read() == b""  # it is told by the connection's end
        writer.close()
        server.close()

    with asyncio.Runner(loop_factory=ServerLoop) as runner:
        runner.run(asyncio.wait_for(silent(), 30.0))
    assert not listening.open
