"""What tsis.service promises, under a real systemd: a start, a kill, frozen loops, a stop, the sandbox.

Runs as root in the container of run.sh; prints one line a claim and exits 1 when one does not hold.
`tests/test_watchdog_restart.py` tells the stories of the watchdog on any machine, with a stand-in for systemd.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from functools import partial
from itertools import takewhile
from pathlib import Path

from claim import Claim
from fallback_stories import fallback_stories
from real_stories import RealService, real_stories
from service import NAME, NotReached, Service, run, until

PYTHON = "/opt/tsis/current/bin/python"
FROZEN = {"camera_stall": "The camera", "i2c_frozen": "The LED chip", "inference_frozen": "The inference"}
WATCHDOG_S = 15.0
TRIES = 3
"""A machine that is busy besides may spoil a press, as a trembling hand does; a sandbox spoils all."""
SHUT_IN = Path("/var/lib/tsis/shut_in.json")


def analysed() -> Iterator[Claim]:
    """The unit and the udev rule as systemd reads them."""
    complaints = run("systemd-analyze", "verify", "--man=no", f"/usr/lib/systemd/system/{NAME}").stderr
    yield Claim("systemd-analyze verify has no complaint", not complaints, complaints)
    lines = run("systemd-analyze", "security", "--no-pager", NAME).stdout.splitlines()
    figure = lines[-1].partition(": ")[2] if lines else "none"
    yield Claim("systemd-analyze security gives less than 2.0", float(figure.split()[0]) < 2.0, figure)
    rules = run("udevadm", "test", "/devices/virtual/mem/null").stderr
    complaints = "\n".join(line for line in rules.splitlines() if "tsis" in line and "Reading rules" not in line)
    yield Claim("udev has no complaint of the rule", "tsis-force.rules" in rules and not complaints, complaints)


def started(service: Service) -> Iterator[Claim]:
    """A start."""
    took_s = service.start()
    yield Claim("systemctl start ends with READY=1", service.shown("ActiveState") == "active", f"{took_s:.1f} s")
    ready_s = until("ready", service.is_ready, 60)
    yield Claim("REST answers", service.ask("device")[0] == 200, f"ready after another {ready_s:.1f} s")
    until("a status text", lambda: service.shown("StatusText") != "", WATCHDOG_S)
    text = service.shown("StatusText")
    yield Claim("the status text is shown", text == "all parts go on", text)
    tsis = run("id", "--user", "tsis").stdout.strip()
    wanted = {"Uid": tsis, "NoNewPrivs": "1", "Seccomp": "2", "CapBnd": "0000000000000000"}
    seen = [{key: status(pid)[key] for key in wanted} for pid in sorted(service.processes())]
    words = "each process is tsis', without new privileges and capabilities, its system calls filtered"
    yield Claim(words, len(seen) > 1 and all(one == wanted for one in seen), f"{len(seen)} processes")


def status(pid: int) -> dict[str, str]:
    """Return the first word of each line of proc(5)'s status of a process."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return {key: (value.split() or [""])[0] for key, _, value in (line.partition(":") for line in lines)}


def killed(service: Service) -> Iterator[Claim]:
    """SIGKILL in a press."""
    service.press_until_lit()
    before = service.processes()
    service.kill()
    dark_s = until("dark", service.is_dark, 20)
    yield Claim("killed while lit, it is dark again", True, f"after {dark_s:.2f} s")
    yield Claim("its processes are gone", not before & service.processes(), f"{len(before)} processes")
    until("ExecStopPost= has ended", lambda: "code=exited" in service.shown("ExecStopPost"), 4)
    ended = service.shown("ExecStopPost").partition("code=")[2].rstrip(" }")
    yield Claim("ExecStopPost= ended well", ended == "exited ; status=0", ended)
    again_s = dark_s + until("active again", lambda: service.shown("ActiveState") == "active", 60)
    until("ready again", service.is_ready, 60)
    yield Claim("it is started again", service.shown("NRestarts") == "1", f"active after {again_s:.1f} s")
    warning = service.faults().get("E903", {})
    yield Claim("E903 on the screen says by what", "signal" in warning.get("cause", ""), warning.get("cause"))


def pressed(service: Service) -> Iterator[Claim]:
    """A press to its result: whatever the sandbox denies to model, fit and store would end it."""
    jobs = (service.press("quick") for _ in range(TRIES))
    reasons = [job["reason"] for job in takewhile(lambda job: job["state"] != "done", jobs)]
    yield Claim("a press of mode quick has its result", len(reasons) < TRIES, "; ".join(reasons))


def frozen(service: Service, kind: str) -> Iterator[Claim]:
    """A loop that freezes in a press."""
    part = FROZEN[kind]
    service.stop()
    service.start(kind)
    since = service.now()
    service.press_until_lit()
    shown_s = until("E901", lambda: "E901" in service.faults(), 4 * WATCHDOG_S)
    was_lit, cause = service.is_lit(), service.faults()["E901"]["cause"]
    yield Claim(f"{kind}: E901 on the screen", cause.startswith(part), f"{cause} ({shown_s:.0f} s after the light)")
    bitten_s = until("bitten", lambda: "Watchdog timeout" in service.log(since), 2 * WATCHDOG_S)
    yield Claim(f"{kind}: systemd says Watchdog timeout", True, f"{bitten_s:.0f} s later")
    dark_s = until("dark", service.is_dark, 20)
    yield Claim(f"{kind}: it is dark", True, f"{dark_s:.2f} s later, {'lit' if was_lit else 'dark'} at E901")
    again_s = until("active again", lambda: service.shown("NRestarts") == "1" and service.is_ready(), 60)
    yield Claim(f"{kind}: it is started again", True, f"ready {again_s:.1f} s later")
    log = service.log(since)
    yield Claim(f"{kind}: the result is 'watchdog'", "Failed with result 'watchdog'" in log)
    yield Claim(f"{kind}: the log says where every thread was", "Fatal Python error: Aborted" in log)
    warning = service.faults().get("E902", {})
    yield Claim(f"{kind}: E902 on the screen", warning.get("severity") == "warning", warning.get("cause"))


def stopped(service: Service) -> Iterator[Claim]:
    """A stop in a press."""
    service.stop()
    service.start()
    service.press_until_lit()
    since = service.now()
    took_s = service.stop()
    is_down = service.shown("ActiveState") == "inactive"
    yield Claim("systemctl stop in a press ends the daemon", is_down, f"{took_s:.1f} s")
    ended = service.shown("Result"), service.shown("ExecMainStatus")
    yield Claim("with exit code 0", ended == ("success", "0"), ", ".join(ended))
    log = service.log(since)
    yield Claim("without SIGKILL", "SIGKILL" not in log and "timed out" not in log)
    yield Claim("dark", service.is_dark())


def shut_in() -> Iterator[Claim]:
    """The sandbox from inside, and as control the same tries of the same user outside of it."""
    Path("/tmp/of_others").touch()
    run("systemctl", "start", "tsis-shut-in.service")
    yield Claim("the state directory is writable (StateDirectory)", SHUT_IN.exists())
    inside = json.loads(SHUT_IN.read_text())
    run("runuser", "--user=tsis", "--", PYTHON, "/src/tests/systemd/shut_in.py", "/tmp/outside.json")
    outside = json.loads(Path("/tmp/outside.json").read_text())
    for words, tried in inside.items():
        wanted, seen, seen_outside = tried["wanted"], tried["seen"], outside[words]["seen"]
        yield Claim(words, seen == wanted != seen_outside, f"{seen}, outside the unit {seen_outside}")


def told(stories: list[Callable[[], Iterator[Claim]]]) -> Iterator[Claim]:
    """Yield the claims of all stories; one that cannot go on is one more that does not hold."""
    for story in stories:
        try:
            yield from story()
        except (NotReached, OSError, ValueError) as error:
            yield Claim("the story goes on", False, error)


def simulated_stories(service: Service) -> list[Callable[[], Iterator[Claim]]]:
    """Return all stories of a simulated probe's service."""
    stories: list[Callable[[], Iterator[Claim]]] = [analysed, shut_in]
    stories += [partial(story, service) for story in (started, pressed, killed)]
    stories += [partial(frozen, service, kind) for kind in FROZEN]
    return [*stories, partial(stopped, service), *fallback_stories(service)]


def main(only: str = "") -> int:
    """Tell all stories, or those of the `simulated` or the `real` probe only; return the exit code."""
    held = []
    chapters = {"simulated": (Service(), simulated_stories), "real": (RealService(), real_stories)}
    for service, stories in [chapters[only]] if only else chapters.values():
        with service.on_its_board():
            for claim in told(stories(service)):
                print(claim)
                held.append(claim.holds)
    print(f"{sum(held)} passed, {len(held) - sum(held)} failed")
    return 0 if all(held) else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
