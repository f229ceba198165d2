"""Where the daemon would be, from settings that may be why it is not there."""

import pytest

from device.fallback.address import ServedAddress, read_address


@pytest.fixture
def write(tmp_path):
    def writing(name, text):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else text.encode())

    return writing


def test_without_settings_it_is_the_daemons_default(tmp_path):
    assert read_address(tmp_path) == ServedAddress("127.0.0.1", 8000)


def test_later_files_lie_over_earlier_ones(tmp_path, write):
    write("usr/lib/tsis/config.toml", 'serial = "A"\n[server]\nport = 1000\nhost = "0.0.0.0"\n')
    write("etc/tsis/config.toml", '[server]\nport = 2000\nhosts = ["probe.ward", 3]\n')
    write("etc/tsis/config.d/10.toml", 'serial = "B"\n')
    write("etc/tsis/config.d/.hidden.toml", 'serial = "C"\n')
    assert read_address(tmp_path) == ServedAddress("0.0.0.0", 2000, ("probe.ward",), "B")


@pytest.mark.parametrize(
    "bad",
    [
        "[server\n",
        b"\xff\xfe",
        "server = 3\nserial = 7\n",
        '[server]\nport = "x"\nhost = 3\nhosts = 4\n',
        "[server]\nport = 0\n",
        "[server]\nport = 65536\n",
        '[server]\nport = true\nhost = ""\n',
    ],
)
def test_what_cannot_be_used_is_passed_over(tmp_path, write, bad):
    write("etc/tsis/config.toml", bad)
    assert read_address(tmp_path) == ServedAddress("127.0.0.1", 8000)


def test_a_probe_that_serves_the_network_says_its_name_and_addresses(monkeypatch):
    monkeypatch.setattr("socket.gethostname", lambda: "probe-7.ward.example")
    monkeypatch.setattr("device.fallback.address.own_addresses", lambda: ["192.168.1.20"])
    assert ServedAddress("0.0.0.0", 80).ways == ["http://probe-7.local:80/", "http://192.168.1.20:80/"]
    assert ServedAddress("127.0.0.1", 8000).ways == ["http://127.0.0.1:8000/"]


def test_the_setting_of_more_names_is_known_to_it():
    assert ServedAddress(hosts=("probe.ward",)).known_hosts.has("probe.ward:8000", "127.0.0.1")
