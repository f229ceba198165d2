"""What the settings files plainly say, for programs that have no package of the daemon."""

from pathlib import Path
from typing import get_type_hints

import pytest

from device.config import StoreSection
from device.files.plain_settings import (
    DATA,
    HOST,
    MIN_FREE_BOUND_MB,
    MIN_FREE_MB,
    PORT,
    DaemonAddress,
    daemon_address,
    data_folder,
    layer_files,
    least_free_mb,
    plain_settings,
)
from device.settings.layers import read_layers


def say(root: Path, name: str, text: str) -> None:
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def test_what_holds_without_a_file_is_what_the_daemon_takes(tmp_path: Path):
    config = read_layers(layer_files(tmp_path)).config()
    assert (config.server.host, config.server.port, config.data) == (HOST, PORT, Path(DATA))
    assert daemon_address(tmp_path) == DaemonAddress(PORT, HOST)
    assert data_folder(tmp_path) == tmp_path / "var/lib/tsis"
    bound = get_type_hints(StoreSection, include_extras=True)["min_free_mb"].__metadata__[0]
    assert (bound.low, bound.high) == MIN_FREE_BOUND_MB
    assert least_free_mb(tmp_path) == config.store.min_free_mb == MIN_FREE_MB


def test_a_later_file_goes_over_those_before_it_as_the_daemon_reads_them(tmp_path: Path):
    say(tmp_path, "usr/lib/tsis/config.toml", '[server]\nhost = "10.0.0.1"\nport = 8001\n')
    say(tmp_path, "etc/tsis/config.toml", 'serial = "P-1"\n[server]\nport = 8002\n')
    say(tmp_path, "etc/tsis/config.d/20-port.toml", "[server]\nport = 8003\n")
    say(tmp_path, "etc/tsis/config.d/.30-port.toml", "[server]\nport = 8004\n")
    assert plain_settings(tmp_path) == {"serial": "P-1", "server": {"host": "10.0.0.1", "port": 8003}}
    config = read_layers(layer_files(tmp_path)).config()
    assert daemon_address(tmp_path) == DaemonAddress(config.server.port, config.server.host)


@pytest.mark.parametrize("broken", ["no = [toml", "server = 3\n", '[server]\nport = "many"\nhost = ""\n', "\x00"])
def test_what_cannot_be_used_is_passed_over(tmp_path: Path, broken: str):
    say(tmp_path, "usr/lib/tsis/config.toml", "[server]\nport = 0\n")
    say(tmp_path, "etc/tsis/config.toml", broken)
    assert daemon_address(tmp_path) == DaemonAddress(PORT, HOST)


def test_the_data_folder_lies_below_the_root(tmp_path: Path):
    say(tmp_path, "etc/tsis/config.toml", 'data = "/srv/tsis"\n')
    assert data_folder(tmp_path) == tmp_path / "srv/tsis"


@pytest.mark.parametrize(
    ("stated", "holds"), [("200", 200.0), ("0.5", MIN_FREE_MB), ("nan", MIN_FREE_MB), ("true", MIN_FREE_MB)]
)
def test_the_space_that_a_press_needs_is_the_stated_one_where_it_can_be_used(tmp_path: Path, stated: str, holds: float):
    say(tmp_path, "etc/tsis/config.toml", f"[store]\nmin_free_mb = {stated}\n")
    assert least_free_mb(tmp_path) == holds
