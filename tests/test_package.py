"""The wheel: one `pip install` in an empty folder gives a daemon and a toolkit that find everything they came with."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import zipfile
from hashlib import sha256
from pathlib import Path

import pytest
from daemon_process import ROOT, Daemon, wait_for

from device.files.shipped import FOLDERS
from host_tools.release.checkout import Checkout
from host_tools.release.own_wheel import built_wheel


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built_wheel(Checkout.at(ROOT), tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of packages that the wheel is installed in; before all others for whoever names it in PYTHONPATH."""
    folder = tmp_path_factory.mktemp("packages")
    options = ["--quiet", "--no-deps", "--no-index", "--no-compile", "--target", folder]
    subprocess.run([sys.executable, "-m", "pip", "install", *options, wheel], check=True)
    return folder


def run(installed: Path, folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(installed), "OPENBLAS_NUM_THREADS": "1", "COLUMNS": "200"}
    return subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def test_the_daemon_of_a_wheel_gets_ready_in_an_empty_folder(installed, tmp_path):
    daemon = Daemon(tmp_path, environment={"PYTHONPATH": str(installed)})
    try:
        wait_for(lambda: daemon.ask("/api/v1/health/ready").status, lambda status: status == 200)
        modes = daemon.ask("/api/v1/device").json["modes"]
    finally:
        assert daemon.stop() == 0
    assert {mode["mode"] for mode in modes} == {"paper", "quick", "standard", "precise"}


def test_the_daemon_of_a_wheel_takes_its_models_from_the_wheel(installed, tmp_path):
    shown = run(installed, tmp_path, "-m", "device", "config", "show", "--json")
    assert shown.returncode == 0, shown.stderr
    values = {one["setting"]: one["value"] for one in json.loads(shown.stdout)}
    for mode in ("paper", "quick", "standard"):
        assert values[f"{mode}_model"] == f"{installed}/device/shipped/models/{mode}"


def test_the_toolkit_of_a_wheel_finds_protocols_models_and_tables(installed, tmp_path):
    look = (
        "import host_tools as tsis; from host_tools.door import STANDARD_PROTOCOL; print(tsis.__file__); "
        "tsis.read_protocol(STANDARD_PROTOCOL); tsis.installed_models(); tsis.simulated_probe()"
    )
    found = run(installed, tmp_path, "-c", look)
    assert (found.returncode, found.stderr) == (0, "")
    assert found.stdout.startswith(str(installed))
    assert run(installed, tmp_path, "-m", "host_tools", "--help").returncode == 0
    scene = ["--size-mm", "10", "--depth-mm", "6", "--modulus-kpa", "80", "--force-n", "0.5", "--strain", "small"]
    solved = run(installed, tmp_path, "-m", "host_tools", "simulate", *scene, "--frame", "frame.png")
    assert solved.returncode == 0, solved.stderr
    assert (tmp_path / "frame.png").is_file()


@pytest.mark.parametrize(
    "verb", [["train"], ["optics", "build"], ["pages"], ["table"], ["release", "build"]], ids=" ".join
)
def test_the_toolkit_of_a_wheel_never_writes_into_the_package(verb, installed, tmp_path):
    refused = run(installed, tmp_path, "-m", "host_tools", *verb)
    assert refused.returncode == 1, refused.stderr
    assert "host_tools is an installed package" in refused.stderr


def test_a_wheel_holds_all_files_of_the_program_and_none_besides(wheel):
    with zipfile.ZipFile(wheel) as packed:
        members = {name for name in packed.namelist() if ".dist-info/" not in name}
        stored = {packed.read(name) for name in members if name.startswith("device/shipped/")}
    code = {name for name in _files("device", "host_tools") if "/shipped/" not in name}
    there = _files(*FOLDERS.values())
    assert {name for name in members if not name.startswith("device/shipped/")} == code
    assert len(members) == len(code) + len(there)
    assert stored == {(ROOT / name).read_bytes() for name in there}


def _files(*folders: str) -> set[str]:
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--", *folders]
    names = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    return {name for name in names if (ROOT / name).is_file()}


def test_two_clones_of_a_commit_give_the_same_bytes(wheel, tmp_path):
    """Another folder, other times of its files, another umask, and what git ignores."""
    clone = tmp_path / "elsewhere"
    for name in _files("."):
        (clone / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, clone / name)
        (clone / name).chmod(0o600)
    (clone / "device" / "__pycache__").mkdir()
    (clone / "device" / "__pycache__" / "left.cpython-311.pyc").write_bytes(b"left over")
    shutil.copytree(ROOT / ".git", clone / ".git")
    umask = os.umask(0o077)
    try:
        again = built_wheel(Checkout.at(clone), tmp_path)
    finally:
        os.umask(umask)
    assert again.name == wheel.name
    assert sha256(again.read_bytes()).hexdigest() == sha256(wheel.read_bytes()).hexdigest()
