"""How often each mode refuses numbers for presses that are not of one round inclusion inside the trained ranges.

The refusals of ordinary presses are the false ones. All are recorded through the simulated camera with every drift,
and answered as the device answers them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from device.measurement.estimate import Estimate
from device.measurement.mode import Mode
from device.measurement.profile_model import RAMP_MODES
from device.measurement.recording import Recording
from host_tools.inverse.recorded_presses import in_parallel
from host_tools.study.benchmark import Chapter, Table, at_least, at_most
from host_tools.study.outside_presses import Kind

SHARE = "share refused"
REFUSED_AT_LEAST, FALSE_AT_MOST = 0.95, 0.05

Answer = Callable[[Recording, Mode], Estimate]


def outside_chapter(answer: Answer, kinds: Sequence[Kind], *, jobs: int = -1) -> Chapter:
    """Return the share of refused presses of each kind in each mode; the first kind is the ordinary one.

    Mode quick is shown and not judged: at one force some of these cannot be told from a lump.
    """
    benchmarks = []
    for mode in RAMP_MODES:
        for number, kind in enumerate(kinds):
            case, share = (
                f"{mode}, {_spoken(kind)}",
                refused_share(answer, kind, mode, counts_unseen=number > 0, jobs=jobs),
            )
            judged = (
                at_least(case, SHARE, share, REFUSED_AT_LEAST) if number else at_most(case, SHARE, share, FALSE_AT_MOST)
            )
            benchmarks.append(judged)
    quick = tuple(
        (_spoken(kind), f"{refused_share(answer, kind, 'quick', counts_unseen=number > 0, jobs=jobs):.0%}")
        for number, kind in enumerate(kinds)
    )
    return Chapter(
        title="What is not one round inclusion gets no numbers",
        claim=(
            "Each press is refused for its misfit, its elongation, the odds of a size or depth outside its range, or "
            "because nothing stands out. Ordinary presses are those of the trained ranges; those in which "
            "nothing stands out are not counted among them. Mode quick sees one force: it cannot "
            "tell gel, whose light does not grow with the force, from a lump. On the probe such a press ends "
            "with fault E501 in every mode, because the way to the hold is seen there; a recording alone does not "
            "hold it."
        ),
        source="device/measurement/profile_estimate.py, held_estimate.py; host_tools/study/outside_presses.py",
        benchmarks=tuple(benchmarks),
        tables=(Table("Mode quick", ("presses", SHARE), quick),),
    )


def refused_share(answer: Answer, kind: Kind, mode: Mode, *, counts_unseen: bool = True, jobs: int = -1) -> float:
    """Return the share of a kind's presses that a mode refuses.

    A lump that does not stand out gets no numbers either; with `counts_unseen` false such presses are left out.
    """
    estimates = in_parallel(lambda i: answer(kind.record(mode, i), mode), kind.count, jobs)
    refused = [one.size_mm.value is None for one in estimates if counts_unseen or not _is_unseen(one)]
    return float(np.mean(refused)) if refused else float("nan")


def _is_unseen(estimate: Estimate) -> bool:
    return estimate.size_mm.value is None and estimate.status == "not_identifiable"


def _spoken(kind: Kind) -> str:
    return f"{kind.name} ({kind.count})"
