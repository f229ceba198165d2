"""`python3 -m device.provisioning`: makes this machine a probe (root), or with --check only tells what differs.

Exit codes: 0 ok, 1 failed or something differs, 2 usage, 4 reboot, then run it again.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from device.files.start_note import read_note
from device.provisioning.identity import is_calibrated
from device.provisioning.installation import FirstReleaseItem
from device.provisioning.item import ProvisioningItem
from device.provisioning.packages import ONLY_RASPBERRY_PI_OS
from device.provisioning.plan import ProvisioningWishes, plan_of
from device.provisioning.target import ProvisioningFailed, TargetMachine

DIFFERS, REBOOT = 1, 4
EXAMPLE = """example:
  PYTHONPATH=tsis-0.2.0-py3-none-any.whl python3 -m device.provisioning --serial TSIS-0007 \\
    --release tsis-0.2.0-bookworm-aarch64.release --signers release_signers --deploy-key id_ed25519.pub
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line; return its exit code."""
    options = _parser().parse_args(arguments)
    target = TargetMachine(options.root)
    try:
        items = plan_of(_wishes(options))
        if options.check:
            return check(items, target)
        if options.root == Path("/") and os.geteuid() != 0:
            raise ProvisioningFailed("Only root can make this machine a probe.", "Run it with sudo, or with --check.")
        return apply(items, target, options.stand_in)
    except (ProvisioningFailed, OSError) as error:
        print(f"FAILED     {error}", file=sys.stderr)
        return DIFFERS


def check(items: Sequence[ProvisioningItem], target: TargetMachine) -> int:
    """Print what differs, one line an item; return the exit code."""
    differences = [f"differs    {item.title}: {words}" for item in items if (words := item.differs(target))]
    differences += [f"lacks      {line}" for line in _missing(target)]
    for line in differences:
        print(line)
    return DIFFERS if differences else 0


def apply(items: Sequence[ProvisioningItem], target: TargetMachine, is_stand_in: bool) -> int:
    """Put right what differs, one line an item; stop before the release when the boot has to come first."""
    if is_stand_in:
        print(f"left out   a stand-in has no {', '.join(ONLY_RASPBERRY_PI_OS)}", flush=True)
    wants_reboot = False
    for item in items:
        if wants_reboot and isinstance(item, FirstReleaseItem):
            print("reboot     I2C and camera are there from the next boot on: reboot, then run this again")
            return REBOOT
        wants_reboot |= put_right(item, target) and item.wants_reboot
    for line in _missing(target):
        print(f"next       its daemon does not start yet: {line}")
    if not is_calibrated(target):
        print("next       this probe has no certificate: its screen says E402 until it is calibrated")
    return 0


def _missing(target: TargetMachine) -> list[str]:
    """Return why the daemon does not start, by its own note, one line a fault."""
    note = read_note(target.root)
    return [f"{fault['code']} {fault['cause']} {fault['remedy']}" for fault in note.faults] if note else []


def put_right(item: ProvisioningItem, target: TargetMachine) -> bool:
    """Apply an item that differs and see that it no longer does; return whether it did."""
    words = item.differs(target)
    if not words:
        print(f"in place   {item.title}", flush=True)
        return False
    print(f"do         {item.title}: {words}", flush=True)
    item.apply(target)
    if words := item.differs(target):
        raise ProvisioningFailed(f"{item.title}: {words}, although it was put right.", "")
    return True


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python3 -m device.provisioning", epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Makes a fresh Raspberry Pi OS a probe; what is in place stays as it is.",
    )  # fmt: skip
    parser.add_argument("--check", action="store_true", help="only tell what differs; exit code 1 when something does")
    parser.add_argument("--serial", default="", metavar="SERIAL", help="the probe's serial number")
    parser.add_argument("--release", default="", metavar="FILE", help="the first release")
    parser.add_argument("--signers", type=Path, metavar="FILE", help="keys whose releases are taken (ALLOWED SIGNERS)")
    parser.add_argument("--deploy-key", type=Path, metavar="FILE", help="public key of who may send releases")
    parser.add_argument("--time-zone", default="", metavar="ZONE", help="as Europe/Berlin; as it is unless given")
    parser.add_argument("--time-servers", default="", metavar="NAMES", help="apart by a space; as it is unless given")
    parser.add_argument("--camera-overlay", default="", metavar="NAME", help="the sensor's (as it is, else ov9281)")
    parser.add_argument("--stand-in", action="store_true", help="a machine that is no Pi, for tests")
    parser.add_argument("--root", type=Path, default=Path("/"), metavar="DIR", help="the machine's / (default: /)")
    return parser


def _wishes(options: argparse.Namespace) -> ProvisioningWishes:
    return ProvisioningWishes(
        serial=options.serial,
        release=options.release,
        signers=options.signers.read_text(encoding="utf-8") if options.signers else "",
        deploy_key=options.deploy_key.read_text(encoding="utf-8").strip() if options.deploy_key else "",
        time_zone=options.time_zone,
        time_servers=options.time_servers,
        camera_overlay=options.camera_overlay,
        is_stand_in=options.stand_in,
    )


if __name__ == "__main__":
    sys.exit(main())
