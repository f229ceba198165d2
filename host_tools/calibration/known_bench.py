"""What is known beside phantom recordings: of which probe they are, and on which phantoms, in which tissue.

A recording is of the phantom whose name its file has; or else of the only one whose inclusion is the recording's truth,
within three standard deviations. The phantom's own numbers then count, not those that were entered at the probe.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from device.files.recording_file import read_recording
from device.files.toml_record import InvalidRecord
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.recording import Recording
from host_tools.scenes.phantom_set import PhantomSet, StatedPhantom
from host_tools.scenes.probe import Probe
from host_tools.scenes.scene import Press, Scene, Tissue, Waveguide
from host_tools.scenes.stated import SIGMAS

SET = "record the phantoms of one set, or name the file of this one"


@dataclass(frozen=True)
class KnownBench:
    """Waveguide of the probe, tissue of each recording's phantom, and what contradicts the recordings.

    Without tissues all phantoms are of the default one.
    """

    waveguide: Waveguide = Waveguide()  # noqa: RUF009 - frozen
    tissues: tuple[Tissue, ...] = ()
    contradictions: tuple[InvalidQuantity, ...] = ()

    def scene(self, place: int, truth: Inclusion, force_n: float) -> Scene:
        """Return the scene of one recording's press."""
        tissue = self.tissues[place] if self.tissues else Tissue()
        return Scene(truth, Press(force_n=force_n), self.waveguide, tissue)


class OnBench(NamedTuple):
    """Recordings with the truths of their phantoms, and the bench that they were made on."""

    recordings: list[Recording]
    bench: KnownBench


def on_bench(
    recordings: Sequence[Recording], names: Sequence[str], probe: Probe | None, phantoms: PhantomSet | None
) -> OnBench:
    """Return recordings, in files of these names, as made by a probe on phantoms; none given is the simulated one.

    What contradicts them is in the bench: `calibrate` tells it with all else.
    """
    of_probe = tuple(_not_of(probe, recordings)) if probe else ()
    waveguide = probe.waveguide if probe else Waveguide()
    if phantoms is None:
        return OnBench(list(recordings), KnownBench(waveguide, contradictions=of_probe))
    identified = [_identified(one, name, phantoms) for one, name in zip(recordings, names, strict=True)]
    made, tissues, problems = zip(*identified, strict=True) if identified else ((), (), ())
    return OnBench(list(made), KnownBench(waveguide, tissues, (*of_probe, *chain(*problems))))


def name_of(path: Path) -> str:
    """Return what a recording's file or folder is called: the name of its phantom."""
    return path.stem if path.suffix == ".zip" else path.name


def read_on_phantom(path: Path, phantoms: PhantomSet) -> Recording:
    """Read a recording with the truth of the phantom that its file is named as.

    A name, and no likeness of truths, says which phantom it is: a score must not choose the truth that fits best.
    Raises `InvalidRecord` with all in which file and set contradict each other, and for a bare block.
    """
    recording, name = read_recording(path), name_of(path)
    phantom = next((one for one in phantoms.phantoms if one.name == name), None)
    problems = list(another_set(recording, name, phantoms))
    if phantom is None:
        known = ", ".join(one.name for one in phantoms.with_inclusion)
        problems.append(InvalidQuantity(f"phantom of {name}", "none", f"one of {known}", "name its file as one is"))
    elif contradiction := truth_contradiction(recording, name, phantom):
        problems.append(contradiction)
    elif phantom.inclusion is None:
        action = "leave it out: it has nothing to measure"
        problems.append(InvalidQuantity(f"phantom of {name}", "a bare block", "one with an inclusion", action))
    if problems:
        raise InvalidRecord(problems)
    return replace(recording, truth=phantom.inclusion if phantom else None, phantom_serial=phantoms.serial)


def _identified(
    recording: Recording, name: str, phantoms: PhantomSet
) -> tuple[Recording, Tissue, list[InvalidQuantity]]:
    """Return a recording with its phantom's truth, that phantom's tissue, and what contradicts both."""
    problems = list(another_set(recording, name, phantoms))
    phantom = _phantom_of(recording, name, phantoms)
    if isinstance(phantom, InvalidQuantity):
        return recording, Tissue(), [*problems, phantom]
    return replace(recording, truth=phantom.inclusion, phantom_serial=phantoms.serial), phantom.tissue, problems


def _not_of(probe: Probe, recordings: Sequence[Recording]) -> Iterator[InvalidQuantity]:
    """Yield what recordings say otherwise than the file of the probe: serial number, camera, load cell."""
    action = "name the file of the probe that made the recordings, or correct the file"
    for recording in recordings:
        camera, stated = recording.camera, probe.camera
        frame, expected = (f"{one.width_px} x {one.height_px} px" for one in (camera, stated))
        for quantity, value, wanted in (("serial", recording.serial, probe.serial), ("frame", frame, expected)):
            if value != wanted:
                yield InvalidQuantity(
                    f"{quantity} of {recording.id}", value, f"{wanted} as in the probe's file", action
                )
        spans = [(recording.cell.counts_per_n, "counts_per_n", probe.cell)] if recording.cell else []
        scales = [(getattr(camera, axis), axis, stated) for axis in ("mm_per_px_x", "mm_per_px_y")]
        for number, name, section in (*spans, *scales):
            own, tolerance = getattr(section, name), getattr(section, f"{name}_tolerance")
            if abs(number - own) > SIGMAS * tolerance:
                bound = f"within {SIGMAS * tolerance:.3g} of the file's {own:g}"
                yield InvalidQuantity(f"{name} of {recording.id}", number, bound, action)


def _phantom_of(recording: Recording, name: str, phantoms: PhantomSet) -> StatedPhantom | InvalidQuantity:
    """Return the phantom that a recording is of, or why there is none."""
    truth = recording.truth
    named = next((one for one in phantoms.phantoms if one.name == name), None)
    if named is None:
        agreeing = [one for one in phantoms.with_inclusion if truth and one.agrees_with(truth)]
        if len(agreeing) == 1:
            return agreeing[0]
        found = " and ".join(one.name for one in agreeing) or "none"
        return InvalidQuantity(f"phantom of {name}", found, "one of the set", "name its file as the phantom is named")
    if named.inclusion is None:
        action = "leave it out: the three lines need an inclusion"
        return InvalidQuantity(f"phantom of {name}", "a bare block", "one with an inclusion", action)
    return truth_contradiction(recording, name, named) or named


def truth_contradiction(recording: Recording, name: str, phantom: StatedPhantom) -> InvalidQuantity | None:
    """Return in what the truth of a recording, in a file of this name, is not that of its phantom; None where it is.

    A recording without truth contradicts nothing; an inclusion of 0 mm is that of a bare block.
    """
    truth, own = recording.truth, phantom.inclusion
    if truth is None or phantom.agrees_with(truth) or (own is None and not truth.size_mm):
        return None
    said, expected = (
        "{:g} mm, {:g} mm deep, {:g} kPa".format(*one.as_tuple()) if one else "a bare block" for one in (truth, own)
    )
    action = (
        "find out which phantom was pressed: name and truth contradict each other; "
        "if the file was corrected since, remove `truth` from its recording.json"
    )
    return InvalidQuantity(f"truth of {name}", said, f"{expected} within {SIGMAS:g} tolerances", action)


def another_set(recording: Recording, name: str, phantoms: PhantomSet) -> Iterator[InvalidQuantity]:
    """Yield that a recording is of another set than that of the file, where it says so."""
    if recording.phantom_serial not in ("", phantoms.serial):
        yield InvalidQuantity(f"phantom_serial of {name}", recording.phantom_serial, f"{phantoms.serial}", SET)
