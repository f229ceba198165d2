"""A release file to a release that runs, or to a refusal that changes nothing: the steps, one after the other.

1. It is signed, it fits, each of its files is there and is what the manifest says, and there is space for it.
2. It is unpacked beside the others, compiled, synchronised, and given its name.
3. It is written down as on trial; from then on an interruption goes on where it was (device/update/trial.py).
4. The daemon is stopped, the link exchanged, the daemon started and watched; then it is committed or left.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from device.errors import DeviceError, RolledBack, UnfitRelease, UpdateFailed
from device.files.plain_settings import daemon_address
from device.update.contents import damage
from device.update.fits import NEWER, require_fit, require_readable_data
from device.update.gate import codes_of_failed_start, take_baseline
from device.update.manifest import ReleaseManifest, read_installed, read_manifest
from device.update.progress import StateName, file_id
from device.update.release_file import ReleaseFile, opened
from device.update.signature import require_signature
from device.update.state import PendingRelease, read_state
from device.update.trial import Updater, begin_trial, carry_through, remove_others
from device.update.unpack import (
    UnpackPlan,
    compile_modules,
    plan_unpacking,
    require_space,
    synchronise,
    take_its_place,
    write_staged,
)

UNTOUCHED = "The release that runs was not touched."


def install(updater: Updater, path: Path) -> None:
    """Install a release file and wait until it is committed.

    Raises `UntrustedRelease`, `UnfitRelease` or `UpdateFailed` when nothing was changed, `RolledBack` when the release
    was tried and left. A trial that was interrupted earlier is carried through first.
    """
    steps = _Steps(updater)
    try:
        steps.settle()
        with opened(path) as file:
            updater.report.file = file_id(file.status)
            manifest, signed = steps.accept(file)
            if steps.runs_already(signed[0], manifest):
                updater.report.end("committed", step="already")
                return
            steps.unpack(file, steps.plan(file, manifest, signed))
        steps.try_out(manifest)
    except RolledBack:
        raise
    except DeviceError as error:
        steps.refuse(error)
        raise
    except OSError as error:
        failed = UpdateFailed(f"The step {steps.now} failed: {error}.", UNTOUCHED)
        steps.refuse(failed)
        raise failed from error


def roll_back(updater: Updater, asked: str = "") -> None:
    """Go back to the previous release, as an operator asks; raise `UnfitRelease` when there is none to go back to.

    `asked` names the request in the progress.
    Only answers and store have to be ready then; a release that is not even that is left again (`RolledBack`).
    """
    layout, report = updater.layout, updater.report
    try:
        with suppress(RolledBack):
            carry_through(updater)
        state = read_state(layout)
        report.release, report.file = state.previous or "", asked
        if not state.previous or not layout.is_installed(state.previous):
            raise UnfitRelease("There is no previous release on this probe.", "Install one: `make deploy`.")
        require_readable_data(layout, read_installed(layout, state.previous))
        begin_trial(updater, PendingRelease(state.previous, is_roll_back=True))
    except DeviceError as error:
        report.end("refused", error)
        raise
    except OSError as error:
        failed = UpdateFailed(f"The way back could not be begun: {error}.", UNTOUCHED)
        report.end("refused", failed)
        raise failed from error
    carry_through(updater)


class _Steps:
    """The steps of one installation; `now` is the one that is under way."""

    def __init__(self, updater: Updater) -> None:
        self._updater, self._layout, self.now = updater, updater.layout, "settle"

    def settle(self) -> None:
        """Carry through what was interrupted."""
        with suppress(RolledBack):
            carry_through(self._updater)
        self._updater.report.release = ""

    def accept(self, file: ReleaseFile) -> tuple[ReleaseManifest, tuple[bytes, bytes]]:
        """Return the manifest once a trusted key has signed it, with its bytes and their signature."""
        self._begin("verifying", 0.0, "signature")
        signed = file.signed()
        require_signature(*signed, self._layout.signers)
        manifest = read_manifest(signed[0])
        self._updater.report.release = manifest.name
        return manifest, signed

    def runs_already(self, manifest: bytes, release: ReleaseManifest) -> bool:
        """Return whether exactly this release is the committed one: then there is nothing to do.

        Raises `UnfitRelease` where the disk has damaged it: it runs, so it cannot be written anew in its place.
        """
        committed = read_state(self._layout).committed
        if committed != release.name or not self._layout.is_installed(committed):
            return False
        folder = self._layout.release(committed)
        if (folder / "manifest.json").read_bytes() != manifest:
            return False
        if harm := damage(folder):
            raise UnfitRelease(f"{committed} is committed here and damaged: {'; '.join(harm[:5])}.", NEWER)
        return True

    def plan(self, file: ReleaseFile, manifest: ReleaseManifest, signed: tuple[bytes, bytes]) -> UnpackPlan:
        """Return what is to be written, once all that can be checked before was."""
        self._begin("verifying", 0.05, "fit")
        require_fit(self._layout, read_state(self._layout), manifest)
        self._begin("verifying", 0.06, "files")
        file.check_files(manifest, self._between(0.06, 0.2))
        self._begin("verifying", 0.2, "wheels")
        plan = plan_unpacking(file, manifest, signed)
        self._begin("verifying", 0.22, "space")
        remove_others(self._layout, read_state(self._layout))
        require_space(self._layout, plan)
        return plan

    def unpack(self, file: ReleaseFile, plan: UnpackPlan) -> None:
        """Bring the release to the disk, under its name."""
        self._begin("unpacking", 0.25, "unpack")
        folder = write_staged(self._layout, plan, file, self._between(0.25, 0.4))
        self._begin("unpacking", 0.4, "compile")
        compile_modules(self._layout, folder, plan.manifest, self._between(0.4, 0.5))
        self._begin("unpacking", 0.5, "sync")
        synchronise(folder, self._between(0.5, 0.58))
        self._begin("unpacking", 0.58, "name")
        take_its_place(self._layout, folder, plan.manifest)

    def try_out(self, manifest: ReleaseManifest) -> None:
        """Note what does not work before the switch, write the trial down, and carry it through."""
        self._begin("switching", 0.59, "baseline")
        baseline = take_baseline(daemon_address(self._layout.root), self._updater.patience)
        committed = read_state(self._layout).committed
        lacking = codes_of_failed_start(self._layout.root, committed) if baseline is None else ""
        begin_trial(self._updater, PendingRelease(manifest.name, baseline=baseline, lacking=lacking))
        carry_through(self._updater)

    def refuse(self, error: DeviceError) -> None:
        """Remove what was unpacked, and tell why."""
        with suppress(OSError):
            remove_others(self._layout, read_state(self._layout))
        self._updater.report.end("refused", error, self.now)

    def _begin(self, state: StateName, progress: float, step: str) -> None:
        self.now = step
        self._updater.report.tell(state, progress, step)

    def _between(self, low: float, high: float) -> Callable[[float], None]:
        state: StateName = "verifying" if high <= 0.25 else "unpacking"
        return lambda part: self._updater.report.tell(state, low + (high - low) * part, self.now)
