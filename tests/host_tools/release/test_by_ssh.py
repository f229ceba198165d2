"""`host_tools deploy` and `provision` with a stand-in for ssh that runs the command here; the release file is real.

`make test-deploy` does the same with sshd and a Debian that has booted.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from small_release import new_key, release_file, signer

from device.measurement.quantities import InvalidQuantity
from host_tools.release.provisioning import ProvisioningOrder, provision_machine, provisioning_command
from host_tools.release.remote_machine import NotReachable, RemoteMachine
from host_tools.release.send import send_release

SSH = """#!/bin/sh
# Options with a value of their own, then USER@HOST, then the command, or none: then what the account is forced to.
while true; do case $1 in -p|-i) shift 2;; -*) shift;; *) break;; esac; done
shift
echo "$@" >> "$SAID"
if [ $# = 0 ]; then exec sh -c "$FORCED"; fi
exec sh -c "$*"
"""
SUDO = """#!/bin/sh
if [ -n "$PASSWORD_ASKED" ]; then echo "sudo: a password is required" >&2; exit 1; fi
shift  # -n
exec "$@"
"""
PYTHON3 = """#!/bin/sh
echo "$PYTHONPATH" | sed 's|.*/|wheel |'
exec sh -c "$PROVISIONED"
"""


@pytest.fixture
def release(tmp_path):
    """A small release file and the list of signers that trusts it."""
    key = new_key(tmp_path, "key")
    path = tmp_path / "tsis-1.0-x86_64.release"
    path.write_bytes(release_file(key, "1.0", 10))
    signers = tmp_path / "signers"
    signers.write_text(signer(key))
    return path, signers


@pytest.fixture
def machine(tmp_path, monkeypatch) -> RemoteMachine:
    """A machine that is this one, in a home of its own."""
    commands = tmp_path / "bin"
    commands.mkdir()
    for name, script in {"ssh": SSH, "sudo": SUDO, "python3": PYTHON3, "systemctl": "#!/bin/sh\nexit 0\n"}.items():
        (commands / name).write_text(script)
        (commands / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{commands}:{os.environ['PATH']}")
    monkeypatch.setenv("SAID", str(tmp_path / "said"))
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("FORCED", "cat > $HOME/received; echo 100% committed")
    monkeypatch.setenv("PROVISIONED", "exit 0")
    return RemoteMachine("tsis-0007.local", "tsis-deploy", "-p 18022 -i key")


def order(release: Path, signers: Path, *options: str) -> ProvisioningOrder:
    return ProvisioningOrder(release, signers, release.with_name("key.pub"), options)


def test_a_release_arrives_byte_for_byte_and_its_progress_is_told(machine, release, tmp_path):
    told: list[str] = []
    assert send_release(*release, machine, told.append)
    assert (tmp_path / "received").read_bytes() == release[0].read_bytes()
    assert "100% committed" in told
    assert told[-1] == "committed"


def test_it_is_told_whom_the_probe_trusts_after_a_release(machine, release, tmp_path):
    path, signers = release
    told: list[str] = []
    send_release(path, signers, machine, told.append)
    assert told[0].endswith("signed and whole; keys stay as they are")
    other = signer(new_key(tmp_path, "next")).replace("release@tsis ", "release@tsis,release@desk-3 ")
    both = signer(tmp_path / "key") + "# the next one, no ssh-ed25519 key here\n" + other
    path.write_bytes(release_file(tmp_path / "key", "1.0", 11, signers=both))
    send_release(path, signers, machine, told.append)
    ends = [(tmp_path / f"{name}.pub").read_text().split()[1][-8:] for name in ("key", "next")]
    assert f"signed and whole; the probe then trusts the keys that end with {ends[0]}, {ends[1]} alone" in " ".join(
        told
    )


def test_a_release_that_is_not_committed_is_told_with_its_reason(machine, release, monkeypatch):
    monkeypatch.setenv("FORCED", "cat > /dev/null; echo E013 the camera is not ready >&2; exit 1")
    told: list[str] = []
    assert not send_release(*release, machine, told.append)
    assert "E013 the camera is not ready" in told
    assert "not committed" in told[-1]


def test_a_connection_that_is_lost_says_what_may_have_become_of_the_file(machine, release, monkeypatch):
    monkeypatch.setenv("FORCED", "exit 255")
    with pytest.raises(NotReachable, match="GET /api/v1/updates"):
        send_release(*release, machine, print)


@pytest.mark.parametrize("place", [600, -1000])
def test_a_damaged_file_is_not_sent(machine, release, place, tmp_path):
    path, signers = release
    content = bytearray(path.read_bytes())
    content[content.index(b"daemon of") if place < 0 else place] ^= 1
    path.write_bytes(content)
    with pytest.raises(InvalidQuantity):
        send_release(path, signers, machine, print)
    assert not (tmp_path / "said").exists()


@pytest.mark.parametrize("host", ["", "-oProxyCommand=reboot", "a b"])
def test_what_is_no_host_is_refused(host):
    with pytest.raises(InvalidQuantity, match="host"):
        RemoteMachine(host, "pi")


def test_provisioning_runs_our_wheel_there_and_leaves_nothing(machine, release, tmp_path):
    told: list[str] = []
    assert provision_machine(order(*release, "--serial=TSIS-0007"), machine, told.append) == 0
    assert "wheel tsis-1.0-py3-none-any.whl" in told
    [command] = [line for line in (tmp_path / "said").read_text().splitlines() if "device.provisioning" in line]
    assert command.startswith("sudo -n env PYTHONPATH=")
    assert "--serial=TSIS-0007" in command
    assert list(tmp_path.glob("tsis-provision.*")) == []


def test_a_user_who_is_asked_for_a_password_is_told_what_to_do_before_anything_is_sent(machine, release, monkeypatch):
    """Raspberry Pi OS asks for one since April 2026, and no terminal is there to type it in."""
    monkeypatch.setenv("PASSWORD_ASKED", "1")
    told: list[str] = []
    with pytest.raises(NotReachable, match=r"NOPASSWD: ALL' \| sudo tee /etc/sudoers.d/tsis-provision"):
        provision_machine(order(*release), machine, told.append)
    assert told == []


def test_a_check_sends_the_wheel_without_the_release(machine, release, monkeypatch):
    monkeypatch.setenv("PROVISIONED", "echo differs; exit 1")
    told: list[str] = []
    assert provision_machine(order(*release, "--check"), machine, told.append) == 1
    assert "differs" in told
    assert not any(release[0].name in line for line in told)


def test_settings_of_the_boot_are_followed_by_a_reboot_and_the_rest(machine, release, monkeypatch, tmp_path):
    again = tmp_path / "again"
    monkeypatch.setenv("PROVISIONED", f"test -e {again} && exit 0; touch {again}; exit 4")
    monkeypatch.setattr("host_tools.release.provisioning.BOOT_ID", str(tmp_path / "boot_id"))
    monkeypatch.setattr("host_tools.release.remote_machine.BOOT_ID", str(tmp_path / "boot_id"))
    (tmp_path / "boot_id").write_text("first")
    reboots = f"#!/bin/sh\necho second > {tmp_path}/boot_id\n"
    (tmp_path / "bin/systemctl").write_text(reboots)
    told: list[str] = []
    assert provision_machine(order(*release), machine, told.append) == 0
    assert "rebooting" in told


def test_root_needs_no_sudo(release):
    command = provisioning_command(order(*release), "/root/x", "tsis.whl", "root")
    assert command.startswith("env PYTHONPATH=/root/x/tsis.whl python3 -m device.provisioning ")
