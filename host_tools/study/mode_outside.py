"""How often each mode refuses numbers for presses that are not of one round inclusion inside the trained ranges.

The refusals of ordinary presses are the false ones. All are recorded through the simulated camera with every drift.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from device.measurement.mode import Mode
from device.measurement.press_profile import press_profile
from device.measurement.profile_estimate import doubts_about, stands_out
from device.measurement.profile_model import ProfileModel
from host_tools.inverse.recorded_presses import in_parallel
from host_tools.study.benchmark import Chapter, at_least, at_most
from host_tools.study.outside_presses import Kind

SHARE = "share refused"
REFUSED_AT_LEAST, FALSE_AT_MOST = 0.95, 0.05


def outside_chapter(model: ProfileModel, kinds: Sequence[Kind], modes: Sequence[Mode], *, jobs: int = -1) -> Chapter:
    """Return the share of refused presses of each kind in each mode; the first kind is the ordinary one."""
    benchmarks = []
    for mode in modes:
        for number, kind in enumerate(kinds):
            case = f"{mode}, {kind.name} ({kind.count})"
            share = refused_share(model, kind, mode, counts_unseen=number > 0, jobs=jobs)
            judged = (
                at_least(case, SHARE, share, REFUSED_AT_LEAST) if number else at_most(case, SHARE, share, FALSE_AT_MOST)
            )
            benchmarks.append(judged)
    return Chapter(
        title="What is not one round inclusion gets no numbers",
        claim=(
            "Each press is refused for its misfit, its elongation, a size or depth that would rather lie outside its "
            "range, or because nothing stands out. Ordinary presses are those of the trained ranges."
        ),
        source="device/measurement/profile_estimate.py; host_tools/study/outside_presses.py",
        benchmarks=tuple(benchmarks),
    )


def refused_share(model: ProfileModel, kind: Kind, mode: Mode, *, counts_unseen: bool = True, jobs: int = -1) -> float:
    """Return the share of a kind's presses that a mode refuses.

    A lump that does not stand out gets no numbers either; with `counts_unseen` false such presses are left out.
    """
    profiles = in_parallel(lambda i: press_profile(kind.record(mode, i)), kind.count, jobs)
    seen = np.array([stands_out(profile, model.answers.noise[mode]) for profile in profiles])
    rows = np.array([profile.as_row() for profile in profiles])
    mean, spread = model.networks(rows)
    answers, limits = model.answers, model.limits[mode]

    def is_doubted(i: int) -> bool:
        return bool(doubts_about(profiles[i], answers.answer(rows[i], mode, mean[i], spread[i]), limits))

    doubted = np.array(in_parallel(is_doubted, kind.count, jobs))
    return float(np.mean(doubted | ~seen)) if counts_unseen else float(np.mean(doubted[seen]))
