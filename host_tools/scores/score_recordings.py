"""Recordings that carry truth to a score: errors, coverage and refusals, over all presses and by octiles of the truth.

Presses of one mode are scored together, and simulated ones apart from real ones.

What is scored is what the device would say: values clipped to their intervals, and only presses that it answers.
Beside that stands the error over all presses, where one that is not answered counts as the guess of the range alone: a
device that refuses what is hard does not look better there.
Errors are compared with the Cramer-Rao bound in coordinates, which run from -1 to 1 over the trained range, the modulus
by its logarithm: there the range bounds what a press that tells nothing adds, in per cent it would be all of the mean.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import nan
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from device.measurement.arrays import Array
from device.measurement.estimate import SPOKEN, Estimate
from device.measurement.mode import Mode, mode_named
from device.measurement.parameters import NOMINAL, denormalise_unknowns, normalise_unknowns
from device.measurement.quantities import UNKNOWNS, Inclusion, InvalidQuantity
from device.measurement.recording.recording import Recording
from host_tools.calibration.gates import identity_of
from host_tools.press_models.mode_statistics import OCTILES, octile_ends, octile_of
from host_tools.workers import one_core_each

FEWEST_A_OCTILE = 5
WORTH_SHARING, SHARED_AT_ONCE = 24, 4
"""Recordings from which other processes, which take seconds to start, are worth it; and how many go to one at once."""


PRIOR_GUESS = Inclusion(*map(float, denormalise_unknowns(np.zeros(len(UNKNOWNS)))))
"""What the trained ranges alone tell of an inclusion: the mean of their coordinates."""


def percent_error(truth: Inclusion, estimate: Estimate, name: str) -> float:
    """Return the error of an unknown in %, that of `PRIOR_GUESS` where the press has no numbers."""
    value = getattr(estimate, name).value
    found = getattr(PRIOR_GUESS, name) if value is None else value
    return float(100 * abs(found / getattr(truth, name) - 1))


class Sample(NamedTuple):
    """A recording to score: what messages call it, how it is read, and what is known of its tissue, skin and place."""

    name: str
    read: Callable[[], Recording]
    nuisances: Mapping[str, float] = NOMINAL


LeastErrors = Callable[[Mode, Inclusion, Mapping[str, float]], Array]
"""Mode, truth and nuisances to the least errors [3] of any estimate, in coordinates; nan where nothing bounds them."""


def unbounded(mode: Mode, truth: Inclusion, nuisances: Mapping[str, float]) -> Array:
    """Return that nothing bounds the errors of a press."""
    return np.full(len(UNKNOWNS), np.nan)


@dataclass(frozen=True, eq=False)
class ScoredPress:
    """What a press was of, what the device said, and the least errors [3] of any estimate, as `LeastErrors`.

    `name` is what messages call it, `identity` what tells its recording from others.
    """

    truth: Inclusion
    estimate: Estimate
    least_errors: Array
    name: str = ""
    identity: str = ""

    def coordinate_errors(self) -> Array:
        """Return the errors [3] in coordinates of a press that is answered."""
        found = np.array([getattr(self.estimate, name).value for name in UNKNOWNS])
        return normalise_unknowns(found) - normalise_unknowns(np.array(self.truth.as_tuple()))


@dataclass(frozen=True)
class Score:
    """The presses that carry truth and can be read, and how many others there were."""

    presses: tuple[ScoredPress, ...]
    left_out: int = 0


def score(
    samples: Iterable[Sample],
    estimate: Callable[[Recording], Estimate],
    on_excluded: Callable[[str], None] = lambda sentence: None,
    least_errors: LeastErrors = unbounded,
) -> Score:
    """Return the score of recordings; `on_excluded` hears of every one that is left out, and why: also one given again.

    Many are scored on all cores, or where `host_tools.workers` says.
    """
    named = list(samples)
    with one_core_each():
        jobs = -1 if len(named) >= WORTH_SHARING else 1
        scoring = Parallel(n_jobs=jobs, return_as="generator", batch_size=SHARED_AT_ONCE)
        found = scoring(delayed(_scored_or_why)(sample, estimate, least_errors) for sample in named)
        presses, left_out = list[ScoredPress](), 0
        known: dict[str, str] = {}
        for sample, one in zip(named, found, strict=True):
            why = one if isinstance(one, str) else _again(one, known)
            if isinstance(one, ScoredPress) and not why:
                presses.append(one)
                known[one.identity] = sample.name
            else:
                on_excluded(f"{sample.name} is left out: {why}")
                left_out += 1
    return Score(tuple(presses), left_out)


def _again(press: ScoredPress, known: Mapping[str, str]) -> str:
    """Return that a recording was scored before, "" when it was not: several of one would be evidence of one."""
    return f"it is the recording {known[press.identity]} again" if press.identity in known else ""


def _scored_or_why(
    sample: Sample, estimate: Callable[[Recording], Estimate], least_errors: LeastErrors
) -> ScoredPress | str:
    try:
        return _scored(sample, estimate, least_errors)
    except InvalidQuantity as error:
        return str(error)


def _scored(sample: Sample, estimate: Callable[[Recording], Estimate], least_errors: LeastErrors) -> ScoredPress:
    recording = sample.read()
    if recording.truth is None:
        raise InvalidQuantity("truth", "missing", "that of a phantom", "score recordings of phantoms")
    found = estimate(recording)
    bound = least_errors(mode_named(found.mode), recording.truth, sample.nuisances)
    return ScoredPress(recording.truth, found, bound, sample.name, identity_of(recording))


class ScoredGroup(NamedTuple):
    """The presses of one mode, all simulated or all real: errors of different ones have no common mean."""

    mode: str
    simulated: bool
    presses: tuple[ScoredPress, ...]

    @property
    def name(self) -> str:
        """What a table says of whose presses it is."""
        return f"mode {self.mode}, {'simulated' if self.simulated else 'real'}"

    @property
    def answered(self) -> list[ScoredPress]:
        """The presses that have numbers."""
        return [press for press in self.presses if press.estimate.size_mm.value is not None]

    @property
    def status(self) -> dict[str, int]:
        """How many presses have each status, the most frequent first."""
        return dict(Counter(press.estimate.status for press in self.presses).most_common())

    def numbers(self) -> dict[str, Any]:
        """Return numbers of each unknown as JSON; `all_mean_percent` is over all presses, unanswered ones guessed."""
        answered = self.answered
        return {
            "unknowns": {name: _Column(answered, name).as_record() for name in UNKNOWNS} if answered else {},
            "all_mean_percent": {name: float(np.mean(_of_all(self.presses, name))) for name in UNKNOWNS},
        }

    def as_record(self) -> dict[str, Any]:
        """Return the group as JSON."""
        counts = {"presses": len(self.presses), "status": self.status, "answered": len(self.answered)}
        return {"mode": self.mode, "simulated": self.simulated, **counts, **self.numbers()}


def groups_of(scored: Score) -> list[ScoredGroup]:
    """Return the presses by mode, simulated apart from real ones, in the order in which the first of each was given.

    Raises `InvalidQuantity` when there is no press to score.
    """
    if not scored.presses:
        raise InvalidQuantity("presses with truth", 0, "at least one", "give recordings of phantoms")
    found: dict[tuple[str, bool], list[ScoredPress]] = {}
    for press in scored.presses:
        found.setdefault((press.estimate.mode, press.estimate.simulated), []).append(press)
    return [ScoredGroup(mode, simulated, tuple(presses)) for (mode, simulated), presses in found.items()]


def score_record(scored: Score) -> dict[str, Any]:
    """Return the score as JSON: counts by status, every press, and `groups` with the numbers of each.

    Those of the only group stand beside the counts, too; of several they are null, since none is of all. Null also
    stands for a number that is none. Raises `InvalidQuantity` when there is no press to score.
    """
    groups = groups_of(scored)
    of_all = ScoredGroup("", False, scored.presses)
    return {
        "presses": len(scored.presses),
        "left_out": scored.left_out,
        "status": of_all.status,
        "answered": len(of_all.answered),
        **(groups[0].numbers() if len(groups) == 1 else {"unknowns": None, "all_mean_percent": None}),
        "groups": [group.as_record() for group in groups],
        "each": [
            {"name": press.name, "truth": asdict(press.truth), "estimate": press.estimate.as_record()}
            for press in scored.presses
        ],
    }


def _of_all(presses: Sequence[ScoredPress], name: str) -> Array:
    """Return the errors [n] of an unknown in % over all presses; those without numbers are guessed."""
    return np.array([percent_error(press.truth, press.estimate, name) for press in presses])


def print_score(scored: Score, out: Console) -> None:
    """Print the score of each group; raises `InvalidQuantity` when there is no press to score."""
    for group in groups_of(scored):
        counts = ", ".join(f"{count} {name}" for name, count in group.status.items())
        out.print(f"{len(group.presses)} presses of {group.name}: {counts}")
        if answered := group.answered:
            out.print(_overall(answered, group.presses))
            octiles = _by_octiles(answered)
            if octiles.row_count:
                out.print(octiles)
    if scored.left_out:
        out.print(f"{scored.left_out} left out")


def _overall(presses: Sequence[ScoredPress], presented: Sequence[ScoredPress]) -> Table:
    table = Table("", *(SPOKEN[name] for name in UNKNOWNS), title=f"{len(presses)} answered presses")
    columns = [_Column(presses, name) for name in UNKNOWNS]
    for spoken, part in (
        ("mean error", np.mean),
        ("standard deviation", np.std),
        ("smallest error", np.min),
        ("largest error", np.max),
    ):
        table.add_row(spoken, *(f"{part(column.percent):.2f} %" for column in columns))
    table.add_row(
        "mean error of all, others guessed", *(f"{_of_all(presented, name).mean():.2f} %" for name in UNKNOWNS)
    )
    table.add_row("error / stated spread", *(f"{column.error_over_spread:.2f}" for column in columns))
    table.add_row("skill against the range", *(f"{column.skill:.2f}" for column in columns))
    table.add_row("determined", *(f"{column.known.mean():.1%}" for column in columns))
    table.add_row("truth inside 90 % intervals of these", *(column.coverage() for column in columns))
    for row in _bound_rows(columns):
        table.add_row(*row)
    return table


def _bound_rows(columns: Sequence[_Column]) -> Iterator[tuple[str, ...]]:
    """Yield how near the answers come to the best that any could be; nothing where no press has a bound.

    Root mean squares over all answered presses that have one, determined or not. Whether an unknown is determined is
    read off the same noisy press as its value, and presses chosen by their own noise are not those of the bound.
    """
    counted, presses = columns[0].bounded.sum(), len(columns[0].bounded)
    if not counted:
        return
    of = "" if counted == presses else f", {counted} of {presses}"
    errors, least = zip(*(column.rms() for column in columns), strict=True)
    yield f"RMS error, range as -1 to 1{of}", *(f"{value:.3f}" for value in errors)
    yield f"least RMS error (bound){of}", *(f"{value:.3f}" for value in least)
    yield f"RMS error / bound{of}", *(column.error_over_bound() for column in columns)


def _by_octiles(presses: Sequence[ScoredPress]) -> Table:
    columns = [_Column(presses, name) for name in UNKNOWNS]
    beside_bound = ["RMS error / bound"] if any(column.bounded.any() for column in columns) else []
    table = Table("octile of the truth", "from", "to", "mean error", "determined", "covered", *beside_bound)
    for name, column in zip(UNKNOWNS, columns, strict=True):
        if len(column.truth) < OCTILES * FEWEST_A_OCTILE:
            continue
        ends, octile = octile_ends(column.truth), octile_of(column.truth)
        for number in range(OCTILES):
            inside = octile == number
            if not inside.any():  # equal truths, all in one octile
                continue
            table.add_row(
                f"{SPOKEN[name]} {number + 1}",
                *(f"{end:.3g}" for end in ends[number : number + 2]),
                f"{column.percent[inside].mean():.2f} %",
                f"{column.known[inside].mean():.0%}",
                column.coverage(inside),
                *(column.error_over_bound(inside) for _ in beside_bound),
            )
    return table


class _Column:
    """Truths, errors and intervals [n] of one unknown."""

    def __init__(self, presses: Sequence[ScoredPress], name: str) -> None:
        found = [getattr(press.estimate, name) for press in presses]
        self.truth = np.array([getattr(press.truth, name) for press in presses])
        value, low, high, std = (
            np.array([getattr(one, part) for one in found], dtype=float) for part in ("value", "low", "high", "std")
        )
        self.known = np.array([one.identifiable for one in found])
        self.covered = (low <= self.truth) & (self.truth <= high)
        self.percent = 100 * np.abs(value - self.truth) / self.truth
        self._error, self._std = value - self.truth, std
        unknown = UNKNOWNS.index(name)
        self._coordinate_error = np.array([press.coordinate_errors()[unknown] for press in presses])
        self._least = np.array([press.least_errors[unknown] for press in presses])
        self.bounded = np.isfinite(self._least)

    def as_record(self) -> dict[str, float | int | None]:
        """Return the numbers of the unknown as JSON; `covered_ratio` is of the determined presses alone."""
        known, has_bound = self.known, bool(self.bounded.any())
        rms, least = self.rms() if has_bound else (nan, nan)
        numbers = {
            "mean_percent": self.percent.mean(),
            "std_percent": self.percent.std(),
            "smallest_percent": self.percent.min(),
            "largest_percent": self.percent.max(),
            "error_over_spread": self.error_over_spread,
            "skill": self.skill,
            "determined_ratio": known.mean(),
            "covered_ratio": self.covered[known].mean() if known.any() else nan,
            "rms_error": rms,
            "least_rms_error": least,
        }
        found = {name: float(value) if np.isfinite(value) else None for name, value in numbers.items()}
        return {**found, "determined": int(known.sum()), "bounded": int(self.bounded.sum())}

    @property
    def error_over_spread(self) -> float:
        """Root mean square error over that of the spreads, of presses whose spread the device states: 1 is honest."""
        stated = np.isfinite(self._std)
        error, std = self._error[stated], self._std[stated]
        return float(np.sqrt(np.mean(error**2) / np.mean(std**2))) if std.any() else float("nan")

    @property
    def skill(self) -> float:
        """1 - root mean square error over that of the middle of these truths."""
        guess = np.sqrt(np.mean((self.truth - self.truth.mean()) ** 2))
        return float(1 - np.sqrt(np.mean(self._error**2)) / guess) if guess > 0 else float("nan")

    def coverage(self, chosen: NDArray[np.bool_] | None = None) -> str:
        """Return the covered share of the determined presses among those chosen."""
        counted = self.known if chosen is None else self.known & chosen
        return f"{self.covered[counted].mean():.1%} of {counted.sum()}" if counted.any() else "-"

    def rms(self, chosen: NDArray[np.bool_] | None = None) -> tuple[float, float]:
        """Return root mean squares of errors and of their bounds, in coordinates, over the bounded presses chosen."""
        counted = self.bounded if chosen is None else self.bounded & chosen
        error, least = (np.sqrt(np.mean(part[counted] ** 2)) for part in (self._coordinate_error, self._least))
        return float(error), float(least)

    def error_over_bound(self, chosen: NDArray[np.bool_] | None = None) -> str:
        """Return the first over the second; no press that has a bound, no number."""
        if not (self.bounded if chosen is None else self.bounded & chosen).any():
            return "-"
        error, least = self.rms(chosen)
        return f"{error / least:.2f}"
