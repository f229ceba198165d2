"""Loads the web of a probe: requests beside frames, clients that harm, and stops that somebody holds up.

Frames: acquisition of `bench_acquisition`, 60 a second, in the process that serves the API, which another process asks
50 times a second for a minute. Harm: a daemon without its simulation (tests/rig) presses beside connections that never
send, streams that nobody reads, and bodies of 100 MB, while another process asks for its status. Fetched: eight clients
ask for pictures of precise presses beside one. Stops: from SIGTERM until the daemon has ended. All times are the
wall's, so they hold for a machine that does nothing else.
"""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent / "rig"))

import bench_acquisition as acquisition
from bench_daemon import OWN, _family, _memory_mb
from bench_table import Figure
from daemon_process import QUICK_HAND, ROOT, Daemon, wait_for
from hostile_clients import EVENTS, connections, large_bodies
from kept_measurements import keep
from notice_receiver import NoticeReceiver, write_secret
from rig import Rig, build_shim
from served_probe import served_probe
from written_exam import begin, measure

from device.assembly.cell import commissioned
from device.commands.serve import SWITCH_S
from device.config import simulated_config
from device.instrument.press.capture import Capture
from device.instrument.status import StatusBoard
from device.records.store import Store
from device.simulation.hand import VirtualHand

CHAPTER = "web"
REQUESTS_A_SECOND, SECONDS, ALONE_S = 50.0, 60.0, 10.0
PATHS = ("/api/v1/status", "/api/v1/measurements", "/api/v1/exams", "/api/v1/device", "/api/v1/presses?limit=5")
NEVER_SENDING, NEVER_READING, SCREENS = 100, 50, 10
FETCHING, ALONE_PRESSES, LOOK_EVERY_S = 8, 4, 0.05
HARMED_S, STATUS_A_SECOND = 20.0, 20.0
MOST_MS, MOST_MB, STOP_S = 150.0, 30.0, 3.0


def figures() -> Iterator[Figure]:
    """Yield the frames beside requests, what harm does, and how long stops take."""
    sys.setswitchinterval(SWITCH_S)  # as the daemon's
    with TemporaryDirectory(prefix="tsis-") as folder:
        yield from _frames_beside_requests(_made(Path(folder) / "frames"))
        yield from _harmed(_made(Path(folder) / "harmed"))
        yield from _fetched(_made(Path(folder) / "fetched"))
        for name, stopping in STOPS.items():
            seconds = stopping(_made(Path(folder) / name.replace(" ", "-")))
            yield Figure(CHAPTER, f"stop {name}", seconds, "s", bound=STOP_S)


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


@contextmanager
def _asking(url: str, rate: float, seconds: float, *paths: str) -> Iterator[dict[str, Any]]:
    """Ask from another process; what it found is there once the block has ended."""
    command = [sys.executable, str(ROOT / "tests" / "asking_process.py"), url, str(rate), str(seconds), *paths]
    found: dict[str, Any] = {}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        yield found
        assert process.stdout is not None
        found |= json.loads(process.stdout.read())


def _frames_beside_requests(folder: Path) -> Iterator[Figure]:
    config = commissioned(
        replace(
            simulated_config(), camera=replace(simulated_config().camera, frame_rate_hz=acquisition.FRAMES_A_SECOND)
        )
    )
    with served_probe(folder, is_running=False) as probe, ExitStack() as opened:
        for number in range(40):
            keep(probe.procedure.store, number)
        hand = VirtualHand(acquisition.HAND)
        capture = Capture(acquisition._open(opened, config, hand), config, StatusBoard())
        alone = acquisition._run(capture, hand, ALONE_S)
        with _asking(probe.url, REQUESTS_A_SECOND, 1.0, *PATHS):
            pass  # what a first request loads is there
        with _asking(probe.url, REQUESTS_A_SECOND, SECONDS, *PATHS) as found:
            run = acquisition._run(capture, hand, SECONDS)
    for what, frames, bound in ((f"beside {found['asked']} requests", run, 1.0), ("beside none", alone, None)):
        for figure in acquisition._of_run(frames):
            if figure.name.startswith(("share of frames that came", "longest gap")):
                said = replace(figure, chapter=CHAPTER, name=f"{what}: {figure.name}")
                yield replace(said, bound=bound if figure.at_least else None)
    answered = found["answered"] / found["asked"]
    yield Figure(CHAPTER, "requests answered beside frames", answered, "", bound=1.0, at_least=True)
    here = f"median {found['median_ms']:.0f} ms"
    yield Figure(CHAPTER, "slowest answer beside frames", found["slowest_ms"], "ms", here=here)


def _harmed(folder: Path) -> Iterator[Figure]:
    rig = Rig(folder, build_shim(folder), QUICK_HAND)
    try:
        daemon = rig.start()
        rig.world.wish(url=daemon.url)
        assert daemon.press("quick")["state"] == "done"  # what a press loads is there
        family = _family(daemon.process.pid)
        before_mb = _memory_mb(family, OWN)
        with (
            connections(daemon.url, NEVER_SENDING // 2, b""),
            connections(daemon.url, NEVER_SENDING // 2, b"GET /api/v1/st"),
            connections(daemon.url, NEVER_READING, EVENTS),
            large_bodies(daemon.url) as bodies,
            _asking(daemon.url, STATUS_A_SECOND, HARMED_S, "/api/v1/status") as found,
        ):
            jobs, most_mb, until_s = [], before_mb, time.monotonic() + HARMED_S
            while time.monotonic() < until_s:
                jobs.append(daemon.press("quick"))
                most_mb = max(most_mb, _memory_mb(family, OWN))
    finally:
        rig.close()
    failed = [job["reason"] for job in jobs if job["state"] != "done"]
    here = " ".join([f"of {len(jobs)}", *failed])
    done = 1.0 - len(failed) / len(jobs)
    yield Figure(CHAPTER, "presses done beside harm", done, "", bound=1.0, at_least=True, here=here)
    here = f"{len(bodies)} bodies of 100 MB"
    yield Figure(CHAPTER, "slowest other answer beside harm", found["slowest_ms"], "ms", bound=MOST_MS, here=here)
    yield Figure(CHAPTER, "memory that harm takes", most_mb - before_mb, "MB", bound=MOST_MB)


def _fetched(folder: Path) -> Iterator[Figure]:
    """Yield what a precise press beside clients that fetch pictures of others takes more than the largest alone."""
    rig = Rig(folder, build_shim(folder), QUICK_HAND)
    try:
        daemon = rig.start()
        family = _family(daemon.process.pid)
        alone_mb = max(_peak_mb(daemon, family) for _ in range(ALONE_PRESSES))
        kept = [one["id"] for one in daemon.ask("/api/v1/measurements").json["measurements"]]
        has_ended, sizes_kb = threading.Event(), list[float]()

        def fetch(number: int) -> None:
            while not has_ended.is_set():
                answer = daemon.ask(f"/api/v1/measurements/{kept[number % len(kept)]}/image.png")
                assert answer.status == 200
                sizes_kb.append(len(answer.body) / 1e3)

        with ThreadPoolExecutor(FETCHING) as clients:
            fetches = [clients.submit(fetch, number) for number in range(FETCHING)]
            try:
                beside_mb = _peak_mb(daemon, family)
            finally:
                has_ended.set()
            for one in fetches:
                one.result()
    finally:
        rig.close()
    here = f"{len(sizes_kb)} of {sum(sizes_kb) / len(sizes_kb):.0f} kB"
    yield Figure(
        CHAPTER, f"memory that {FETCHING} clients take of a press", beside_mb - alone_mb, "MB", MOST_MB, here=here
    )


def _peak_mb(daemon: Daemon, family: list[int]) -> float:
    """Return the largest memory of a daemon's own during a press in mode precise."""
    with ThreadPoolExecutor(1) as hand:
        pressing, most_mb = hand.submit(daemon.press, "precise"), 0.0
        while not wait((pressing,), LOOK_EVERY_S).done:
            most_mb = max(most_mb, _memory_mb(family, OWN))
    assert pressing.result()["state"] == "done"
    return most_mb


def _stop_s(daemon: Daemon) -> float:
    begun_s = time.monotonic()
    daemon.process.terminate()
    daemon.ended_code()
    return time.monotonic() - begun_s


def _with_streams(folder: Path) -> float:
    daemon = Daemon(folder, QUICK_HAND)
    with ExitStack() as opened:
        for _ in range(SCREENS):
            opened.enter_context(urllib.request.urlopen(daemon.url + "/api/v1/events")).readline()
        return _stop_s(daemon)


def _beside_silent_archive(folder: Path) -> float:
    store = Store(folder / "var")
    exam = begin(store)
    measure(store, exam)
    store.close()
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        daemon = Daemon(folder, f'{QUICK_HAND}[settings.dicom]\narchive_host = "127.0.0.1"\narchive_port = {port}\n')
        sent = daemon.ask(f"/api/v1/exams/{exam['id']}/dicom", "POST", {"by": "Ada"}, headers={"If-Match": '"1"'})
        assert sent.status == 202, sent.body
        with silent.accept()[0]:
            return _stop_s(daemon)


def _beside_silent_address(folder: Path) -> float:
    receiver = NoticeReceiver()
    receiver.is_silent = True
    try:
        secret = write_secret(folder)
        scene = f'{QUICK_HAND}[settings.webhook]\nurl = "{receiver.url}"\nsecret_file = "{secret}"\n'
        daemon = Daemon(folder, scene)
        daemon.ask("/api/v1/exams", "POST", {"kind": "phantom", "operator": "Ada"})
        wait_for(lambda: receiver.asked, bool)
        return _stop_s(daemon)
    finally:
        receiver.close()


STOPS = {
    "with ten streams open": _with_streams,
    "beside an archive that is silent": _beside_silent_archive,
    "beside an address for notices that is silent": _beside_silent_address,
}
