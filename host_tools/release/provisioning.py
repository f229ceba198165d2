"""`make provision`: a machine with nothing but a fresh Raspberry Pi OS and an ssh key becomes a probe.

Our wheel is taken out of the release file and runs there, by Python's own import from a zip file, as root.
"""

from __future__ import annotations

import shlex
import tarfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

from device.measurement.quantities import InvalidQuantity
from host_tools.release.release_file import checked_manifest
from host_tools.release.remote_machine import BOOT_ID, NotReachable, RemoteMachine

REBOOT = 4
"""Exit code of `python -m device.provisioning`."""
BACK_WITHIN_S = 300.0
OWN_WHEEL = "wheels/tsis-*.whl"
SUDOERS = "/etc/sudoers.d/tsis-provision"
SIGNERS_NAME, KEY_NAME = "release_signers", "deploy_key.pub"


@dataclass(frozen=True)
class ProvisioningOrder:
    """What a machine becomes: with which release file, trusting whom, whose key may send the next one.

    `options` go to `python -m device.provisioning` as they are, `--check` among them.
    """

    release: Path
    signers: Path
    deploy_key: Path | None
    options: tuple[str, ...]

    @property
    def only_checks(self) -> bool:
        """Return whether nothing is to be changed."""
        return "--check" in self.options


def provision_machine(order: ProvisioningOrder, machine: RemoteMachine, told: Callable[[str], None]) -> int:
    """Make the machine a probe, with the reboot that its boot settings may need; return the exit code.

    Raises `InvalidQuantity` for a release file that is not signed or not whole, `NotReachable`, also
    where the user may not become root there without a password.
    """
    checked_manifest(order.release, order.signers.read_text(encoding="utf-8"))
    _require_rights(machine)
    with _folder_on(machine) as folder, TemporaryDirectory() as here:
        wheel = own_wheel(order.release, Path(here))
        sent = [wheel, *_beside(order, Path(here))]
        for file in sent:
            told(f"sending {file.name}, {file.stat().st_size / 1e6:.1f} MB")
            machine.send(file, f"{folder}/{file.name}")
        command = provisioning_command(order, folder, wheel.name, machine.user)
        code = machine.run(command, told=told)
        if code == REBOOT:
            _reboot(machine, told)
            code = machine.run(command, told=told)
        return code


def _require_rights(machine: RemoteMachine) -> None:
    """Ask, before anything is sent, whether the user may become root: nobody is there who could type a password."""
    if machine.user == "root" or machine.run("sudo", "-n", "true", told=lambda line: None) == 0:
        return
    raise NotReachable(
        f"{machine} needs sudo without a password while it is provisioned. Log in there and run: "
        f"echo '{machine.user} ALL=(ALL) NOPASSWD: ALL' | sudo tee {SUDOERS}; then run this again. Remove the file "
        "when the probe is made: deploys do not need it."
    )


def provisioning_command(order: ProvisioningOrder, folder: str, wheel: str, user: str) -> str:
    """Return the command that makes a machine a probe, as its shell reads it."""
    words = [*([] if user == "root" else ["sudo", "-n"]), "env", f"PYTHONPATH={folder}/{wheel}", "python3"]
    words += ["-m", "device.provisioning", "--signers", f"{folder}/{SIGNERS_NAME}", *order.options]
    if not order.only_checks:
        words += ["--release", f"{folder}/{order.release.name}"]
    if order.deploy_key:
        words += ["--deploy-key", f"{folder}/{KEY_NAME}"]
    return shlex.join(words)


def own_wheel(release: Path, into: Path) -> Path:
    """Take our wheel out of a release file; raise `InvalidQuantity` when it holds none."""
    with tarfile.open(release, "r:") as archive:
        for member in archive:
            if PurePosixPath(member.name).match(OWN_WHEEL) and (content := archive.extractfile(member)):
                path = into / PurePosixPath(member.name).name
                path.write_bytes(content.read())
                return path
    raise InvalidQuantity("file", release, "a release file with our own wheel", "build one with `make bundle`")


def _beside(order: ProvisioningOrder, here: Path) -> Iterator[Path]:
    """Yield what is sent beside the wheel, under the names that the command has for it."""
    named = {SIGNERS_NAME: order.signers, **({KEY_NAME: order.deploy_key} if order.deploy_key else {})}
    for name, path in named.items():
        (here / name).write_bytes(path.read_bytes())
        yield here / name
    if not order.only_checks:
        yield order.release


@contextmanager
def _folder_on(machine: RemoteMachine) -> Iterator[str]:
    """Yield a new folder in the user's home, which a reboot does not empty; remove it afterwards."""
    folder = machine.answer('mktemp -d "$HOME/tsis-provision.XXXXXX"')
    try:
        yield folder
    finally:
        with suppress(NotReachable):  # whatever has happened is told, and the folder hurts nobody
            machine.answer(f"rm -r {shlex.quote(folder)}")


def _reboot(machine: RemoteMachine, told: Callable[[str], None]) -> None:
    before = machine.answer("cat", BOOT_ID)
    told("rebooting")
    with suppress(NotReachable):  # it may hang up before it says good-bye
        machine.run("systemctl reboot" if machine.user == "root" else "sudo -n systemctl reboot", told=told)
    machine.wait_for_reboot(before, BACK_WITHIN_S)
