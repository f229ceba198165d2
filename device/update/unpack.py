"""A verified release file to a folder that can be run: beside its place, synchronised, then under its name.

Modules are compiled here, since the daemon may write nowhere; by hash and unchecked, since no clock can be trusted.
"""

from __future__ import annotations

import compileall
import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from py_compile import PycInvalidationMode

from device.errors import UntrustedRelease, UpdateFailed
from device.files.durable import sync_directory
from device.files.plain_settings import data_folder, least_free_mb
from device.update.contents import write_contents
from device.update.layout import REMOVED, STAGED, UpdateLayout
from device.update.manifest import ReleaseManifest
from device.update.release_file import ReleaseFile
from device.update.wheel import WheelFile, wheel_contents, wheel_files

INTERPRETER = "/usr/bin/python3"
SPARE_BYTES = 64 * 2**20
"""What an update leaves free, for the state and for the measurements that are taken meanwhile."""
ROOM_BYTES = 16 * 2**20
"""And at least so much above `store.min_free_mb`, below which no daemon is ready (E602)."""
DISK_BLOCK = 4096
BY_HASH = PycInvalidationMode.UNCHECKED_HASH
VENV = "home = /usr/bin\ninclude-system-site-packages = true\nversion = {version}\n"
"""Makes bin/python see the release's own packages before the system's, of which picamera2 is one."""


@dataclass(frozen=True)
class UnpackPlan:
    """A release as it is to be written: its signed texts, and what each wheel brings."""

    manifest: ReleaseManifest
    signed: tuple[bytes, bytes]
    wheels: dict[str, list[WheelFile]]

    def needed_bytes(self) -> int:
        """Return the space that the release takes, compiled modules (about as large as their source) included."""
        sizes = [entry.size for entry in self.manifest.files if entry.path not in self.wheels]
        for file in (file for files in self.wheels.values() for file in files):
            sizes += [file.size] * (2 if file.place.endswith(".py") else 1)
        return sum(-(-size // DISK_BLOCK) + 1 for size in sizes) * DISK_BLOCK


def plan_unpacking(file: ReleaseFile, manifest: ReleaseManifest, signed: tuple[bytes, bytes]) -> UnpackPlan:
    """Return what would be written; raise `UntrustedRelease` when a wheel brings what must not be. Writes nothing."""
    wheels = {entry.path: wheel_files(file.content(entry), entry.path) for entry in manifest.wheels()}
    taken: dict[str, str] = {}
    for path, files in wheels.items():
        for brought in files:
            other = taken.setdefault(brought.place, path)
            if other != path:
                raise UntrustedRelease(f"{path} and {other} both bring {brought.place}.", "Build the release anew.")
    return UnpackPlan(manifest, signed, wheels)


def require_space(layout: UpdateLayout, plan: UnpackPlan) -> None:
    """Raise `UpdateFailed` when the disk has not the space that the release takes."""
    spare = _spare_bytes(layout)
    needed, free = plan.needed_bytes() + spare, shutil.disk_usage(_existing(layout.releases)).free
    if free < needed:
        cause = (
            f"The disk of {layout.releases} has {free / 1e6:.0f} MB free, and the release needs {needed / 1e6:.0f}, "
            f"of which {spare / 1e6:.0f} stay free."
        )
        raise UpdateFailed(cause, "Copy recordings away and delete them there, then try again.")


def _spare_bytes(layout: UpdateLayout) -> int:
    """Return what an update leaves free: more where the daemon keeps its data on the same disk and needs more there."""
    disks = {_existing(folder).stat().st_dev for folder in (layout.releases, data_folder(layout.root))}
    if len(disks) > 1:
        return SPARE_BYTES
    return max(SPARE_BYTES, int(least_free_mb(layout.root) * 1e6) + ROOM_BYTES)


def write_staged(layout: UpdateLayout, plan: UnpackPlan, file: ReleaseFile, told: Callable[[float], None]) -> Path:
    """Write the release's files beside their place; return the folder. Raises `OSError`, `UntrustedRelease`."""
    folder = layout.releases / (STAGED + plan.manifest.name)
    remove_release(folder)
    folder.mkdir(parents=True)
    _write_frame(folder, plan)
    packages = folder / _site_packages(plan.manifest)
    packages.mkdir(parents=True)
    for done, entry in enumerate(plan.manifest.files):
        told(done / len(plan.manifest.files))
        content = file.content(entry)
        if entry.path not in plan.wheels:
            _write(folder / entry.path, content)
            continue
        for brought, inner in wheel_contents(content, entry.path, plan.wheels[entry.path]):
            _write(packages / brought.place, inner, 0o755 if brought.is_program else 0o644)
    return folder


def compile_modules(
    layout: UpdateLayout, folder: Path, manifest: ReleaseManifest, told: Callable[[float], None]
) -> None:
    """Compile every module for its place to be; one that cannot be is left as it is, as pip does."""
    packages, final = folder / _site_packages(manifest), layout.release(manifest.name) / _site_packages(manifest)
    entries = sorted(packages.iterdir())
    for done, entry in enumerate(entries):
        told(done / len(entries))
        if entry.is_dir():
            compileall.compile_dir(entry, ddir=str(final / entry.name), quiet=2, invalidation_mode=BY_HASH)
        else:
            compileall.compile_file(entry, ddir=str(final), quiet=2, invalidation_mode=BY_HASH)


def synchronise(folder: Path, told: Callable[[float], None]) -> None:
    """List what the release holds, then bring every file and folder of it to the disk. Raises `OSError`."""
    write_contents(folder)
    os.sync()  # all at once; then each for itself, which now is quick, and tells what could not be written
    paths = [path for path in _walked(folder) if not path.is_symlink()]
    for done, path in enumerate(paths):
        told(done / len(paths))
        sync_directory(path)  # it synchronises a file as well


def take_its_place(layout: UpdateLayout, folder: Path, manifest: ReleaseManifest) -> None:
    """Give the folder its plain name: from now on it is a release. Raises `OSError`."""
    place = layout.release(manifest.name)
    remove_release(place)
    folder.rename(place)
    sync_directory(layout.releases)


def remove_release(folder: Path) -> None:
    """Remove a release; before its first file is gone it has lost its name. Raises `OSError`."""
    if not folder.exists() and not folder.is_symlink():
        return
    doomed = folder.with_name(REMOVED + folder.name.lstrip("."))
    if doomed != folder:
        shutil.rmtree(doomed, ignore_errors=True)
        folder.rename(doomed)
    shutil.rmtree(doomed)


def _write_frame(folder: Path, plan: UnpackPlan) -> None:
    manifest, signature = plan.signed
    _write(folder / "manifest.json", manifest)
    _write(folder / "manifest.json.sig", signature)
    _write(folder / "pyvenv.cfg", VENV.format(version=plan.manifest.python).encode())
    (folder / "bin").mkdir()
    (folder / "bin" / "python").symlink_to(INTERPRETER)


def _write(path: Path, content: bytes, mode: int = 0o644) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("xb") as file:
        file.write(content)
        os.fchmod(file.fileno(), mode)


def _site_packages(manifest: ReleaseManifest) -> str:
    return f"lib/python{manifest.python}/site-packages"


def _walked(folder: Path) -> Iterator[Path]:
    """Yield every file and folder, contents before what holds them."""
    for path in sorted(folder.iterdir()):
        if path.is_dir() and not path.is_symlink():
            yield from _walked(path)
        else:
            yield path
    yield folder


def _existing(folder: Path) -> Path:
    return next(path for path in (folder, *folder.parents) if path.exists())
