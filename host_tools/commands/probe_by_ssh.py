"""`host_tools deploy` and `provision`: a release file to a probe, and a fresh machine to a probe, by ssh."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

KEYS = Path("~/.config/tsis").expanduser()
SIGNERS = KEYS / "release_signers"
File = Annotated[Path, typer.Argument(help="Release file.", exists=True, dir_okay=False)]
Host = Annotated[str, typer.Option(help="Name or address of the probe.")]
Ssh = Annotated[str, typer.Option(help='Options of ssh, as "-p 18022 -i key".')]
Signers = Annotated[Path, typer.Option(help="List of signers: whom to trust.", exists=True, dir_okay=False)]


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
    order = ProvisioningOrder(file, signers, deploy_key, tuple(options))
    try:
        code = provision_machine(order, RemoteMachine(host, user, ssh), _tell)
    except NotReachable as error:
        _tell(str(error))
        code = 1
    raise typer.Exit(code)


def _tell(line: str) -> None:
    print(line, flush=True)
