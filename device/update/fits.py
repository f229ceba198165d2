"""Whether a signed release is for this probe and this day: product, machine, data, and newer than what ran here.

Checked before anything is written. "Newer" is the counter's alone; who wants an older version back signs it with a new
counter.
"""

from __future__ import annotations

import platform
import sys

from device.errors import UnfitRelease
from device.files.plain_settings import data_folder
from device.records.schema import store_schema
from device.update.layout import UpdateLayout
from device.update.manifest import ReleaseManifest, read_installed
from device.update.signature import require_signers
from device.update.state import UpdateState, counter_of

PRODUCT, FIRST_HARDWARE = "tsis", "tsis-probe-1"
OTHER = "Take the release that was built for this probe."
NEWER = "Build it anew with a higher counter (`make bundle`)."


def require_fit(layout: UpdateLayout, state: UpdateState, manifest: ReleaseManifest) -> None:
    """Raise `UnfitRelease` with the first reason why this probe must not have this release."""
    require_machine(manifest)
    own = probe_hardware(layout)
    if own not in manifest.hardware:
        raise UnfitRelease(f"The release is for {_listed(manifest.hardware)}, and this probe is {own}.", OTHER)
    require_readable_data(layout, manifest)
    _require_way_back(layout, state, manifest)
    _require_newer(state, manifest)
    try:
        if manifest.signers:
            require_signers(manifest.signers)
    except ValueError as error:
        raise UnfitRelease(f"The release would change whom this probe trusts, but {error}.", NEWER) from None


def require_machine(manifest: ReleaseManifest) -> None:
    """Raise `UnfitRelease` when this machine and its system cannot run it."""
    _require("product", manifest.product, PRODUCT)
    _require("machine", manifest.machine, platform.machine())
    _require("Python", manifest.python, f"{sys.version_info.major}.{sys.version_info.minor}")


def probe_hardware(layout: UpdateLayout) -> str:
    """Return the kind of this probe."""
    try:
        return layout.hardware.read_text(encoding="utf-8").strip() or FIRST_HARDWARE
    except (OSError, UnicodeDecodeError):
        return FIRST_HARDWARE


def require_readable_data(layout: UpdateLayout, manifest: ReleaseManifest) -> None:
    """Raise `UnfitRelease` when a release cannot read the measurements that are there."""
    try:
        schema = store_schema(data_folder(layout.root) / "tsis.sqlite")
    except OSError as error:
        raise UnfitRelease(f"The measurements cannot be looked at: {error}.", "Check the disk.") from None
    if schema is not None and schema not in manifest.store_reads:
        cause = f"The release reads measurements of schema {_listed(manifest.store_reads)}, and this probe's have"
        raise UnfitRelease(f"{cause} {schema}.", "Install first a release that reads it.")


def _require_way_back(layout: UpdateLayout, state: UpdateState, manifest: ReleaseManifest) -> None:
    """Require that the release that runs now could read what the new one writes: it may have to come back.

    One whose folder a bad card has taken cannot; then nothing stands in the way of the next.
    """
    if not layout.is_installed(state.committed or ""):
        return
    present = read_installed(layout, state.committed or "")
    if manifest.store_writes not in present.store_reads:
        cause = f"The release writes measurements of schema {manifest.store_writes}; {present.name}, which would come"
        cause += f" back if it fails, reads {_listed(present.store_reads)}."
        raise UnfitRelease(cause, "Install first a release that reads both.")


def _require_newer(state: UpdateState, manifest: ReleaseManifest) -> None:
    if manifest.counter <= state.floor:
        cause = f"The release has the counter {manifest.counter}, and one of {state.floor} was already in use here."
        raise UnfitRelease(cause, NEWER)
    for release, reason in state.bad.items():
        if counter_of(release) == manifest.counter:
            raise UnfitRelease(f"The release {release} was tried and failed: {reason}", NEWER)


def _require(what: str, stated: str, own: str) -> None:
    if stated != own:
        raise UnfitRelease(f"The release is for {what} {stated}, and this probe has {own}.", OTHER)


def _listed(values: tuple[object, ...]) -> str:
    return " or ".join(map(str, values)) or "none"
