"""From a commit to a signed release file: wheels of the lock, our own, units, parts list, manifest, signature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from device.files.shipped import FOLDERS
from device.measurement.quantities import Bound, InvalidQuantity, require
from host_tools.release.checkout import LOCK, Checkout
from host_tools.release.lock import needed, read_lock
from host_tools.release.locked_wheels import locked_wheels, name_in_release
from host_tools.release.own_wheel import built_wheel, version_of
from host_tools.release.parts_list import parts_list
from host_tools.release.release_file import PRODUCT, Edition, manifest_of, write_release
from host_tools.release.signing import require_signed, signature_of
from host_tools.release.target import Target

MOST_COUNTER = 2**53
NAMED_CHANGES = 3


@dataclass(frozen=True)
class ReleaseOrder:
    """What release is asked for: of which checkout, for whom, signed with which key.

    `counter` stands instead of the number of commits, so that an older commit can replace a newer release. `signers` is
    the text of a list of signers that probes take over with the release. `kept` is a folder that keeps wheels.
    """

    checkout: Checkout
    target: Target
    key: Path
    kept: Path
    counter: int | None = None
    signers: str = ""
    allow_changes: bool = False


@dataclass(frozen=True)
class BuiltRelease:
    """A release file that was written, what it is called, and the sizes (bytes) of its files by name."""

    path: Path
    edition: Edition
    sizes: dict[str, int]


def build_release(order: ReleaseOrder, out: Path, told: Callable[[str], None]) -> BuiltRelease:
    """Build a release into the folder `out`; return what was written. `told` hears, in words, what is done.

    Raises `InvalidQuantity` for a checkout with changes, a wheel that is missing, and a key that cannot sign.
    """
    _require_committed(order)
    edition = _edition(order)
    with TemporaryDirectory(prefix="tsis-release-") as folder:
        files = _files(order, Path(folder), told)
        manifest = manifest_of(edition, order.target, files)
        signature = signature_of(manifest, order.key)
        if edition.signers:  # who takes over a list without the key that signs could install nothing any more
            require_signed(manifest, signature, edition.signers)
        path = out / f"{PRODUCT}-{edition.version}-{order.target.system.name}-{order.target.machine}.release"
        write_release(path, manifest, signature, files)
        return BuiltRelease(path, edition, {name: file.stat().st_size for name, file in files.items()})


def _require_committed(order: ReleaseOrder) -> None:
    changed = order.checkout.changed
    if changed and not order.allow_changes:
        named = ", ".join(changed[:NAMED_CHANGES]) + (" ..." if len(changed) > NAMED_CHANGES else "")
        action = "commit them, or say --allow-dirty to try something out"
        raise InvalidQuantity("checkout", f"changed in {named}", "as committed", action)


def _edition(order: ReleaseOrder) -> Edition:
    """Return what the release is called; its version is in the characters that the name of a folder may have."""
    counter = order.checkout.counter() if order.counter is None else order.counter
    require("counter", counter, Bound(1, MOST_COUNTER, ""), "count up from the last release")
    version = version_of(order.checkout).replace("+", ".")
    return Edition(version, counter, order.checkout.commit, order.signers)


def _files(order: ReleaseOrder, folder: Path, told: Callable[[str], None]) -> dict[str, Path]:
    """Return the files of the release, by their names in it; those that are made lie in `folder`."""
    wheels = _wheels(order, told)
    told("building our own wheel")
    own = built_wheel(order.checkout, folder)
    told("writing the parts list")
    listed = folder / "sbom.json"
    listed.write_bytes(parts_list(own, wheels, order.checkout, order.target))
    order.checkout.copy(folder / "sources")
    units = folder / "sources" / FOLDERS["systemd"]
    return {
        **{
            f"wheels/{name_in_release(wheel.name)}": wheel
            for wheel in sorted([*wheels, own], key=lambda wheel: wheel.name)
        },
        **{f"systemd/{_below(path, units)}": path for path in sorted(units.rglob("*")) if path.is_file()},
        "sbom.json": listed,
    }


def _wheels(order: ReleaseOrder, told: Callable[[str], None]) -> list[Path]:
    lock = read_lock(order.checkout.root / LOCK)
    chosen = needed(lock, order.target)
    for one in lock:
        if one not in chosen:
            told(f"left out, not for {order.target.name}: {one.requirement}")
    kept = order.kept / order.target.name
    return locked_wheels(chosen, order.target, kept, lambda one: told(f"{one.pinned}"))


def _below(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix()
