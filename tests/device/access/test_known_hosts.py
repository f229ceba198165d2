"""The names of this machine, and no other's: a name that was made to resolve to it is not one."""

import pytest

from device.access.known_hosts import KnownHosts, is_loopback, split_authority


@pytest.fixture
def hosts(monkeypatch):
    monkeypatch.setattr("socket.gethostname", lambda: "Probe-7.ward.example")
    return KnownHosts.of_machine("0.0.0.0", "Probe.Hospital.example")


@pytest.mark.parametrize(
    "host",
    [
        *("localhost", "LOCALHOST:8000", "localhost.", "127.0.0.1:8000", "[::1]:8000"),
        *("probe-7", "Probe-7.local:8000", "probe-7.ward.example", "probe.hospital.example:443"),
    ],
)
def test_loopback_the_machines_own_name_and_those_of_the_settings_are_known(hosts, host):
    assert hosts.has(host, "127.0.0.1")


@pytest.mark.parametrize(
    "host",
    [
        *("", "evil.example", "127.0.0.1.evil.example", "localhost.evil.example", "evil.local", "0.0.0.0:8000"),
        *("localhost:8000, evil.example", "evil@localhost", "localhost:8000:1", "localhost:x", "[::1", "192.168.1.20"),
    ],
)
def test_no_other_name_is(hosts, host):
    assert not hosts.has(host, "127.0.0.1")


def test_an_address_is_known_on_the_connection_that_came_to_it(hosts):
    """A listener on all networks does not know the machine's addresses; each connection does."""
    assert hosts.has("192.168.1.20:8000", "192.168.1.20")
    assert not hosts.has("192.168.1.21:8000", "192.168.1.20")
    assert not hosts.has("evil.example", "evil.example")


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("Probe:80", ("probe", 80)),
        ("probe", ("probe", None)),
        ("[FE80::1]:9", ("fe80::1", 9)),
        ("a b", ("", None)),
        ("a/b", ("", None)),
    ],
)
def test_a_host_and_its_port_are_told_apart(text, parts):
    assert split_authority(text) == parts


@pytest.mark.parametrize("address", ["127.0.0.1", "127.3.2.1", "::1", "::ffff:127.0.0.1"])
def test_loopback_is_this_machine(address):
    assert is_loopback(address)


@pytest.mark.parametrize("address", [None, "", "localhost.evil.example", "192.168.1.20", "0.0.0.0", "::ffff:10.0.0.1"])
def test_anything_else_may_be_another_machine(address):
    assert not is_loopback(address)
