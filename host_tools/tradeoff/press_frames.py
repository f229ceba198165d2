"""Frames of a press: how many, of how many bits, how coarsely binned; against errors and the time to the answer.

Each press is recorded once in as many frames as anything here needs, held and over a ramp, in 8 and in 10 bits; fewer
frames are taken from it evenly, and binned by means over squares of pixels, as a camera does. Ramps are answered by
the fit of mode standard and by the networks with which it begins, held presses by mode quick, all without any
rejection.
The camera's part of the noise that the fit believes in has the size that these recordings show for each choice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import cv2
import numpy as np

from device.measurement.arrays import Array
from device.measurement.mode import FRAMES, RAMP_FROM_N, RAMP_TO_N
from device.measurement.parameters import denormalise_unknowns
from device.measurement.quantities import UNKNOWNS, Inclusion
from device.measurement.quick_mode.model import QuickModel
from device.measurement.quick_mode.profile import quick_press
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.model import RampModel
from device.measurement.ramp_modes.noise import ErrorLevels, PressNoise, light_ratio
from device.measurement.ramp_modes.radial_profile import press_profile
from device.measurement.recording.frame_light import TOUCHED_N
from device.measurement.recording.recording import Recording
from device.measurement.recording.tactile_image import Counts
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.phantom import TARGET_N, PhantomProtocol, phantom_recording
from host_tools.pages.benchmark import Chapter
from host_tools.press_models.measured_noise import exact_rows
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.recorded_presses import HELD_STRAY_N, drifted, in_parallel, scenario_of
from host_tools.press_models.seeds import derived_seed, press_seed
from host_tools.tradeoff.fronts import Panel, front_figure, front_table, unknown_panels
from host_tools.tradeoff.pareto import Choice, needless_everywhere
from host_tools.tradeoff.yardstick import cost

Bits = Literal[8, 10]
HELD, NETWORKS, FITTED, BINNED, TEN_BITS = (
    "held",
    "ramp, networks",
    "ramp, fit",
    "ramp, fit, binned",
    "ramp, fit, 10 bits",
)
MOST_FRAMES = 64


@dataclass(frozen=True)
class FrameChoice:
    """So many frames of a held press or a ramp, of so many bits, each `binned` by so many pixels along each side."""

    family: str
    frames: int
    bits: Bits = 8
    binned: int = 1

    @property
    def name(self) -> str:
        """What a figure says of it."""
        return f"{self.frames}" if self.binned == 1 else f"{self.frames} by {self.binned}"

    @property
    def chosen(self) -> bool:
        """Whether it is what a mode takes."""
        modes = {HELD: "quick", FITTED: "standard"}
        return self.family in modes and self.frames == FRAMES[modes[self.family]].count  # type: ignore[index]


CHOICES = (
    *(FrameChoice(HELD, frames) for frames in (1, 4, 16, 64)),
    *(FrameChoice(NETWORKS, frames) for frames in (8, 10, 16, 40, 64)),
    *(FrameChoice(FITTED, frames) for frames in (8, 10, 40, 64)),
    *(FrameChoice(BINNED, 40, binned=binned) for binned in (2, 4, 8)),
    FrameChoice(BINNED, 10, binned=8),
    *(FrameChoice(TEN_BITS, frames, bits=10) for frames in (8, 40)),
)
PRESSES = 24
SHORT: dict[str, Any] = {"presses": 2, "choices": (CHOICES[0], CHOICES[5], CHOICES[10], CHOICES[-1])}
"""Enough to try the chain."""


class ReadPress(NamedTuple):
    """What a choice makes of one press: its row with every drift, and without any.

    `direction_rad` [1] is where the inclusion lies in the image. A held press says neither that nor the last.
    """

    row: Array
    direction_rad: Array | None = None
    exact: Array | None = None


def frames_chapter(
    model: RampModel,
    quick: QuickModel,
    tables: ProbeTables,
    *,
    choices: Sequence[FrameChoice] = CHOICES,
    presses: int = PRESSES,
    jobs: int = -1,
) -> Chapter:
    """Return the fronts of frames, bits and binning over random presses."""
    seed = derived_seed(1, "trade-off of the frames")
    parameters = draw_parameters(presses, np.random.default_rng(seed))
    read = in_parallel(lambda i: _read(tables, parameters[i], press_seed(seed, i), choices), presses, jobs)
    exact = exact_rows(tables, parameters, seed=seed, jobs=jobs)
    timing, truth = _Recordings(tables, parameters[0], press_seed(seed, 0)), parameters[:, : len(UNKNOWNS)]
    points = []
    for choice, of_choice in zip(choices, zip(*read, strict=True), strict=True):
        answers = _answers(choice, of_choice, exact, model, quick)
        percent = _percent(answers, of_choice, truth, jobs)
        takes = _time(choice, timing, answers)
        points.append([Choice(choice.name, choice.family, takes, float(p), chosen=choice.chosen) for p in percent])
    return _chapter(unknown_panels(points), presses)


def _percent(answers: _Answers, read: Sequence[ReadPress], truth: Array, jobs: int) -> Array:
    """Return the median errors [3] in % of answers to presses, truth [n, 3]."""
    found = np.array(in_parallel(lambda i: answers(read[i]), len(read), jobs))
    return np.asarray(100 * np.median(np.abs(found / truth - 1), axis=0))


def _chapter(panels: Sequence[Panel], presses: int) -> Chapter:
    named = [[replace(one, name=f"{one.family}: {one.name}") for one in panel.choices] for panel in panels]
    caption = "Time to the answer and error by frames, bits and binning"
    return Chapter(
        "Frames, bits and binning",
        f"{presses} random presses over the trained ranges, the same ones for every choice, with every drift.",
        "host_tools/tradeoff/press_frames.py",
        tables=(front_table("Every choice", panels),),
        figures=(front_figure("tradeoff_frames.svg", caption, panels),),
        facts={"needless": needless_everywhere(named), "presses": presses, "most_frames": MOST_FRAMES},
    )


class _Recordings:
    """One press, held and over a ramp, in either number of bits; recorded when first asked for."""

    def __init__(self, tables: ProbeTables, at: Array, seed: int) -> None:
        self._tables, self._at, self._seed = tables, at, seed
        self._kept: dict[tuple[bool, Bits], tuple[Recording, Recording]] = {}

    def of(self, choice: FrameChoice) -> tuple[Recording, Recording]:
        """Return the press in the frames of a choice, with every drift and without any."""
        key = (choice.family == HELD, choice.bits)
        if key not in self._kept:
            self._kept[key] = self._record(*key)
        drifts, exact = (binned(thinned(one, choice.frames), choice.binned) for one in self._kept[key])
        return drifts, exact

    def _record(self, held: bool, bits: Bits) -> tuple[Recording, Recording]:
        rng = np.random.default_rng([self._seed, 1])
        angle, offset_mm = rng.uniform(0, 2 * np.pi), float(self._at[-1])
        place = ProbePlacement(offset_mm * float(np.cos(angle)), offset_mm * float(np.sin(angle)))
        forces = (TARGET_N,) if held else tuple(np.linspace(RAMP_FROM_N, RAMP_TO_N, MOST_FRAMES))
        protocol = PhantomProtocol(forces, frames=MOST_FRAMES if held else 1, place=place)
        protocol = replace(protocol, stray_n=HELD_STRAY_N) if held else protocol
        scenario = scenario_of(self._at)
        scenario = replace(scenario, sensor=replace(scenario.sensor, bits=bits))
        inclusion = Inclusion(*map(float, self._at[: len(UNKNOWNS)]))
        exact = phantom_recording(inclusion, self._tables, seed=self._seed, protocol=protocol, scenario=scenario)
        return drifted(exact, rng, ErrorLevels()), exact


def _read(tables: ProbeTables, at: Array, seed: int, choices: Sequence[FrameChoice]) -> list[ReadPress]:
    """Return what every choice reads of one press."""
    recordings = _Recordings(tables, at, seed)
    read = []
    for choice in choices:
        drifts, exact = recordings.of(choice)
        if choice.family == HELD:
            read.append(ReadPress(quick_press(drifts).row))
        else:
            read.append(_read_ramp(drifts)._replace(exact=press_profile(exact).as_row()))
    return read


def _read_ramp(recording: Recording) -> ReadPress:
    profile = press_profile(recording)
    return ReadPress(profile.as_row(), np.array([profile.direction_rad]))


class _Answers:
    """What a press as a choice reads it is answered with: size, depth and modulus [3]."""

    def __init__(self, choice: FrameChoice, model: RampModel, quick: QuickModel, noise: PressNoise) -> None:
        self._family, self._model, self._quick = choice.family, model, quick
        self._fit = RampAnswers(model.answers.surrogate, noise)

    def __call__(self, press: ReadPress) -> Array:
        rows = press.row[None]
        if self._family == HELD:
            return np.asarray(self._quick.bundle.estimate(rows).estimate[0])
        guesses = self._model.first_guesses(rows)
        if self._family == NETWORKS:
            return np.asarray(denormalise_unknowns(guesses[0]))
        return np.asarray(denormalise_unknowns(self._fit.answer(rows, guesses, press.direction_rad).mean))


def _answers(
    choice: FrameChoice, read: Sequence[ReadPress], exact: Array, model: RampModel, quick: QuickModel
) -> _Answers:
    """Return what answers a choice; its camera noise is that of ten frames, times what these recordings show."""
    noise = model.answers.noise
    recorded = [one.exact for one in read if one.exact is not None]
    if recorded:
        errors = (np.array(recorded) - exact) / light_ratio(exact)
        times = float(np.median(np.mean(errors**2, axis=0) / np.diag(noise.camera)))
        noise = replace(noise, camera=times * noise.camera)
    return _Answers(choice, model, quick, noise)


def _time(choice: FrameChoice, recordings: _Recordings, answers: _Answers) -> float:
    """Return the cost of a press's way from its frames to the answer, in yardsticks."""
    recording, _ = recordings.of(choice)
    if choice.family == HELD:
        return cost(lambda: answers(ReadPress(quick_press(recording).row))).yardsticks
    return cost(lambda: answers(_read_ramp(recording)), 2).yardsticks


def thinned(recording: Recording, count: int) -> Recording:
    """Return the recording with `count` touched frames of each role, taken evenly; the untouched ones stay."""
    frames = [one for one in recording.frames if one.role != "press" and one.force_n <= TOUCHED_N]
    for role in ("reference", "press"):
        touched = [one for one in recording.with_role(role) if one.force_n > TOUCHED_N or role == "press"]
        frames += [touched[k] for k in np.linspace(0, len(touched) - 1, count).round().astype(int)]
    return replace(recording, frames=tuple(frames))


def binned(recording: Recording, times: int) -> Recording:
    """Return the recording with squares of so many pixels averaged, in 16 bits; the rows left over are cut evenly."""
    if times == 1:
        return recording
    camera = recording.camera
    per_count = 256 if camera.bits == 8 else 1

    def means(counts: Counts) -> Counts:
        height, width = counts.shape
        top, left = height % times // 2, width % times // 2
        kept = counts[top : top + height // times * times, left : left + width // times * times].astype(np.float32)
        size = (width // times, height // times)
        return np.asarray((cv2.resize(kept, size, interpolation=cv2.INTER_AREA) * per_count).round(), dtype=np.uint16)

    frames = tuple(replace(frame, counts=means(frame.counts)) for frame in recording.frames)
    height, width = frames[0].counts.shape
    coarse = replace(
        camera,
        width_px=width,
        height_px=height,
        bits=16,
        mm_per_px_x=times * camera.mm_per_px_x,
        mm_per_px_y=times * camera.mm_per_px_y,
    )
    return replace(recording, camera=coarse, frames=frames)
