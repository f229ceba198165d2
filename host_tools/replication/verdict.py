"""What docs/paper_protocol.md says before and after its chapters: the paper's words, this run's numbers, a verdict."""

from __future__ import annotations

import numpy as np

from device.measurement.arrays import Array
from host_tools.pages.document import Cover
from host_tools.paper_network.evaluate import PAPER_PERCENT
from host_tools.replication.chapters import NO_BETTER, growth, light_growth
from host_tools.replication.methods_chapter import error_ratio, loss_ratio, time_ratio
from host_tools.replication.networks import OURS
from host_tools.replication.protocol import ProtocolStep
from host_tools.replication.study import LIGHTS, PaperStudy
from host_tools.verification.light.verdict import Finding

OPENING = (
    "Lee & Won (2013) report relative errors of 6.98 % in size, 7.17 % in depth and 5.07 % in Young's modulus. This",
    "page repeats their protocol on this project's finite elements and virtual probe, to the letter as far as there",
    "is one, and then takes its assumptions away one by one. **Everything here is simulated**: whether real phantoms",
    "give the paper's figures cannot be seen from here.",
    "Unless the command below names others, the scenes are those of",
    "`host_tools sweep --scenes 134 --seed 1 --out build/sweep.nc`:",
)
TABLE_HEAD = (
    "",
    "| what the paper does or says | measured here | verdict |",
    "|---|---|---|",
)
LIMITS = (
    "**The paper's nine inclusions are not known to us.** Ours are the nine of the 134 scenes that are nearest to an "
    "orthogonal array over the part of the box that can be made and seen. The smallest one's error decides most means "
    "of the size.",
    "**The paper's phantoms, light and camera were real.** Noise-free images of a virtual probe are kinder than any "
    "real one, and the same program made the scenes that train and the phantoms' exact features.",
    "**Young's modulus is not determined by our three features** of one press in small strain. Why the paper's came "
    "out at 5 %, nothing tried here explains.",
    "**Nine phantoms are few.** Another nine may well change differences of a tenth between rows.",
    "**Bounds are not predictions.** They mark what would overturn a sentence on this page, and were set after a first "
    "measurement.",
)


def cover(study: PaperStudy) -> Cover:
    """Return title, verdicts and limits."""
    rows = [finding.row() for finding in findings(study)]
    scenes = f"{len(study.all.truth)} are used; {study.excluded_rows}, failed or without a number, are left out."
    return Cover("The paper's protocol, and what it is worth", (*OPENING, scenes, *TABLE_HEAD, *rows), LIMITS)


def findings(study: PaperStudy) -> tuple[Finding, ...]:
    """Return what the paper does and says, with this run's numbers."""
    parts = (_size_and_depth, _modulus, _regressions, _noise, _light, _trials, _algorithm)
    return tuple(part(study) for part in parts)


def _size_and_depth(study: PaperStudy) -> Finding:
    found, paper = study.mean_percent("linear", ProtocolStep.LETTER), np.array(PAPER_PERCENT["mean"])
    return Finding(
        "Mean errors of 6.98 % in size and 7.17 % in depth",
        f"{found[0]:.1f} % and {found[1]:.1f} % to the letter, in the light that the paper assumes",
        "reached, in that light and by our phantoms",
        bool((found[:2] <= paper[:2]).all()),
    )


def _modulus(study: PaperStudy) -> Finding:
    linear, physical = (study.mean_percent(light, ProtocolStep.LETTER)[2] for light in LIGHTS)
    guess = study.constant_percent[2]
    return Finding(
        "Mean error of 5.07 % in Young's modulus",
        f"{linear:.0f} % to the letter, {physical:.0f} % in traced light; a constant guess: {guess:.0f} %",
        "not reproduced: the modulus is not determined",
        bool(min(linear, physical) >= NO_BETTER * guess),
    )


def _regressions(study: PaperStudy) -> Finding:
    linear, physical = (growth(study, light, ProtocolStep.LETTER, ProtocolStep.REFITTED)[:2] for light in LIGHTS)
    return Finding(
        "Regressions fitted on all nine phantoms, the scored one included",
        f"fitted on the other eight, errors of size and depth are {_times(linear)} times as large, "
        f"{_times(physical)} in traced light",
        "it flatters",
        bool(np.min([linear, physical]) >= 1.0),
    )


def _noise(study: PaperStudy) -> Finding:
    linear, physical = (growth(study, light, ProtocolStep.REFITTED, ProtocolStep.NOISE)[:2] for light in LIGHTS)
    return Finding(
        "No noise in the tactile data",
        f"with camera and hand, errors of size and depth are {_times(linear)} times as large, "
        f"{_times(physical)} in traced light",
        "it flatters the depth; in traced light it hardly matters",
        bool(linear[1] >= 1.1 and physical[1] <= 1.1),
    )


def _light(study: PaperStudy) -> Finding:
    ratio = light_growth(study)
    least = [study.views(light).r_squared().min() for light in LIGHTS]
    return Finding(
        "Image and deformation are straight lines of each other",
        f"in traced light errors of size and depth are {_times(ratio[:2])} times as large; "
        f"least R2 of the lines {least[0]:.3f}, then {least[1]:.2f}",
        "the assumption that is worth most",
        bool(ratio[:2].min() >= 1.5),
    )


def _trials(study: PaperStudy) -> Finding:
    ratio = study.single_trial_percent / study.mean_percent("linear", ProtocolStep.LETTER)
    return Finding(
        "The mean of 100 trials is scored",
        f"errors of size and depth of one network are {_times(ratio[:2])} times as large",
        "the figures are those of an averaged ensemble",
        bool(ratio[0] >= 1.2),
    )


def _algorithm(study: PaperStudy) -> Finding:
    stopped, ends = study.side_by_side[OURS.name], study.ends
    error = error_ratio(stopped)[:2]
    return Finding(
        "SCG fails to find the optimum in some cases; Levenberg-Marquardt is proposed",
        f"without early stopping LM ends at {loss_ratio(ends):.2f} of SCG's loss; with it, in this project's networks, "
        f"errors of size and depth are {_times(error)} times SCG's, in {time_ratio(stopped):.2f} of its time",
        "SCG is slow, not stuck; LM saves time, but its lower loss is not a smaller error",
        bool(loss_ratio(ends) <= 0.75 and np.all(np.abs(error - 1) <= 0.15) and time_ratio(stopped) <= 0.8),
    )


def _times(ratios: Array) -> str:
    return " and ".join(f"{ratio:.1f}" for ratio in ratios)
