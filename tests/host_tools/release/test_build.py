"""A whole release from a clone of this repository, with small wheels instead of the lock's hundred megabytes."""

from __future__ import annotations

import os
import subprocess
import tarfile
from pathlib import Path
from typing import Any

import pytest
from daemon_process import ROOT
from small_wheels import locked, small_wheel
from toolkit_process import run_toolkit

from device.measurement.quantities import InvalidQuantity
from host_tools.release.build import ReleaseOrder, build_release
from host_tools.release.checkout import LOCK, Checkout
from host_tools.release.lock import needed, read_lock
from host_tools.release.release_file import checked_manifest
from host_tools.release.signing import new_key, signers_list
from host_tools.release.target import Target

ARM = Target.named("aarch64")


def git(folder: Path, *words: str) -> str:
    who = ["-c", "user.name=someone", "-c", "user.email=someone@example.org"]
    done = subprocess.run(["git", "-C", folder, *who, *words], capture_output=True, text=True, check=True)
    return done.stdout.strip()


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small wheel of everything that the lock pins for an arm."""
    folder = tmp_path_factory.mktemp("wheels")
    for one in needed(read_lock(ROOT / LOCK), ARM):
        small_wheel(folder / ARM.name, one.name, next(iter(one.requirement.specifier)).version)
    return folder


@pytest.fixture(scope="module")
def clone(wheels: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clone as this working tree is, with a lock for the small wheels, all committed."""
    folder = tmp_path_factory.mktemp("clone") / "tsis"
    git(ROOT, "clone", "--quiet", "--shared", str(ROOT), str(folder))
    Checkout.at(ROOT).copy(folder)
    (folder / LOCK).write_text("".join(locked(path) for path in sorted((wheels / ARM.name).iterdir())))
    git(folder, "add", ".")
    git(folder, "commit", "--quiet", "--allow-empty", "--message", "Pin small wheels")
    return folder


@pytest.fixture(scope="module")
def key(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return new_key(tmp_path_factory.mktemp("keys") / "key", passphrase="").with_suffix("")


@pytest.fixture(scope="module")
def signers(key: Path) -> Path:
    path = key.with_name("release_signers")
    path.write_text(signers_list([key.with_suffix(".pub")]))
    return path


def checked(path: Path, signers: Path) -> dict[str, Any]:
    return checked_manifest(path, signers.read_text())


@pytest.fixture(autouse=True)
def offline(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PIP_NO_INDEX", "1")


def order(clone: Path, key: Path, wheels: Path, **changed: object) -> ReleaseOrder:
    return ReleaseOrder(Checkout.at(clone), ARM, key, wheels, **changed)


@pytest.fixture(scope="module")
def built(clone: Path, key: Path, wheels: Path, tmp_path_factory: pytest.TempPathFactory):
    return build_release(order(clone, key, wheels), tmp_path_factory.mktemp("dist"), lambda _: None)


def test_a_release_file_is_its_manifest_its_signature_and_the_files_listed(built, clone, signers):
    manifest = checked(built.path, signers)
    assert built.path.name == f"tsis-{manifest['version']}-bookworm-aarch64.release"
    assert manifest["counter"] == int(git(clone, "rev-list", "--count", "HEAD"))
    assert manifest["commit"] == git(clone, "rev-parse", "HEAD")
    assert (manifest["machine"], manifest["python"], manifest["signers"]) == ("aarch64", "3.11", "")
    names = [entry["path"] for entry in manifest["files"]]
    with tarfile.open(built.path) as archive:
        members = archive.getmembers()
    assert [member.name for member in members] == ["manifest.json", "manifest.json.sig", *names]
    assert {(one.type, one.mode, one.mtime, one.uid, one.gid, one.uname) for one in members} == {
        (tarfile.REGTYPE, 0o644, 0, 0, 0, "")
    }
    assert f"wheels/tsis-{manifest['version']}-py3-none-any.whl" in names
    assert {name for name in names if name.startswith("systemd/")} == set(_listed(clone, "systemd"))
    assert len([name for name in names if name.startswith("wheels/")]) == len(needed(read_lock(clone / LOCK), ARM)) + 1


def _listed(folder: Path, below: str) -> list[str]:
    return git(folder, "ls-files", below).splitlines()


def test_the_same_commit_gives_the_same_bytes(built, clone, key, wheels, tmp_path):
    again = tmp_path / "another" / "clone"
    git(clone, "clone", "--quiet", str(clone), str(again))
    umask = os.umask(0o077)
    try:
        second = build_release(order(again, key, wheels), tmp_path, lambda _: None)
    finally:
        os.umask(umask)
    assert second.path.read_bytes() == built.path.read_bytes()


def test_a_byte_that_differs_is_found(built, signers, tmp_path):
    content = bytearray(built.path.read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / "flipped.release").write_bytes(content)
    with pytest.raises(InvalidQuantity, match="but must be a release that a probe takes: .* is damaged"):
        checked(tmp_path / "flipped.release", signers)
    (tmp_path / "cut.release").write_bytes(built.path.read_bytes()[:700])
    with pytest.raises(InvalidQuantity, match="The release file ends after 700 bytes"):
        checked(tmp_path / "cut.release", signers)


def test_what_is_not_committed_is_refused_and_else_told_in_the_version(clone, key, wheels, signers, tmp_path):
    changed = clone / "device" / "new_module.py"
    changed.write_text('"""New."""\n')
    try:
        with pytest.raises(InvalidQuantity, match=r"checkout is changed in device/new_module\.py"):
            build_release(order(clone, key, wheels), tmp_path, lambda _: None)
        tried = build_release(order(clone, key, wheels, allow_changes=True), tmp_path, lambda _: None)
    finally:
        changed.unlink()
    manifest = checked(tried.path, signers)
    assert manifest["version"].endswith(".changed")
    assert [entry for entry in manifest["files"] if "+changed-py3-none-any.whl" in entry["path"]]


def test_what_no_release_holds_may_change(clone):
    (clone / "notes.txt").write_text("mine\n")
    assert Checkout.at(clone).changed == ()


def test_a_stated_counter_takes_an_old_commit_above_newer_releases(clone, key, wheels, signers, tmp_path):
    back = build_release(order(clone, key, wheels, counter=100_000), tmp_path, lambda _: None)
    assert checked(back.path, signers)["counter"] == 100_000
    with pytest.raises(InvalidQuantity, match="counter is 0"):
        build_release(order(clone, key, wheels, counter=0), tmp_path, lambda _: None)


def test_a_shallow_clone_has_no_counter(clone, tmp_path):
    git(clone, "clone", "--quiet", "--depth=1", f"file://{clone}", str(tmp_path / "shallow"))
    with pytest.raises(InvalidQuantity, match="git fetch --unshallow"):
        Checkout.at(tmp_path / "shallow").counter()


def test_probes_never_take_over_signers_that_leave_out_the_key_that_signs(clone, key, wheels, signers, tmp_path):
    other = signers_list([new_key(tmp_path / "other", passphrase="")])
    with pytest.raises(InvalidQuantity, match="must be of a key in the list of signers"):
        build_release(order(clone, key, wheels, signers=other), tmp_path, lambda _: None)
    rotated = build_release(order(clone, key, wheels, signers=signers.read_text() + other), tmp_path, lambda _: None)
    assert checked(rotated.path, signers)["signers"] == signers.read_text() + other


def test_the_command_shows_what_it_has_verified(built, signers, tmp_path):
    shown = run_toolkit("release", "show", built.path, "--signers", signers)
    assert shown.returncode == 0
    assert '"schema": "tsis.release/1"' in shown.stdout
    stranger = new_key(tmp_path / "stranger", passphrase="")
    (tmp_path / "trusted").write_text(signers_list([stranger]))
    refused = run_toolkit("release", "show", built.path, "--signers", tmp_path / "trusted")
    assert (refused.returncode, refused.stdout) == (1, "")
