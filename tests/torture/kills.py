"""Kill the whole daemon -9 at random moments of presses, 200 times: nothing acknowledged is lost, doubled or altered.

`make torture [KILLS=200]`. The daemon is the simulated probe with all its processes, spoken to over HTTP. What a client
was told is the truth: that a press is accepted (202), that it is done, its measurement, the bytes of its recording.
Half of the kills come anywhere in a press, half of them while its result is computed and kept. After each one the
daemon is started again and asked for all of it; the key of the request is sent once more and must give the same answer.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import signal
import sys
import tempfile
import threading
import time
from http.client import HTTPException
from pathlib import Path
from typing import Any

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS.parent)]
from daemon_process import QUICK_HAND, Answer, Daemon  # noqa: E402

API = "/api/v1"
ENDED = ("done", "rejected", "cancelled", "failed")
GONE = (OSError, HTTPException, ValueError)
"""What a client meets whose daemon is killed while it answers; half an answer is none."""
LATELY = 10
"""So many of the newest measurements are compared after each kill, and all of them at the end."""
PRESS_S, KEPT_WITHIN_S = 4.0, 0.6
"""About how long a press takes, and how long its result is computed and kept."""


class Told:
    """What clients were told, and what is wrong with it."""

    def __init__(self) -> None:
        self.accepted: dict[str, str] = {}
        self.done: dict[str, dict[str, Any]] = {}
        self.hashes: dict[str, str] = {}
        self.problems: list[str] = []

    def compare(self, daemon: Daemon, newest: int | None = None) -> None:
        """Ask for what was told, all of it or the newest, and note what is lost, doubled or altered."""
        for press_id in list(self.accepted)[-newest if newest else 0 :]:
            job = self._json(daemon.ask(f"{API}/presses/{press_id}"))
            if job.get("state") not in ENDED:
                self.problems.append(f"the press {press_id} was accepted, and is now {job}")
            known = self.done.get(press_id)
            if known and job.get("measurement_id") != known["id"]:
                self.problems.append(f"the press {press_id} was done with {known['id']}, and is now {job}")
        for measurement in list(self.done.values())[-newest if newest else 0 :]:
            self._compare_one(daemon, measurement)
        self._require_none_twice(daemon)

    def _compare_one(self, daemon: Daemon, known: dict[str, Any]) -> None:
        one = f"{API}/measurements/{known['id']}"
        if (found := self._json(daemon.ask(one))) != known:
            self.problems.append(f"the measurement {known['id']} is altered or lost: {found}")
        recording = daemon.ask(f"{one}/recording.zip")
        own = hashlib.sha256(recording.body).hexdigest()
        if recording.status != 200 or own != self.hashes.get(known["id"], own):
            self.problems.append(f"the recording of {known['id']} is altered or lost: {recording.status}")

    def _require_none_twice(self, daemon: Daemon) -> None:
        listed = self._json(daemon.ask(f"{API}/measurements?limit=100"))["measurements"]
        for name in ("id", "seq", "recording_id"):
            values = [one[name] for one in listed]
            if len(values) != len(set(values)):
                self.problems.append(f"a measurement is there twice: {values}")

    def _json(self, answer: Answer) -> dict[str, Any]:
        found: dict[str, Any] = answer.json
        return found


class Kills:
    """A daemon that is killed again and again on one data folder."""

    program: tuple[str, ...] = ("-m", "device")

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder, self.random, self.told = folder, random.Random(seed), Told()
        self.count, self.seen_states = 0, dict[str, int]()
        self._ending = threading.Event()
        self.daemon = self._start()

    def _start(self) -> Daemon:
        return Daemon(self.folder, QUICK_HAND, program=self.program, own_group=True)

    def _kill(self) -> None:
        os.killpg(self.daemon.process.pid, signal.SIGKILL)
        self.daemon.ended_code()

    def one(self) -> None:
        """Press until the kill comes; start again, and compare."""
        self.count += 1
        killer = threading.Thread(target=self._kill_at_random)
        late = self.random.random() < 0.5
        self._computing, self._late = threading.Event(), late
        self._ending.clear()
        killer.start()
        answer = self._press_until_killed()
        killer.join()
        self.daemon = self._start()
        if answer:
            self._send_again(answer)
        self.told.compare(self.daemon, None if self.count % 25 == 0 else LATELY)

    def _kill_at_random(self) -> None:
        if self._late:
            self._computing.wait(timeout=3 * PRESS_S)
            time.sleep(self.random.uniform(0.0, KEPT_WITHIN_S))
        else:
            time.sleep(self.random.uniform(0.0, 1.3 * PRESS_S))
        self._ending.set()
        self._kill()

    def _press_until_killed(self) -> Answer | None:
        """Press again and again; return what the last request was answered with, if it was."""
        accepted: Answer | None = None
        state, n = "none", 0
        try:
            while True:
                accepted, n = None, n + 1
                key = {"Idempotency-Key": f"k-{self.count}-{n}"}
                answer = self.daemon.ask(f"{API}/presses", "POST", {"mode": "quick"}, headers=key)
                if answer.status != 202 and self._ending.is_set():
                    return None  # its disk is gone already
                if answer.status != 202:
                    self.told.problems.append(f"a press was refused: {answer.body!r}")
                    return None
                accepted = answer
                self.told.accepted[answer.json["id"]] = key["Idempotency-Key"]
                state = self._follow(answer.headers["location"])
        except GONE:
            self.seen_states[state] = self.seen_states.get(state, 0) + 1
            return accepted

    def _follow(self, location: str) -> str:
        while (job := self._read(location))["state"] not in ENDED:
            if job["state"] == "computing":
                self._computing.set()
            time.sleep(0.01)
        if job["state"] == "done":
            measurement = self._read(f"{API}/measurements/{job['measurement_id']}")
            self.told.done[job["id"]] = measurement
            recording = self.daemon.ask(f"{API}/measurements/{job['measurement_id']}/recording.zip")
            if recording.status == 200:
                self.told.hashes[measurement["id"]] = hashlib.sha256(recording.body).hexdigest()
        return str(job["state"])

    def _read(self, location: str) -> dict[str, Any]:
        answer = self.daemon.ask(location)
        if answer.status == 200:
            record: dict[str, Any] = answer.json
            return record
        if not self._ending.is_set():
            self.told.problems.append(f"what was accepted or done is answered so: {answer.body!r}")
        raise ValueError("it is ending")

    def _send_again(self, first: Answer) -> None:
        """Send the request of the killed press once more: it was obeyed, and is not obeyed again."""
        key = {"Idempotency-Key": self.told.accepted[first.json["id"]]}
        again = self.daemon.ask(f"{API}/presses", "POST", {"mode": "quick"}, headers=key)
        if (again.status, again.body) != (first.status, first.body):
            self.told.problems.append(f"the same request was answered anew: {first.body!r}, {again.body!r}")

    def end(self) -> None:
        """Compare all of it once more, and stop."""
        self.told.compare(self.daemon)
        self.daemon.stop()


def killed(folder: Path, kills: int, seed: int) -> Kills:
    """Return what was found after so many kills."""
    story = Kills(folder, seed)
    for number in range(1, kills + 1):
        story.one()
        told = story.told
        print(
            f"kill {number}: {len(told.accepted)} presses accepted, {len(told.done)} measurements told, "
            f"{len(told.problems)} problems",
            flush=True,
        )
    story.end()
    return story


def main() -> int:
    """Kill as often as asked; return 0 when nothing that was told is lost, doubled or altered."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        story = killed(Path(folder), options.kills, options.seed)
        log = story.daemon.log_text()
    told = story.told
    print("\n".join(told.problems))
    print(f"{options.kills} kills: {len(told.accepted)} presses accepted, {len(told.done)} measurements told")
    print(f"set aside after a kill: {log.count('belongs to no measurement')} recordings")
    print(f"lost, doubled or altered: {len(told.problems)}")
    return 1 if told.problems or not told.done else 0


if __name__ == "__main__":
    sys.exit(main())
