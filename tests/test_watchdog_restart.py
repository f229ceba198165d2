"""Each loop frozen in turn, in the middle of a press: a fault on the screen, a restart, and darkness.

The daemon is its own process under a stand-in for systemd; the stories run at once, each in a folder of its own.
A camera's process that hangs is not one of them: it is ended and started again by the daemon itself.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from daemon_process import QUICK_HAND
from supervisor import DARK_WITHIN_S, Supervisor, codes, faults

from device.instrument.watch.progress import PARTS, Part

pytestmark = [pytest.mark.long, pytest.mark.real_time]
WATCHDOG_S = 6.0
FAULTS = {
    "camera": ("camera_stall", "the camera"),
    "light": ("i2c_frozen", "the LED chip"),
    "force": ("cell_frozen", "the load cell"),
    "inference": ("inference_frozen", "the inference"),
    "storage": ("disk_frozen", "the disk"),
}
SPARING = "[settings.camera]\nframe_rate_hz = 10.0\nlate_frames = 100.0\n"
"""Five daemons at once keep each other waiting: a third of the frames, and no press that ends since they are late."""
DARK = (0.0, 0.0, 0.0, 0.0)
LIT = ("light", "inference", "storage")
"""The parts in which the procedure's loop freezes with the light on."""


@dataclass
class Story:
    """What became of a daemon of which one part froze."""

    fault: dict[str, Any]
    health: int
    exit_code: int
    light_at_the_kill: tuple[float, ...]
    light_after: tuple[float, ...]
    darkening_cpu_s: float
    shown_after_restart: list[dict[str, Any]]
    is_well_again: bool
    log: str


def test_each_part_that_is_watched_is_frozen():
    assert set(FAULTS) == set(PARTS)


def story_of(folder: Path, part: Part) -> Story:
    """Return the story of a part that freezes; on a busy machine a press may not be lit yet then: told again, later."""
    for from_s in (1.0, 2.0, 4.0):
        story = told(folder / f"{part}_{from_s:g}", FAULTS[part][0], from_s)
        if part not in LIT or min(story.light_at_the_kill) > 0.5:
            break
    return story


def told(folder: Path, kind: str, from_s: float) -> Story:
    folder.mkdir()
    scene = f'{QUICK_HAND}{SPARING}[[faults]]\nkind = "{kind}"\nfrom_press = 1\nfrom_s = {from_s}\n'
    supervisor = Supervisor(folder, scene, WATCHDOG_S)
    try:
        daemon = supervisor.start()
        assert supervisor.is_fed_until(lambda daemon: daemon.ask("/api/v1/health/ready").status == 200)
        daemon.ask("/api/v1/presses", "POST", {})
        assert supervisor.is_fed_until(lambda daemon: "E901" in codes(daemon)), "killed without a word"
        fault = next(one for one in faults(daemon) if one["code"] == "E901")
        health = daemon.ask("/api/v1/health/ready").status
        exit_code = supervisor.kill_when_not_fed()
        light_at_the_kill = supervisor.chip.led_ratio()
        stop_code, darkening_cpu_s = supervisor.stop_post()
        assert stop_code == 0
        light_after = supervisor.chip.led_ratio()
        again = supervisor.start()
        shown = faults(again)
        is_well = supervisor.is_fed_until(lambda daemon: daemon.ask("/api/v1/health/ready").status == 200)
        log = (folder / "log.txt").read_text()
        light = light_at_the_kill, light_after
        return Story(fault, health, exit_code, *light, darkening_cpu_s, shown, is_well, log)
    finally:
        supervisor.close()


@pytest.fixture(scope="module")
def stories(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Future[Story]]]:
    folder = tmp_path_factory.mktemp("frozen")
    with ThreadPoolExecutor(len(FAULTS)) as pool:
        yield {part: pool.submit(story_of, folder, part) for part in FAULTS}


@pytest.mark.parametrize("part", FAULTS)
def test_a_frozen_loop_is_a_fault_on_the_screen_then_a_restart_that_says_why(stories, part):
    story, words = stories[part].result(), FAULTS[part][1]
    assert story.fault["cause"].startswith(f"{words[0].upper()}{words[1:]} made no progress for ")
    assert story.fault["remedy"] == "Wait: the probe restarts."
    assert story.health == 503
    assert story.exit_code == -signal.SIGABRT
    shown = {one["code"]: one for one in story.shown_after_restart}
    assert shown.keys() <= {"E902", "E904"}, "beside it only that the press under way was broken off"
    warning = shown["E902"]
    assert (warning["code"], warning["severity"]) == ("E902", "warning")
    assert warning["cause"].startswith(f"Restarted by the watchdog: {words} made no progress for ")
    assert story.is_well_again


@pytest.mark.parametrize("part", FAULTS)
def test_after_the_restart_of_a_frozen_loop_it_is_dark(stories, part):
    """A loop that froze in the LED chip, in the inference or in the disk cannot darken the press it was in."""
    story = stories[part].result()
    assert story.light_after == DARK
    assert story.darkening_cpu_s < DARK_WITHIN_S  # why not the time on the wall: tests/device/commands/test_led_off.py
    if part in LIT:
        assert min(story.light_at_the_kill) > 0.5, story.log


@pytest.mark.parametrize("part", FAULTS)
def test_the_log_names_the_fault_and_where_every_thread_was(stories, part):
    log = stories[part].result().log
    assert "E901" in log
    assert "Fatal Python error: Aborted" in log
    assert "Thread 0x" in log


def test_a_camera_whose_process_hangs_is_started_again_without_a_restart_of_the_daemon(tmp_path):
    """It hangs for longer than the watchdog would bear of a camera without frames: twice 6 s."""
    scene = f'{QUICK_HAND}[[faults]]\nkind = "camera_hung"\nfrom_press = 1\nfrom_s = 1.0\nuntil_s = 14.0\n'
    supervisor = Supervisor(tmp_path, scene, WATCHDOG_S)
    try:
        daemon = supervisor.start()
        assert supervisor.is_fed_until(lambda daemon: daemon.ask("/api/v1/health/ready").status == 200)
        daemon.ask("/api/v1/presses", "POST", {})
        assert supervisor.is_fed_until(lambda daemon: "E104" in codes(daemon))
        assert supervisor.is_fed_until(lambda daemon: daemon.ask("/api/v1/health/ready").status == 200)
        assert codes(daemon) == set()
    finally:
        supervisor.close()
