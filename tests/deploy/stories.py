"""From a fresh Debian to a probe, and every kind of release to it, told from the outside: one line a claim.

Run by run.sh as `python -m stories FOLDER`, while the container boots; exits 1 when a claim does not hold.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).parent
sys.path.append(str(HERE.parent / "systemd"))  # by no PYTHONPATH: Python would begin with the units' sitecustomize

from claim import Claim  # noqa: E402
from probe_at_hand import BROWSER, URL, Ended, NotReached, ProbeAtHand, asked, posted, until  # noqa: E402
from releases import ReleaseShop  # noqa: E402

UNITS = "/etc/systemd/system"
MB = 10**6
CODE = re.compile(r"\bE01[0-9]\b")
ENDED = ("done", "rejected", "cancelled", "failed")
BOOT_ID = "cat /proc/sys/kernel/random/boot_id"
TRIES = 3
"""A machine that is busy besides may spoil a press, as a trembling hand does."""


@dataclass
class Stage:
    """What the stories have in common: the workstation, the probe, and release files by what they are."""

    shop: ReleaseShop
    probe: ProbeAtHand
    files: dict[str, Path] = field(default_factory=dict)


def built(stage: Stage) -> Iterator[Claim]:
    """A fresh clone makes release files."""
    shop = stage.shop
    for name, counter in {"older": 999, "first": 1000, "second": 1001, "third": 1003}.items():
        stage.files[name] = shop.built(counter)
    again = stage.files["third"].read_bytes()
    yield Claim(
        "the same commit gives the same bytes", shop.built(1003).read_bytes() == again, f"{len(again) / MB:.0f} MB"
    )
    stage.files["camera"] = shop.built_with_a_dying_camera(1002)
    stage.files["evil"] = shop.built(1003, signed_by=shop.evil_key)


def provisioned(stage: Stage) -> Iterator[Claim]:
    """A fresh system becomes a probe."""
    probe = stage.probe
    until("sshd answers", lambda: probe.inside("true").code == 0, 60)
    probe.put(HERE / "headless.conf", f"{UNITS}/tsis-kiosk.service.d/headless.conf")
    found = probe.provision(stage.files["first"], "--check")
    yield Claim(
        "--check tells what a fresh system lacks", found.code == 1 and "no release is" in found.said, found.last
    )
    yield Claim("and changes nothing", probe.inside("test ! -e /etc/tsis && ! id tsis").code == 0)
    done = probe.provision(stage.files["first"])
    yield Claim(
        "make provision makes it a probe, with no part wired", done.code == 0, f"{done.took_s:.0f} s: {done.last}"
    )
    yield Claim("with a reboot between", "rebooting" in done.said)
    yield Claim("it says what is missing", "its daemon does not start yet: E" in done.said, done.last)
    found = probe.provision(stage.files["first"], "--check")
    yield Claim("and so does --check", found.code == 1 and "lacks      E" in found.said, found.last)
    probe.put(HERE / "simulated.conf", f"{UNITS}/tsis.service.d/simulated.conf")
    probe.root("systemctl daemon-reload && systemctl restart tsis")
    took_s = until("every part works", probe.is_ready, 90)
    yield Claim("once its parts are there every one works", True, f"after {took_s:.1f} s")
    seen = asked(URL + "updates")
    yield Claim("it runs the first release", seen["running"].endswith("+1000"), seen["running"])
    found = probe.provision(stage.files["first"], "--check")
    yield Claim("--check is silent now", found.code == 0 and "differs" not in found.said, f"{found.took_s:.1f} s")
    again = probe.provision(stage.files["first"])
    steps = [line.split()[0] for line in again.said.splitlines() if line.startswith(("do ", "in place"))]
    yield Claim(
        "a second provision finds all in place", again.code == 0 and set(steps) == {"in"}, f"{len(steps)} items"
    )
    other = probe.provision(stage.files["first"], serial="TSIS-0008")
    yield Claim("another serial number is refused", other.code == 1 and "is TSIS-0007" in other.said, other.last)


def shut_in(stage: Stage) -> Iterator[Claim]:
    """Who may do what."""
    probe = stage.probe
    failed = probe.inside("systemctl --failed --no-legend").said.strip()
    yield Claim("no unit has failed", not failed, failed)
    for unit, most in {"tsis.service": 1.5, "tsis-boot.service": 1.5, "tsis-update.service": 2.0}.items():
        lines = probe.root(f"systemd-analyze security --no-pager {unit}").said.splitlines()
        figure = lines[-1].partition(": ")[2].split()[0]
        yield Claim(f"systemd-analyze security gives {unit} no more than {most}", float(figure) <= most, figure)
    tried = probe.inside("id; cat /etc/passwd", user="tsis-deploy")
    yield Claim("who may send releases can do nothing else", "uid=" not in tried.said and tried.code == 1, tried.last)
    tried = probe.inside("true", "pi", "-oPubkeyAuthentication=no", "-oBatchMode=yes")
    yield Claim("no password opens the door", "Permission denied (publickey)" in tried.said, tried.last)
    folder = "/var/lib/tsis-update/incoming"
    tried = probe.inside(f"sudo -u tsis test -w {folder} && ! sudo -u tsis-screen test -w {folder}")
    yield Claim("the daemon may lay a release file ready, the screen may not", tried.code == 0, tried.said)


def shown(stage: Stage) -> Iterator[Claim]:
    """The probe's own screen, on a compositor without a panel."""
    probe = stage.probe
    debugging = 'export CHROMIUM_FLAGS="$CHROMIUM_FLAGS --remote-debugging-port=18091"'
    probe.inside(f"echo '{debugging}' | sudo tee /etc/chromium.d/stories; sudo systemctl restart tsis-kiosk")

    def shows() -> bool:
        return any(page["title"] == "TSIS tactile probe" for page in asked(BROWSER) or [])

    took_s = until("the page is on the screen", shows, 60)
    yield Claim("the browser shows the probe's page", True, f"after {took_s:.1f} s")
    user = probe.inside("ps -C chromium -o user:20= | sort -u").said.split()
    yield Claim("as a user of its own", user == ["tsis-screen"], user)
    probe.root("pkill -KILL -x cage")
    until("the browser is gone", lambda: asked(BROWSER) is None, 20)
    took_s = until("the page is there again", shows, 60)
    yield Claim("a screen that was killed comes back by itself", True, f"after {took_s:.1f} s")
    probe.root("rm /etc/chromium.d/stories; systemctl restart tsis-kiosk")


def pressed(stage: Stage) -> Iterator[Claim]:
    """A press to its result: whatever the units' limits deny to camera, models or store would end it."""
    until("ready for a press", lambda: asked(URL + "health/ready") is not None, 60)
    jobs = []
    while len(jobs) < TRIES and "done" not in jobs:
        path = f"presses/{posted('presses', {'mode': 'quick'})['id']}"
        until("the press has ended", lambda path=path: asked(URL + path)["state"] in ENDED, 120)
        jobs.append(asked(URL + path)["state"])
    yield Claim("a press of mode quick has its result", jobs[-1] == "done", jobs)


def good(stage: Stage) -> Iterator[Claim]:
    """A good release."""
    done = stage.probe.deploy(stage.files["second"])
    yield Claim("make deploy of a good release ends with 0", done.code == 0, f"{done.took_s:.0f} s, {done.last}")
    lines = sum("0.1" in line and "%" in line for line in done.said.splitlines())
    yield Claim("with lines of progress", lines > 5, f"{lines} lines")
    release, _ = stage.probe.running()
    yield Claim("it runs", release.endswith("+1001") and stage.probe.is_ready(), release)
    yield Claim("--check is silent after it", stage.probe.provision(stage.files["second"], "--check").code == 0)


def dying_camera(stage: Stage) -> Iterator[Claim]:
    """A release whose camera loop dies."""
    probe = stage.probe
    done = probe.deploy(stage.files["camera"])
    yield Claim("a release whose camera dies ends with 1", done.code == 1, f"{done.took_s:.0f} s")
    yield Claim("and says so", "camera" in done.said, done.last)
    until("the previous release works", probe.is_ready, 60)
    release, _ = probe.running()
    yield Claim("the previous one runs again", release.endswith("+1001"), release)
    told = [entry for entry in asked(URL + "updates")["history"] if entry["release"].endswith("+1002")]
    reasons = [entry["reason"] for entry in told if entry["event"] == "rolled_back"]
    yield Claim("GET updates has the reason", bool(reasons) and "camera" in reasons[-1], reasons)
    again = probe.deploy(stage.files["camera"])
    yield from refused_claims("the same one again", again, probe.running()[0] == release)


def refused(stage: Stage) -> Iterator[Claim]:
    """What must not be installed: it is refused, and the release that runs is not even restarted."""
    probe, shop, third = stage.probe, stage.shop, stage.files["third"]
    size = third.stat().st_size
    bad = {
        "a signature of an unknown key": stage.files["evil"],
        "a flipped byte in the manifest": shop.damaged(third, "manifest", flip=700),
        "a flipped byte in a wheel": shop.damaged(third, "flipped", flip=size // 2),
        "a file that ends in its first wheel": shop.damaged(third, "cut", keep=3 * MB),
        "a file without its last bytes": shop.damaged(third, "short", keep=size - 20_000),
        "an empty file": shop.damaged(third, "empty", keep=0),
        "an older counter": stage.files["older"],
        "another product": shop.altered(third, "product", product="toaster"),
        "another machine": shop.altered(third, "machine", machine="riscv64"),
        "another major data schema": shop.altered(third, "store", data_schemas={"store": {"writes": 9, "reads": [9]}}),
    }
    before = probe.running()
    for words, file in bad.items():
        yield from refused_claims(words, probe.deploy_unseen(file), probe.running() == before)
    again = probe.deploy(stage.files["second"])
    yield Claim("the release that runs is known as such", again.code == 0 and "already" in again.said, again.last)
    yield Claim("and is not started again", probe.running() == before)
    for words in ("a signature of an unknown key", "a flipped byte in a wheel"):
        done = probe.deploy(bad[words])
        yield Claim(
            f"{words} is not even sent by make deploy", done.code == 1 and "sending" not in done.said, done.last
        )


def by_rest(stage: Stage) -> Iterator[Claim]:
    """The same installer behind the screen's buttons: the daemon itself may only lay the file, or the wish, ready."""
    probe = stage.probe
    before = probe.running()
    posted("updates", stage.files["older"].read_bytes())
    until("it is refused", lambda: (asked(URL + "updates") or {}).get("state") == "refused", 60)
    seen = asked(URL + "updates")
    yield Claim("an older counter by REST: refused with the reason", "counter" in seen["reason"], seen["reason"])
    yield Claim("an older counter by REST: what runs is untouched", probe.running() == before)
    posted("updates/roll-back", {})
    took_s = until("the first release runs", lambda: probe.running()[0].endswith("+1000") and probe.is_ready(), 120)
    yield Claim("the release before comes back when the screen asks for it", True, f"after {took_s:.0f} s")


def full_disk(stage: Stage) -> Iterator[Claim]:
    """No space for the file, and none for what is in it."""
    probe, third = stage.probe, stage.files["third"]
    before = probe.running()
    size_mb = third.stat().st_size // MB
    for words, free_mb in {"no space for the file": size_mb // 2, "no space to unpack it": size_mb + 100}.items():
        probe.fill_disk(free_mb)
        done = probe.deploy(third)
        yield from refused_claims(words, done, probe.running() == before)
        left = probe.root("rm /full; ls -A /var/lib/tsis-update/incoming /opt/tsis/releases | grep -c incoming-").said
        yield Claim(f"{words}: nothing is left of it", left.strip() == "0", left.strip())


def refused_claims(words: str, ended: Ended, is_untouched: bool) -> Iterator[Claim]:
    """The claims of one refusal."""
    yield Claim(f"{words}: refused with the reason", ended.code == 1 and bool(CODE.search(ended.said)), ended.last)
    yield Claim(f"{words}: what runs is untouched", is_untouched)


def in_the_end(stage: Stage) -> Iterator[Claim]:
    """After all that, the right one; and after a reboot."""
    probe = stage.probe
    done = probe.deploy(stage.files["third"])
    yield Claim("the next good release is taken", done.code == 0, f"{done.took_s:.0f} s")
    before = probe.inside(BOOT_ID)
    probe.inside("sudo systemctl reboot")

    def has_rebooted() -> bool:
        seen = probe.inside(BOOT_ID)
        return seen.code == 0 and seen.said != before.said

    until("it has rebooted", has_rebooted, 90)
    took_s = until("it works after a reboot", probe.is_ready, 90)
    release, _ = probe.running()
    yield Claim("it runs after a reboot, too", release.endswith("+1003"), f"{release}, {took_s:.1f} s after sshd")
    kept = probe.root("ls /opt/tsis/releases").said.split()
    yield Claim("two releases are kept", len(kept) == 2, kept)
    failed = probe.inside("systemctl --failed --no-legend").said.strip()
    yield Claim("no unit has failed", not failed, failed)


STORIES: list[Callable[[Stage], Iterator[Claim]]] = [
    built,
    provisioned,
    shut_in,
    shown,
    pressed,
    good,
    dying_camera,
    refused,
    by_rest,
    full_disk,
    in_the_end,
]


def told(stage: Stage) -> Iterator[Claim]:
    """Yield the claims of all stories; one that cannot go on is one more that does not hold."""
    for story in STORIES:
        try:
            yield from story(stage)
        except (NotReached, OSError, LookupError, TypeError, ValueError) as error:
            yield Claim(f"the story {story.__name__} goes on", False, repr(error))


def main() -> int:
    """Tell all stories; return the exit code."""
    folder = Path(sys.argv[1])
    shop = ReleaseShop(folder)
    held = []
    for claim in told(Stage(shop, ProbeAtHand(folder, shop))):
        print(claim, flush=True)
        held.append(claim.holds)
    print(f"{sum(held)} passed, {len(held) - sum(held)} failed")
    return 0 if all(held) else 1


if __name__ == "__main__":
    sys.exit(main())
