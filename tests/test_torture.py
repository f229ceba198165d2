"""A short `make torture`: six kills of the whole daemon, and some power cuts where this machine can cut it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from cut_disk import can_cut
from daemon_process import ROOT

sys.path.append(str(ROOT / "tests" / "torture"))
from cuts import cut_often
from daemon_cuts import cut
from kills import killed

pytestmark = [pytest.mark.real_time, pytest.mark.long]
KILLS, CUTS = 6, 5


def test_no_kill_of_the_daemon_loses_doubles_or_alters_what_clients_were_told(tmp_path: Path) -> None:
    told = killed(tmp_path, KILLS, seed=3).told
    assert told.problems == []
    assert len(told.accepted) >= KILLS
    assert told.done


needs_cut_disk = pytest.mark.skipif(not can_cut(), reason="root, loop devices and ext4 are needed to cut the power")


@needs_cut_disk
def test_no_power_cut_of_the_daemon_loses_what_clients_were_told_and_without_synchronising_one_does() -> None:
    told = cut(CUTS, 3, synchronises=True).told
    assert told.problems == []
    assert told.done
    assert cut(4 * CUTS, 3, synchronises=False).told.problems


@needs_cut_disk
def test_no_power_cut_loses_what_was_acknowledged_and_without_synchronising_one_does() -> None:
    story = cut_often(CUTS, 3, synchronises=True)
    assert story.problems == []
    assert len(story.kept) >= CUTS
    assert cut_often(4 * CUTS, 3, synchronises=False).problems
