"""`host_tools release`, `deploy` and `provision`: keys, the release file, and how it gets onto a probe by ssh."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from device.measurement.quantities import InvalidQuantity
from host_tools.commands.output import note, source_tree

KEYS = Path("~/.config/tsis").expanduser()
KEY, SIGNERS = KEYS / "release_key", KEYS / "release_signers"
KEPT = Path("build", "wheels")
MB = 1e6
File = Annotated[Path, typer.Argument(help="Release file.", exists=True, dir_okay=False)]
Host = Annotated[str, typer.Option(help="Name or address of the probe.")]
Ssh = Annotated[str, typer.Option(help='Options of ssh, as "-p 18022 -i key".')]
Signers = Annotated[Path, typer.Option(help="List of signers: whom to trust.", exists=True, dir_okay=False)]
release = typer.Typer(no_args_is_help=True, help="Release files, which a probe installs: keys, build, show.")


@release.command(epilog="Example: host_tools release build --machine aarch64 --out dist")
def build(
    machine: Annotated[str, typer.Option(help="aarch64, or x86_64 for a simulated probe.")] = "aarch64",
    system: Annotated[
        str, typer.Option(help="Debian of the probe's Raspberry Pi OS: bookworm or trixie.")
    ] = "bookworm",
    key: Annotated[Path, typer.Option(help="File of the private key; the public one if an agent holds it.")] = KEY,
    out: Annotated[Path, typer.Option(help="Folder of the release file.")] = Path("dist"),
    counter: Annotated[
        int | None, typer.Option(help="Instead of the number of commits: above the last one's, to go back to old code.")
    ] = None,
    signers: Annotated[
        Path | None, typer.Option(help="List of signers that probes take over with this release.")
    ] = None,
    allow_dirty: Annotated[
        bool, typer.Option("--allow-dirty", help="Build also what is not committed; the version says so.")
    ] = False,
) -> None:
    """Build and sign the release file of this commit: the same commit gives the same bytes.

    The wheels of requirements/device.lock are downloaded once and kept in build/wheels.
    """
    from host_tools.release.build import ReleaseOrder, build_release
    from host_tools.release.checkout import Checkout
    from host_tools.release.locked_wheels import sha256_of
    from host_tools.release.target import Target

    root = source_tree("build a release")
    trusted = signers.read_text(encoding="utf-8") if signers else ""
    order = ReleaseOrder(
        Checkout.at(root), Target.named(machine, system), key.expanduser(), root / KEPT, counter, trusted, allow_dirty
    )
    built = build_release(order, out, lambda step: note.print(step, markup=False))
    size = built.path.stat().st_size
    largest = sorted(built.sizes.items(), key=lambda one: -one[1])[:3]
    print(f"{built.path}: release {built.edition.version}, counter {built.edition.counter}, for {system} on {machine}")
    print(f"commit {built.edition.commit}")
    print(f"{size} bytes ({size / MB:.1f} MB), {len(built.sizes)} files; largest:")
    for name, bytes_ in largest:
        print(f"  {bytes_ / MB:6.1f} MB  {name}")
    print(f"sha256 {sha256_of(built.path)}")


@release.command(epilog="Example: host_tools release show dist/tsis-0.1.0-bookworm-aarch64.release")
def show(
    file: Annotated[Path, typer.Argument(help="Release file.")],
    signers: Annotated[Path, typer.Option(help="List of signers: whom to trust.")] = SIGNERS,
) -> None:
    """Print the manifest of a release file, once signature and every file of it are found to be right."""
    from host_tools.release.release_file import checked_manifest

    if not signers.is_file():
        raise InvalidQuantity("signers", signers, "a file", "write one with `host_tools release signers KEY.pub`")
    print(json.dumps(checked_manifest(file, signers.read_text(encoding="utf-8")), indent=1))


@release.command(
    epilog="Example: host_tools release advisories dist/tsis-0.1.0-bookworm-aarch64.release --database all.zip"
)
def advisories(
    file: Annotated[Path, typer.Argument(help="Release file, or its sbom.json.", exists=True, dir_okay=False)],
    database: Annotated[Path, typer.Option(help="Folder or zip of advisories (OSV), as osv.dev's.", exists=True)],
) -> None:
    """Print the known vulnerabilities of a release's wheels, offline: exit code 1 when there is one."""
    from host_tools.release.advisories import compared, parts_of

    comparison = compared(parts_of(file), database)
    for one in comparison.found:
        mended = " or ".join(one.mended_in) or "no version yet"
        print(f"{one.part.name} {one.part.version}: {' '.join(one.names)}, mended in {mended}: {one.summary}")
    print(f"{comparison.parts} parts, {comparison.advisories} advisories as of {comparison.newest}: ", end="")
    print(f"{len(comparison.found)} known vulnerabilities" if comparison.found else "no known vulnerability")
    raise typer.Exit(1 if comparison.found else 0)


@release.command(epilog="Example: host_tools release key ~/.config/tsis/release_key")
def key(
    file: Annotated[Path, typer.Argument(help="File of the private key; the public one gets .pub.")] = KEY,
    hardware: Annotated[bool, typer.Option("--hardware", help="Make it in a FIDO token that is plugged in.")] = False,
    no_passphrase: Annotated[
        bool, typer.Option("--no-passphrase", help="Whoever has the file can sign: for tests and build machines.")
    ] = False,
) -> None:
    """Make a key that signs releases; ssh-keygen asks for its passphrase."""
    from host_tools.release.signing import new_key, signers_list

    public = new_key(file.expanduser(), hardware=hardware, passphrase="" if no_passphrase else None)
    note.print(f"{file} made: keep it secret, and a copy of it apart. A probe trusts it by this line:", soft_wrap=True)
    print(signers_list([public]), end="")


@release.command(epilog="Example: host_tools release signers release_key.pub next_key.pub > release_signers")
def signers(
    public_keys: Annotated[list[Path], typer.Argument(help="Public keys, of which each may sign.")],
) -> None:
    """Print the list of signers that trusts some keys: a probe has it in /etc/tsis/release_signers."""
    from host_tools.release.signing import signers_list

    print(signers_list(public_keys), end="")


def deploy(
    file: File,
    host: Host,
    ssh: Ssh = "",
    signers: Signers = SIGNERS,
    check_here: Annotated[
        bool, typer.Option(help="Verify the file before it is sent; the probe does in any case.")
    ] = True,
) -> None:
    """Send a release to a probe and follow it: exit code 0 when the probe has committed it, else the reason and 1."""
    from host_tools.release.remote_machine import NotReachable, RemoteMachine
    from host_tools.release.send import ACCOUNT, send_release

    machine = RemoteMachine(host, ACCOUNT, f"-oBatchMode=yes {ssh}")
    try:
        done = send_release(file, signers, machine, _tell, is_checked_here=check_here)
    except NotReachable as error:
        _tell(str(error))
        done = False
    raise typer.Exit(0 if done else 1)


def provision(
    file: File,
    host: Host,
    serial: Annotated[str, typer.Option(help="Serial number of the probe.")] = "",
    deploy_key: Annotated[Path | None, typer.Option(help="Public ssh key that may send releases.", exists=True)] = None,
    user: Annotated[str, typer.Option(help="Who logs in, and may become root by sudo.")] = "pi",
    ssh: Ssh = "",
    signers: Signers = SIGNERS,
    time_zone: Annotated[str, typer.Option(help="As Europe/Berlin; as it is unless given.")] = "",
    time_servers: Annotated[
        str, typer.Option(help="Who tells it the time, apart by a space; as it is unless given.")
    ] = "",
    camera_overlay: Annotated[
        str, typer.Option(help="The sensor's, as imx296; as it is unless given, at first ov9281.")
    ] = "",
    check: Annotated[
        bool, typer.Option("--check", help="Only tell what differs, exit code 1 when something does.")
    ] = False,
    stand_in: Annotated[bool, typer.Option("--stand-in", help="The machine is no Pi, for tests.")] = False,
) -> None:
    """Make a machine with a fresh Raspberry Pi OS a probe; what is in place stays."""
    from host_tools.release.provisioning import ProvisioningOrder, provision_machine
    from host_tools.release.remote_machine import NotReachable, RemoteMachine

    options = [*(["--check"] if check else []), *(["--stand-in"] if stand_in else [])]
    options += [f"--serial={serial}"] if serial else []
    options += [f"--time-zone={time_zone}"] if time_zone else []
    options += [f"--time-servers={time_servers}"] if time_servers else []
    options += [f"--camera-overlay={camera_overlay}"] if camera_overlay else []
    order = ProvisioningOrder(file, signers, deploy_key, tuple(options))
    try:
        code = provision_machine(order, RemoteMachine(host, user, ssh), _tell)
    except NotReachable as error:
        _tell(str(error))
        code = 1
    raise typer.Exit(code)


def _tell(line: str) -> None:
    print(line, flush=True)
