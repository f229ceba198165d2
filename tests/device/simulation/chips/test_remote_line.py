"""The emulated GPIO line: one process has it, and it falls when that lets it go."""

from __future__ import annotations

import errno

import pytest
from daemon_process import wait_for

from device.simulation.chips.remote_line import LineServer, RemoteLine


@pytest.fixture
def levels():
    return []


@pytest.fixture
def server(levels):
    made = LineServer(levels.append)
    yield made
    made.close()


def test_a_line_is_low_at_first_follows_its_owner_and_falls_with_it(server, levels):
    assert levels == [False]
    line = RemoteLine(server.address)
    line.switch(True)
    assert levels == [False, True]
    line.switch(False)
    wait_for(lambda: levels, lambda seen: seen == [False, True, False])
    line.switch(True)
    line.close()
    wait_for(lambda: levels[-2:], lambda seen: seen == [True, False])


def test_a_second_owner_is_refused_as_by_the_kernel_until_the_first_has_gone(server):
    line = RemoteLine(server.address)
    with pytest.raises(OSError, match="busy") as refusal:
        RemoteLine(server.address)
    assert refusal.value.errno == errno.EBUSY
    line.close()
    RemoteLine(server.address).close()
