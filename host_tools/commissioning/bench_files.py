"""Files of a bench to what commissioning begins with: the probe and its phantoms as stated, and the ramps on them.

All that is wrong in any of them is told together, before anything is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

from device.files.recording_file import read_recording
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.recording import Recording
from host_tools.calibration.gates import CalibrationRejected
from host_tools.calibration.known_bench import name_of
from host_tools.commissioning.phantom_ramps import PhantomRamp, counts_per_n_of, phantom_ramps
from host_tools.commissioning.probe_prior import ProbePrior, not_of_design, prior_of
from host_tools.scenes.phantom_set import BLOCKS_NEEDED, PhantomSet, read_phantoms
from host_tools.scenes.probe import Probe
from host_tools.scenes.probe_file import read_probe

OfFile = TypeVar("OfFile")


@dataclass(frozen=True, eq=False)
class StatedBench:
    """A probe and its phantoms as their files say, recordings by their names, ramps in them, and what is expected."""

    probe: Probe
    phantoms: PhantomSet
    recordings: list[Recording]
    names: list[str]
    ramps: list[PhantomRamp]
    prior: ProbePrior

    @property
    def block_names(self) -> list[str]:
        """The names of the recordings on bare blocks."""
        return [name for name, ramp in zip(self.names, self.ramps, strict=True) if not ramp.has_inclusion]


def read_bench(recordings: Sequence[Path], probe: Path, phantoms: Path, design: Probe) -> StatedBench:
    """Return what files say of ramps on phantoms, made by a probe of a design.

    Raises `CalibrationRejected` with everything that is wrong in any file, or contradicts another.
    """
    problems: list[InvalidQuantity] = []
    made_by = _told(partial(read_probe, probe), problems)
    problems += not_of_design(made_by, design) if made_by else ()
    stated = _told(partial(read_phantoms, phantoms, blocks_needed=BLOCKS_NEEDED), problems)
    names = [name_of(path) for path in recordings]
    read = [_told(partial(read_recording, path), problems, f"{path}: ") for path in recordings]
    known = [(one, name) for one, name in zip(read, names, strict=True) if one]
    unread = [name for one, name in zip(read, names, strict=True) if one is None]
    taken: list[Recording] = [one for one, _ in known]
    taken_on = [name for _, name in known]
    ramps = _told(partial(phantom_ramps, taken, taken_on, stated, made_by, unread), problems)
    if problems or made_by is None or stated is None or ramps is None:
        raise CalibrationRejected(problems)
    return StatedBench(made_by, stated, taken, taken_on, ramps, prior_of(made_by, design, counts_per_n_of(taken)))


def _told(read: Callable[[], OfFile], problems: list[InvalidQuantity], above: str = "") -> OfFile | None:
    """Return what is read; or None, and add what is wrong with it to the problems, `above` before each quantity."""
    try:
        return read()
    except InvalidQuantity as error:
        found: Sequence[InvalidQuantity] = getattr(error, "problems", [error])
        problems += [InvalidQuantity(above + one.quantity, one.value, one.bound, one.action) for one in found]
        return None
